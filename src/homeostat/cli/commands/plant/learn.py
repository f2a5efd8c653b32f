"""``homeostat plant learn``: reference values from fault-free runs of a plant, or from its history."""

import argparse
import sys
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.journal.beside.files import write_whole
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.learning import RUNS, learned

TOLD_EVERY = 10
"""Runs after which a line says how far it is, where nobody watches a terminal."""


def carry_out(options: argparse.Namespace) -> int:
    """Learn and write the reference values; 0."""
    spanned = (options.last, getattr(options, "from"), options.to)
    if options.from_history is None and spanned != (None, None, None):
        raise UsageError("--last, --from and --to name a span of a history; name that with --from-history")
    plant = load_plant(options.case, learned=False)
    if options.from_history is None:
        content, source = learned(plant, _told), f"{RUNS} fault-free runs"
    else:
        content, source = _from_history(plant, options.from_history, spanned)
    path = plant.files.folder / BASELINES
    write_whole(path, content)
    print(f"{path}: {len(plant.description.features)} features, learned from {source}")
    return 0


def _from_history(plant: Plant, folder: Path, spanned: tuple[str | None, str | None, str | None]) -> tuple[bytes, str]:
    """The reference values that a span of a history teaches, and what it is."""
    from homeostat.history.embedded.reading import EmbeddedHistory  # pyarrow loads slowly
    from homeostat.history.store import HistoryError
    from homeostat.history.times import read_span, told_time
    from homeostat.plants.teaching.from_history import learned_from_history

    history = EmbeddedHistory(folder)
    extent = history.extent()
    if extent is None:
        raise HistoryError(f"the history in {str(folder)!r} has no samples yet")
    span = read_span(*spanned, extent)
    content = learned_from_history(plant, history, span)
    return content, f"the history from {told_time(span.from_us)} to {told_time(span.to_us)}"


def _told(done: int, of: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{done} of {of} fault-free runs", end="\n" if done == of else "", file=sys.stderr, flush=True)
    elif done % TOLD_EVERY == 0:
        print(f"homeostat: {done} of {of} fault-free runs", file=sys.stderr)
