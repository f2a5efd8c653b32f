"""A run that was killed goes on: the plant is the same plant, and nothing is repeated whose effect is known."""

from __future__ import annotations

import functools
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.evaluate.beginning import beginning
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.recorded.resumption import Past, ResumptionError, told
from homeostat.evaluate.recorded.run import record_run, run_started
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import Scenario, departing, scenario
from homeostat.journal import RunStarted, Setting, read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.directory import RunDirectory, RunDirectoryError

END_S, FAULT = 105.0, "stuck_closed_VI202"


def plant() -> Plant:
    return load_plant("mixing_module")


def recorded(
    directory: RunDirectory, operation: Operation | None = None, fault: str = FAULT, disturbances: tuple[str, ...] = ()
) -> Run:
    chosen = departing(plant(), scenario(plant(), fault, 1, end_s=END_S), disturbances)
    with directory:
        return record_run(
            plant(), chosen, directory, Thinking(declared_s=1.0), "search", lambda event, at_s: None,
            lambda snapshot: None, kept=lambda run: False, operation=operation,
        )  # fmt: skip


@functools.cache
def whole(folder: Path) -> Run:
    return recorded(RunDirectory(folder))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("whole") / "run"


def killed(run: Path, into: Path, kind: str, at_s: float) -> Past:
    """What is left of ``run`` where it dies behind its last event of ``kind`` up to ``at_s``."""
    shutil.copytree(run, into)
    (into / "manifest.json").unlink()
    (into / "result.json").unlink()
    last = [r.seq for r in read_events(into) if r.kind == kind and r.at_s <= at_s][-1]
    lines = (into / "events.jsonl").read_bytes().splitlines(keepends=True)
    (into / "events.jsonl").write_bytes(b"".join(lines[:last]))
    return Past.of(tuple(read_events(into)))


def writes(run: Path) -> list[tuple[float, int, str]]:
    return [(r.at_s, r.fields["write"], r.fields["source"]) for r in read_events(run) if r.kind == "write-intended"]  # type: ignore[misc]


@pytest.mark.parametrize(
    ("kind", "at_s"),
    [
        pytest.param("state-entered", 1.0, marks=pytest.mark.wide),
        ("read-back", 2.0),
        pytest.param("step-taken", 37.0, marks=pytest.mark.wide),
    ],
)
def test_killed_between_two_thoughts_it_goes_on_as_if_it_had_not_been(
    folder: Path, tmp_path: Path, kind: str, at_s: float
) -> None:
    first = whole(folder)
    past = killed(folder, tmp_path / "run", kind, at_s)
    assert past.record.open_writes == ()
    again = recorded(RunDirectory.resume(tmp_path / "run"), Operation(past=past))
    assert writes(tmp_path / "run") == writes(folder)
    for name, values in first.truth.signals.items():
        assert np.array_equal(values, again.truth.signals[name], equal_nan=True), name
    assert again.outcome is first.outcome and again.state == first.state
    report = verify(tmp_path / "run")
    assert report.complete and report.contradictions == ()


def test_what_chance_does_to_the_plant_goes_on_as_it_would_have(tmp_path: Path) -> None:
    happens = ("fill_rate * 0.9 wandering from 3 every 8..20", "B201.level reads + 0.002 bursting every 10..30 back 4")
    first = recorded(RunDirectory(tmp_path / "first"), None, "none", happens)
    past = killed(tmp_path / "first", tmp_path / "run", "state-entered", 60.0)
    assert 0.0 < past.at_s < END_S and past.started.disturbances == happens
    again = recorded(RunDirectory.resume(tmp_path / "run"), Operation(past=past), "none", happens)
    quiet = recorded(RunDirectory(tmp_path / "quiet"), None, "none")
    for name, values in first.truth.signals.items():
        assert np.array_equal(values, again.truth.signals[name], equal_nan=True), name
    assert not np.array_equal(first.truth.signals["B202.level"], quiet.truth.signals["B202.level"])


@pytest.mark.parametrize(
    "kind",
    [
        *("write-ended", "attempted"),
        *(pytest.param(kind, marks=pytest.mark.wide) for kind in ("write-intended", "sequence-loaded", "diagnosed")),
    ],
)
def test_killed_in_the_middle_of_a_recovery_the_plant_has_the_same_past_and_is_recovered(
    folder: Path, tmp_path: Path, kind: str
) -> None:
    first = whole(folder)
    past = killed(folder, tmp_path / "run", kind, 76.0)
    again = recorded(RunDirectory.resume(tmp_path / "run"), Operation(past=past))
    seconds = int(past.at_s)
    for name, values in first.truth.signals.items():
        assert np.array_equal(values[0, :seconds], again.truth.signals[name][0, :seconds], equal_nan=True), name
    assert again.state == "held"
    assert any("goes on at" in line for line in told(past))
    report = verify(tmp_path / "run")
    assert report.complete and report.contradictions == ()


def test_latch_mode_and_service_survive(tmp_path: Path) -> None:
    said = [
        PersonCommand("order-001", "Ada", Role.ENGINEER, Verb.OUT_OF_SERVICE, "VI203.cmd", reason="maintenance"),
        PersonCommand("order-002", "Ada", Role.ENGINEER, Verb.FALL_BACK, reason="smoke"),
    ]
    operation = Operation(Mode.APPROVE, orders=lambda: (said.pop(),) if said else ())
    recorded(RunDirectory(tmp_path / "first"), operation, "none")
    past = killed(tmp_path / "first", tmp_path / "run", "fallback-stands", 10.0)
    done = recorded(RunDirectory.resume(tmp_path / "run"), Operation(Mode.APPROVE, past=past), "none")
    assert past.memory.mode is Mode.APPROVE and past.memory.latched is not None
    assert done.state == "aborted" and done.actor == "fallback"
    assert writes(tmp_path / "run") == writes(tmp_path / "first")


def test_killed_in_observe_the_plants_recipe_has_the_same_past_and_goes_on(tmp_path: Path) -> None:
    ticks = iter(range(1, 1000))
    look = PersonCommand("order-001", "Ada", Role.ENGINEER, Verb.MODE, "observe", reason="a look")
    operation = Operation(orders=lambda: (look,) if next(ticks) == 20 else ())
    first = recorded(RunDirectory(tmp_path / "first"), operation, "none")
    past = killed(tmp_path / "first", tmp_path / "run", "state-entered", 90.0)
    again = recorded(RunDirectory.resume(tmp_path / "run"), Operation(past=past), "none")
    assert past.memory.mode is Mode.OBSERVE and first.state == again.state != "filling_B201"
    for name, values in first.truth.signals.items():
        assert np.array_equal(values, again.truth.signals[name], equal_nan=True), name
    assert writes(tmp_path / "run") == writes(tmp_path / "first")


def test_a_run_that_still_goes_on_is_not_gone_on_with(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run"), pytest.raises(RunDirectoryError, match="still goes on"):
        RunDirectory.resume(tmp_path / "run")


def test_what_cannot_go_on_says_why(folder: Path, tmp_path: Path) -> None:
    whole(folder)
    with pytest.raises(ResumptionError, match="came to its end"):
        Past.of(tuple(read_events(folder)))
    with pytest.raises(ResumptionError, match="does not begin"):
        Past.of(tuple(read_events(folder))[1:3])
    past = killed(folder, tmp_path / "run", "step-taken", 37.0)
    with pytest.raises(ResumptionError, match="configuration"):
        past.scenario(load_plant("cstr"))


def left(path: Path, began: RunStarted) -> Past:
    """What is left of a run that was killed as soon as it had begun."""
    with RunDirectory(path) as directory:
        directory.record(began, 0.0)
    return Past.of(tuple(read_events(path)))


def began(chosen: Scenario) -> RunStarted:
    return run_started(plant(), chosen, Thinking(declared_s=1.0), "search", Conditions().settings, None)


def test_a_run_that_began_elsewhere_than_by_design_goes_on_from_there(tmp_path: Path) -> None:
    """As runs of studies do: the plant is made again with the state and the setpoints that it began with."""
    normal = scenario(plant(), FAULT, 1, end_s=END_S)
    chosen = beginning(plant(), normal, "filling_B202", {"VI202.cmd": 0.5, "P101.cmd": 0.25})
    past = left(tmp_path / "run", began(chosen))
    assert past.scenario(plant()) == chosen != normal


def test_draws_that_follow_from_the_seed_otherwise_are_refused(tmp_path: Path) -> None:
    """The plant would be another one, without a word."""
    event = began(scenario(plant(), FAULT, 1, end_s=END_S))
    for number, others in enumerate(([Setting("seeds", "named-0")], [])):
        kept = (*(s for s in event.configuration if s.name != "seeds"), *others)
        past = left(tmp_path / f"run-{number}", replace(event, configuration=kept))
        with pytest.raises(ResumptionError, match="use the version that recorded it"):
            past.scenario(plant())
