"""The plant that a recorded run is told in."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from homeostat.cli.commands.trace_verify import trusted
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable
from homeostat.evaluate.recorded.plant import recorded_folder, recorded_plant_of
from homeostat.journal import BrokenChain, RunStarted, read_events
from homeostat.journal.signing.keys import KeyTrouble
from homeostat.journal.verify.verify import verify
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.files.places import shipped_names
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.decode import DecodeError, decode
from homeostat.record.result import ResultError, read_result
from homeostat.record.story.unknown_plant import unknown_plant


def plant_of_run(started: RunStarted, run_dir: Path, given: str | None) -> tuple[PlantDescription, Plant | None, str]:
    """The words and units that tell a run, the plant that they are of, and what a reader must know of it.

    Where the plant is not to be had, what the run says itself tells it; a reader is told on standard error, too.

    A plant has code, so where it is, is not taken from a journal that nobody vouches for.
    """
    try:
        if given is None and (place := unvouched(started, run_dir)) is not None:
            raise PlantError(f"nobody vouches for where the run's plant is ({place!r}); name its folder with --case")
        plant = recorded_plant_of(started, given)
        return plant.description, plant, ""
    except (PlantError, GraphError) as error:
        if given is not None:
            raise
        installed = recorded_folder(started) is None and started.case in shipped_names()
        words = "told in the words of the installed plant" if installed else "told without the plant's words and units"
        notice = printable(f"{error}; {words}")
        print(f"homeostat: {notice}", file=sys.stderr)
        if installed:
            plant = load_plant(str(INSTALLED / started.case))
            return plant.description, plant, notice
        return unknown_plant(started.case, _told(run_dir)), None, notice


def unvouched(started: RunStarted, run_dir: Path) -> str | None:
    """Where the run says that its plant is, if no trusted key signed that and it is not one of this package; else None.

    What a journal calls a plant may be a path, or the name of a folder where somebody happens to stand.
    """
    folder = recorded_folder(started)
    place = started.case if folder is None and started.case not in shipped_names() else folder
    return None if place is None or _vouched(run_dir) else place


def _vouched(run_dir: Path) -> bool:
    """Whether a trusted key signed how the run began."""
    try:
        return verify(run_dir, trusted(None)).vouched.lines > 0
    except KeyTrouble:
        return False


def _told(run_dir: Path) -> Iterator[object]:
    """Everything that the run has kept, up to where it cannot be read any more."""
    with contextlib.suppress(BrokenChain, DecodeError):
        for record in read_events(run_dir):
            yield decode(record)
    with contextlib.suppress(ResultError):
        yield read_result(run_dir)
