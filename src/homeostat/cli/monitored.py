"""What `homeostat monitor` judges: a file with a table, a run, or the history of a plant."""

import argparse
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.detectors.tables.reading import read_table
from homeostat.detectors.tables.table import SignalTable
from homeostat.journal.beside.files import JOURNAL, MANIFEST


def read(path: Path, options: argparse.Namespace) -> SignalTable:
    """The table in ``path``, or what the run or the history in it measured, with the plant's features beside."""
    spanned = options.last, getattr(options, "from"), options.to
    if not path.is_dir():
        if spanned != (None, None, None) or options.case is not None:
            raise UsageError(f"--last, --from, --to and --case are for runs and histories; {str(path)!r} is a file")
        return read_table(path, options.time, options.ignore)
    is_run = (path / JOURNAL).exists() or (path / MANIFEST).exists()
    table = _of_run(path, options) if is_run else _of_history(path, options, spanned)
    return table.without(options.ignore)


def _of_run(path: Path, options: argparse.Namespace) -> SignalTable:
    from homeostat.cli.recorded_plant import plant_of_run
    from homeostat.evaluate.recorded.signals import signals_of_run
    from homeostat.journal import RunStarted, read_events
    from homeostat.record.decode import decode

    started = next((e for e in map(decode, read_events(path)) if isinstance(e, RunStarted)), None)
    if started is None:
        raise UsageError(f"{str(path)!r} has not begun; take another run")
    return signals_of_run(path, plant_of_run(started, path, options.case)[0])


def _of_history(
    path: Path, options: argparse.Namespace, spanned: tuple[str | None, str | None, str | None]
) -> SignalTable:
    from homeostat.evaluate.recorded.signals import signals_of_history
    from homeostat.history.embedded.reading import EmbeddedHistory
    from homeostat.history.store import HistoryError
    from homeostat.history.times import read_span
    from homeostat.plants.plant import load_plant

    history = EmbeddedHistory(path)
    extent = history.extent()
    if extent is None:
        raise HistoryError(f"the history in {str(path)!r} has no samples yet")
    plant = load_plant(options.case, learned=False).description if options.case is not None else None
    return signals_of_history(history, str(path), read_span(*spanned, extent), plant)
