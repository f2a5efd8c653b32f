"""A reactor whose recovery was killed is recovered all the same: what it saw before is seen again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.outcome import Outcome
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.recorded.resumption import Past
from homeostat.evaluate.recorded.run import record_run
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.directory import RunDirectory

pytestmark = pytest.mark.slow

END_S, ONSET_S = 1200.0, 900.0


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("cstr")


def recorded(plant: Plant, directory: RunDirectory, operation: Operation | None = None) -> Run:
    chosen = scenario(plant, "cool_stuck_closed", 1, onset_s=ONSET_S, end_s=END_S)
    with directory:
        return record_run(
            plant, chosen, directory, Thinking(declared_s=1.0), "search", lambda event, at_s: None,
            lambda snapshot: None, kept=lambda run: False, operation=operation,
        )  # fmt: skip


@pytest.fixture(scope="module")
def whole(plant: Plant, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Run]:
    run = tmp_path_factory.mktemp("whole") / "run"
    return run, recorded(plant, RunDirectory(run))


def killed(run: Path, into: Path, dies: str) -> Past:
    """What is left of ``run`` where it dies in front of its first event of kind ``dies`` after the onset."""
    into.mkdir()
    lines = next(r.seq for r in read_events(run) if r.kind == dies and r.at_s >= ONSET_S) - 1
    kept = (run / "events.jsonl").read_bytes().splitlines(keepends=True)[:lines]
    (into / "events.jsonl").write_bytes(b"".join(kept))
    return Past.of(tuple(read_events(into)))


@pytest.mark.parametrize(
    "dies",
    [
        "released",
        *(
            pytest.param(name, marks=pytest.mark.wide)
            for name in ("noticed", "diagnosed", "attempted", "write-intended", "write-ended", "state-entered")
        ),
    ],
)
def test_killed_at_any_step_of_its_recovery_the_reactor_is_recovered(
    plant: Plant, whole: tuple[Path, Run], tmp_path: Path, dies: str
) -> None:
    run, first = whole
    past = killed(run, tmp_path / "run", dies)
    again = recorded(plant, RunDirectory.resume(tmp_path / "run"), Operation(past=past))
    assert again.outcome is first.outcome is Outcome.RECOVERED
    assert again.actor == "search" and again.detected_s is not None
    assert again.detected_s <= ONSET_S + 10.0, "what it had seen before is seen again"
    seconds = int(past.at_s)
    for name, values in first.truth.signals.items():
        assert np.array_equal(values[0, :seconds], again.truth.signals[name][0, :seconds], equal_nan=True), name
    report = verify(tmp_path / "run")
    assert report.complete and report.contradictions == ()
