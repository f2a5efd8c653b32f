"""Another run in the folder of the one that is shown: nothing of the one before is shown as its own."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from homeostat.console.opened import KnownPlant, OpenedRun
from homeostat.console.readings import Gathered
from homeostat.console.view import seen
from homeostat.domain.events.guard import GuardStarted
from homeostat.domain.snapshot import Snapshot
from homeostat.journal import Journal
from homeostat.journal.beside.files import JOURNAL
from homeostat.plants.plant import load_plant
from homeostat.record.directory import TRAJECTORY

PLANT = KnownPlant("CSTR", load_plant("cstr").description)


def journal(folder: Path, mode: str, *times_s: float) -> None:
    """A run of which the guard began at ``times_s``, and nothing else is known."""
    with Journal(folder) as kept:
        for at_s in times_s:
            kept.record(GuardStarted("cstr", "c", mode, "plant", False), at_s)


def wiped(folder: Path) -> None:
    """Nothing of the run is there any more."""
    (folder / JOURNAL).rename(folder / "old")  # it stays, so that the new one is another file
    for path in folder.iterdir():
        if path.name != "old":
            path.unlink()


def test_readings_of_a_service_that_was_set_up_anew_are_shown_from_its_own_time_on(tmp_path: Path) -> None:
    run_dir, gathered = tmp_path / "run", Gathered(["T1"])
    journal(run_dir, "observe", 0.0, 500.0)
    run = OpenedRun(run_dir, PLANT, gathered)
    gathered(Snapshot(500.0, {"T1": 350.0}))
    assert seen(run, 500.0).values == {"T1": 350.0}
    wiped(run_dir)
    journal(run_dir, "advise", 0.0)
    run.refresh()
    gathered(Snapshot(2.0, {"T1": 310.0}))
    now = seen(run, run.last_s)
    assert (run.last_s, now.values, now.overview.mode) == (2.0, {"T1": 310.0}, "advise")


def test_readings_of_the_run_before_are_not_shown_beside_another_one(tmp_path: Path) -> None:
    run_dir = tmp_path / "run"
    journal(run_dir, "observe", 0.0, 500.0)
    pq.write_table(pa.table({"t_s": [0.0, 500.0], "measured T1": [340.0, 350.0]}), run_dir / TRAJECTORY)
    run = OpenedRun(run_dir, PLANT)
    assert run.readings is not None and run.readings.last_s == 500.0
    wiped(run_dir)
    journal(run_dir, "advise", 0.0)
    run.refresh()
    assert (run.readings, run.last_s) == (None, 0.0)
