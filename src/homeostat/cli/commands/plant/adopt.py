"""``homeostat plant adopt``: the unknown of a run, whose cause a person has found, becomes a fault of the tables."""

import argparse
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.cli.recorded_plant import unvouched
from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.evaluate.lint.check import check
from homeostat.evaluate.recorded.adoption import Adoption, adoption
from homeostat.evaluate.recorded.plant import recorded_plant_of
from homeostat.journal import RunStarted, read_events
from homeostat.journal.beside.files import write_whole
from homeostat.plants.files.folder import INSTALLED, SIGNATURE
from homeostat.plants.files.tables import as_lines, extended, table_file
from homeostat.plants.plant import Plant
from homeostat.record.run_record import RunRecord

OPTION = "--plant"
"""What names the folder of the run's plant."""


def carry_out(options: argparse.Namespace) -> int:
    """Show the rows, write them where they are agreed to, and check the folder then; 1 where it is not clean."""
    run_dir = run_directory(options.run)
    record = RunRecord.of(read_events(run_dir))
    if record.started is None:
        raise UsageError(f"the journal of {str(run_dir)!r} does not begin with a run; name another one")
    plant = _plant(record.started, run_dir, options.plant)
    adopted = adoption(record, plant.description, options.name, options.label.strip(), options.mode)
    source, folder = plant.files.folder, _target(plant, options.into)
    made = extended(plant, adopted.rows)
    for line in _told(adopted, run_dir, folder):
        print(printable(line))
    if not options.yes:
        print("nothing is written; say --yes to write it")
        return 0
    if folder != source:
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__pycache__", SIGNATURE), dirs_exist_ok=True)
    for name, content in made.items():
        write_whole(folder / name, content)
    signed = f"; it was signed, and {SIGNATURE} is void: sign it again" if (folder / SIGNATURE).exists() else ""
    print(printable(f"{folder}: has the fault {adopted.fault['id']!r} now{signed}"))
    return _checked(folder)


def _checked(folder: Path) -> int:
    """Show what the plain check finds in the folder now; 1 where something counts."""
    checked = check(str(folder), said=lambda finding: print(printable(str(finding)), flush=True))
    counted = sum(finding.counts for finding in checked.findings)
    told = "clean" if checked.clean else f"{counted} finding{'' if counted == 1 else 's'}"
    print(printable(f"{folder}: checked, {told}"))
    return 0 if checked.clean else 1


def _plant(started: RunStarted, run_dir: Path, given: str | None) -> Plant:
    """The plant of the run, in its configuration; where it is, is not taken from a journal that nobody vouches for."""
    if given is None and (place := unvouched(started, run_dir)) is not None:
        raise UsageError(f"nobody vouches for where the run's plant is ({place!r}); name its folder with {OPTION}")
    return recorded_plant_of(started, given, OPTION)


def _target(plant: Plant, into: Path | None) -> Path:
    """The folder whose tables get the rows; UsageError where they cannot be written."""
    folder = plant.files.folder
    if into is None and folder.parent == INSTALLED:
        raise UsageError(f"{str(folder)!r} ships with the package; say --into DIR to have a copy with the fault there")
    if into is not None:
        if into.exists() and (not into.is_dir() or any(into.iterdir())):
            raise UsageError(f"{str(into)!r} is there already; choose a new or empty directory")
        return into.absolute()
    tables = (folder / table_file(name) for name in ("faults", "symptom_faults"))
    if locked := [path for path in (folder, *tables) if not os.access(path, os.W_OK)]:
        raise UsageError(f"{str(locked[0])!r} cannot be written; say --into DIR to have a copy with the fault there")
    return folder


def _told(adopted: Adoption, run_dir: Path, folder: Path) -> Iterator[str]:
    """What is added to which tables."""
    mode = adopted.mode
    if adopted.cut:
        yield adopted.cut
    yield f"{mode.name} ({mode.label}) in {run_dir} is {adopted.fault['id']!r} from now on: rows for {folder}"
    for name, rows in adopted.rows.items():
        yield table_file(name)
        lines = as_lines([list(rows[0]), *(list(row.values()) for row in rows)])
        yield from (f"  {line}" for line in lines.splitlines())
