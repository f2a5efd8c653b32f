"""The simulated plant as a link: the contract, the bits of the process, local control and the recipe."""

from __future__ import annotations

import math
from itertools import count

import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.mode import Side
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links import simulated
from homeostat.links.errors import PlantEnded
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.links.virtual import Recipe
from homeostat.process.batch import ProcessError
from tests.contracts.link import Handles, LinkContract, Open, equal, read
from tests.plants.cstr import reactor
from tests.plants.cstr.reactor import MODEL, VARIABLES

HANDLES = Handles("T1.sp", -2.0, 0.5, "V2.man", "T1")


def process(end_s: float = 600.0, faults: tuple[FaultState, ...] = (), record: bool = True) -> TrueProcess:
    """A reactor at its start."""
    configuration = PlantConfiguration(reactor.parameters(), reactor.inputs(), faults, end_s, 3)
    return TrueProcess(MODEL, reactor.plant(), configuration, record)


def link(local: tuple[Command, ...] = (), recipe: Recipe | None = None, by: Side = Side.GUARD) -> SimulatedLink:
    return SimulatedLink(process(), LinkConfiguration(local=local, recipe_by=by), recipe)


class TestSimulatedLink(LinkContract):
    @pytest.fixture
    def opened(self) -> Open:
        return lambda: SimulatedLink(process())

    @pytest.fixture
    def handles(self) -> Handles:
        return HANDLES


# The process.


def test_the_truth_has_the_bits_of_the_engine() -> None:
    subject = SimulatedLink(inner := process(500.0, (FaultState("leak", 0.004, 350.0),)))
    found = read(subject, 500)
    what = reactor.batch(500, faults={"leak": (0.004, 350.0)}, process=1.0, sensor=1.0, first_seed=3)
    record = reactor.run(what).record[0]
    for row, snapshot in zip(record, found, strict=True):
        readings = MODEL.readings(row, what.inputs[0, 0])
        assert all(equal(snapshot.values[tag], readings[v]) for tag, v in VARIABLES.items())
    measured = inner.measured().signals
    assert all(equal(measured[tag][0, k], s.values[tag]) for k, s in enumerate(found) for tag in VARIABLES)


def test_a_plant_that_is_not_recorded_runs_alike_and_has_no_truth() -> None:
    silent = process(record=False)
    for a, b in zip(read(SimulatedLink(silent), 50), read(SimulatedLink(process()), 50), strict=True):
        assert all(equal(v, b.values[tag]) for tag, v in a.values.items())
    with pytest.raises(ValueError, match="record=True"):
        silent.truth()


def test_there_is_no_truth_before_the_first_tick() -> None:
    with pytest.raises(ValueError, match="nothing is recorded before the first tick"):
        process().truth()


def test_a_plant_that_breaks_has_ended() -> None:
    subject = SimulatedLink(process(100.0, (FaultState("fouling", -1e6, 40.0),)))
    with pytest.raises(ProcessError, match="left the physical world at t = 48 s"):
        read(subject, 100)
    assert subject.ended
    with pytest.raises(PlantEnded):
        subject.advance()


# Local control.


def test_local_control_commands_its_own_setpoints() -> None:
    local = Command("T1.sp", 300.0, 0.5), Command("V2.man", 0.9, None)
    subject = link(local)
    subject.take().send((Command("V2.man", 0.4, None), Command("V1.man", 0.2, None), Command("F1.sp", 0.02, None)))
    read(subject, 3)
    subject.give_back()
    found = read(subject, 2)
    assert [s.values["T1.sp"] for s in found] == [309.5, 309.0]
    accepted = found[-1].accepted
    assert (accepted["T1.sp"], accepted["V2.man"], accepted["V1.man"], accepted["F1.sp"]) == (300.0, 0.9, None, 0.02)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (Command("T1", 1.0, None), "'T1' cannot be commanded"),
        (Command("T1.sp", None, None), "'T1.sp' has no automatic"),
    ],
)
def test_local_setpoints_must_be_commandable(command: Command, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        link((command,))


@pytest.mark.parametrize("heartbeat_s", [0.0, -1.0, math.nan, math.inf])
def test_a_heartbeat_is_a_time(heartbeat_s: float) -> None:
    with pytest.raises(ValueError, match="must be finite and > 0 s"):
        LinkConfiguration(heartbeat_s)


# The wire log.


def test_the_wire_log_forgets_the_oldest_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulated, "WIRE_LOG_LENGTH", 3)
    subject = link()
    wire = subject.take()
    for k in range(5):
        wire.send((Command("V2.man", 0.1 * k, None),))
    assert [a.commands[0].value for a in subject.wire_log] == [0.1 * k for k in (2, 3, 4)]


# The recipe.


def stairs() -> Recipe:
    """Lowers the temperature setpoint by a kelvin per sample."""
    goals = count(309, -1)
    return lambda snapshot: (Command("T1.sp", float(next(goals)), None),)


def seen(snapshots: list[Snapshot]) -> list[float]:
    return [s.values["T1.sp"] for s in snapshots]


def test_a_recipe_runs_in_the_plant_while_nobody_holds_the_lease() -> None:
    subject = link(recipe=stairs())
    assert seen(read(subject, 3)) == [310.0, 309.0, 308.0]
    subject.take()
    assert seen(read(subject, 3)) == [307.0] * 3, "it follows, and what it would command is not done"
    subject.give_back()
    assert seen(read(subject, 3)) == [307.0, 303.0, 302.0]
    assert subject.wire_log == ()


def test_the_recipe_of_the_plant_also_runs_beside_a_guard() -> None:
    subject = link(recipe=stairs(), by=Side.PLANT)
    subject.take()
    assert seen(read(subject, 3)) == [310.0, 309.0, 308.0]
