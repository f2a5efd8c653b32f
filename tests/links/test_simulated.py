"""The simulated plant: the contract, and what is its own."""

from __future__ import annotations

import asyncio
import math

import numpy as np
import pytest

from homeostat.cases.cstr.layout import P
from homeostat.domain.diagnosis import FaultState
from homeostat.domain.recovery import Command
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.links.simulated import PlantConfiguration, SimulatedPlant
from homeostat.process.batch import ProcessError
from tests.cases.cstr import reactor
from tests.cases.cstr.reactor import MODEL, VARIABLES
from tests.contracts.link import Handles, equal
from tests.contracts.plant import Open, PlantContract, take
from tests.links.reactor_plant import everything, plant, same


class TestSimulatedReactor(PlantContract):
    @pytest.fixture(params=["declared", "thinking"])
    def opened(self, request: pytest.FixtureRequest) -> Open:
        return lambda: plant(clock=DeclaredClock(1.0) if request.param == "declared" else ThinkingClock())

    @pytest.fixture
    def handles(self) -> Handles:
        return Handles("T1.sp", -2.0, 0.5, "V2.man", "T1")


# One run.


def test_the_run_is_one_snapshot_per_second_until_its_end() -> None:
    found = asyncio.run(everything(plant(end_s=50.0)))
    assert [s.at_s for s in found] == [float(t) for t in range(1, 51)]


def test_the_same_seed_is_the_same_plant_and_another_is_not() -> None:
    one, again, other = (asyncio.run(everything(plant(400.0, seed))) for seed in (3, 3, 4))
    assert same(one, again) and not same(one, other)


def test_a_quiet_plant_does_not_depend_on_its_seed() -> None:
    one, other = (asyncio.run(everything(plant(100.0, seed, noise=0.0))) for seed in (3, 4))
    assert same(one, other)


def test_the_plant_is_the_engine_one_second_at_a_time() -> None:
    """What the twin simulates in one call has the bits of what the plant does."""
    fault = FaultState("leak", 0.004, 350.0)
    subject = plant(500.0, seed=9, faults=(fault,))
    found = asyncio.run(everything(subject))
    what = reactor.batch(500, faults={"leak": (0.004, 350.0)}, process=1.0, sensor=1.0, first_seed=9)
    record = reactor.run(what).record[0]
    for row, snapshot in zip(record, found, strict=True):
        read = MODEL.readings(row, what.inputs[0, 0])
        assert all(equal(snapshot.values[tag], read[v]) for tag, v in VARIABLES.items())


def test_injected_faults_act() -> None:
    healthy = asyncio.run(everything(plant(400.0, noise=0.0)))
    faulty = asyncio.run(everything(plant(400.0, noise=0.0, faults=(FaultState("temp_bias", 5.0, 350.0),))))
    assert same(healthy[:349], faulty[:349])
    assert faulty[349].values["T1"] - healthy[349].values["T1"] == pytest.approx(5.0)


# since.


@pytest.mark.parametrize(
    ("at_s", "first"), [(-5.0, 1), (0.0, 1), (0.5, 1), (1.0, 2), (7.0, 8), (7.9, 8), (19.0, 20), (20.0, 20), (99.0, 20)]
)
def test_since_is_what_came_after(at_s: float, first: int) -> None:
    async def story() -> None:
        subject = plant()
        await take(subject.snapshots(), 20)
        assert [s.at_s for s in await subject.since(at_s)] == [float(t) for t in range(first, 21)]

    asyncio.run(story())


def test_the_first_look_takes_a_snapshot() -> None:
    async def story() -> None:
        subject = plant()
        assert [s.at_s for s in await subject.since(0.0)] == [1.0]
        assert [s.at_s for s in await subject.since(0.0)] == [1.0]
        assert (await take(subject.snapshots(), 2))[1].at_s == 2.0

    asyncio.run(story())


# write.


def test_commands_are_ramped_from_the_next_second_on() -> None:
    async def story() -> None:
        subject = plant()
        stream = subject.snapshots()
        await take(stream, 10)
        await subject.write((Command("T1.sp", 308.8, 0.5), Command("F1.sp", 0.02, None)))
        found = await take(stream, 4)
        assert [s.values["T1.sp"] for s in found] == pytest.approx([309.5, 309.0, 308.8, 308.8])
        assert [s.values["F1.sp"] for s in found] == [0.02] * 4
        truth = subject.truth().signals
        assert truth["T1.sp"][0, 8:14] == pytest.approx([310.0, 310.0, 309.5, 309.0, 308.8, 308.8])
        assert np.isnan(truth["V2.man"]).all()

    asyncio.run(story())


def test_time_that_thinking_took_passes_before_the_command() -> None:
    async def story() -> None:
        clock = DeclaredClock(6.0)
        subject = plant(clock=clock)
        stream = subject.snapshots()
        await take(stream, 10)
        clock.start()
        await subject.write((Command("F1.sp", 0.02, None),))
        clock.stop()
        found = await take(stream, 8)
        assert [s.values["F1.sp"] for s in found] == pytest.approx([1 / 30] * 6 + [0.02] * 2)

    asyncio.run(story())


def test_a_manual_output_starts_from_the_present_output() -> None:
    async def story() -> None:
        subject = plant(end_s=1000.0)
        stream = subject.snapshots()
        before = (await take(stream, 600))[-1].values["V2.cmd"]
        await subject.write((Command("V2.man", before + 0.35, 0.2),))
        found = [s.values["V2.cmd"] for s in await take(stream, 4)]
        assert found == pytest.approx([before + 0.2, before + 0.35, before + 0.35, before + 0.35])
        await subject.write((Command("V2.man", None, None),))
        assert math.isnan((await anext(stream)).values["V2.man"])

    asyncio.run(story())


def test_what_was_recorded_is_not_rewritten_by_a_later_command() -> None:
    async def story() -> None:
        subject = plant()
        await take(subject.snapshots(), 10)
        before = subject.truth().signals
        await subject.write((Command("V2.man", 0.7, None), Command("T1.sp", 305.0, None)))
        after = subject.truth().signals
        for tag in before:
            assert np.array_equal(before[tag], after[tag], equal_nan=True), tag

    asyncio.run(story())


def test_only_write_changes_inputs() -> None:
    """Looking, thinking and asking for the truth leave every input where it is; a write of nothing does too."""

    async def story() -> None:
        clock = DeclaredClock(3.0)
        subject = plant(end_s=80.0, clock=clock)
        async for s in subject.snapshots():
            clock.start()
            if s.at_s % 9 == 0:
                await subject.since(s.at_s)
            clock.stop()
            if s.at_s == 20.0:
                await subject.write(())
        signals = subject.truth().signals
        for tag, variable in VARIABLES.items():
            if variable in MODEL.inputs:
                start = reactor.inputs()[MODEL.inputs.index(variable)]
                assert all(equal(v, start) for v in signals[tag][0]), tag

    asyncio.run(story())


# truth.


def test_the_truth_is_every_tag_and_what_nobody_measures() -> None:
    async def story() -> None:
        subject = plant()
        await take(subject.snapshots(), 30)
        truth = subject.truth()
        assert truth.start_s == 1.0 and truth.length == 30 and truth.members == 1
        assert set(VARIABLES) | {"CA", "leak", "UA", "product"} <= set(truth.signals)

    asyncio.run(story())


def test_the_truth_has_no_noise_no_calibration_error_and_no_sensor_fault() -> None:
    faults = (FaultState("temp_bias", 5.0, 0.0), FaultState("level_bias", 1.0, 0.0))
    subject = plant(end_s=1500.0, faults=faults, bias_T3=0.4, bias_F3=0.02)
    found = asyncio.run(everything(subject))
    truth = subject.truth().signals
    read = {tag: np.array([s.values[tag] for s in found[500:]]) for tag in ("T1", "L1", "T3", "F3")}
    off = {tag: float((values - truth[tag][0, 500:]).mean()) for tag, values in read.items()}
    assert off["T1"] == pytest.approx(5.0, abs=0.1) and off["L1"] == pytest.approx(-1.0, abs=0.01)
    assert off["T3"] == pytest.approx(0.4, abs=0.03)
    assert off["F3"] == pytest.approx(0.02 * truth["F3"][0, 500:].mean(), rel=0.15)
    assert (truth["T3"] == 290.0).all()


# What is refused.


def test_parameters_must_be_finite() -> None:
    with pytest.raises(ValueError, match="'UA' is nan; must be finite"):
        plant(UA=math.nan)


@pytest.mark.parametrize(("severity", "onset_s"), [(math.nan, 0.0), (math.inf, 0.0), (-math.inf, 0.0), (0.5, math.nan)])
def test_faults_must_have_a_size_and_a_time(severity: float, onset_s: float) -> None:
    with pytest.raises(ValueError, match="severity must be finite, the onset a time"):
        plant(faults=(FaultState("leak", severity, onset_s),))


def test_an_unknown_fault_is_named() -> None:
    with pytest.raises(KeyError, match="no 'gremlins'; it has fouling"):
        plant(faults=(FaultState("gremlins", 1.0, 0.0),))


def test_a_plant_that_breaks_says_when() -> None:
    with pytest.raises(ProcessError, match="left the physical world at t = 41 s"):
        asyncio.run(everything(plant(end_s=100.0, faults=(FaultState("leak", 1.5, 40.0),))))


def test_the_configuration_stays_what_it_was() -> None:
    parameters, inputs = reactor.parameters(), reactor.inputs()
    kept = parameters.copy(), inputs.copy()
    configuration = PlantConfiguration(parameters, inputs, (), 30.0, 1)
    subject = SimulatedPlant(MODEL, VARIABLES, configuration, DeclaredClock(0.0))
    parameters[P.UA], inputs[0] = 0.0, 0.0
    first = asyncio.run(everything(subject))
    again = SimulatedPlant(MODEL, VARIABLES, PlantConfiguration(*kept, (), 30.0, 1), DeclaredClock(0.0))
    assert same(first, asyncio.run(everything(again)))
