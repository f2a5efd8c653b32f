"""True plants that are not their models: neutral to the bit, and by hand where they depart."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.disturbance import Disturbance, DisturbanceError
from homeostat.domain.recovery import Command
from homeostat.links.truth.members import Members
from homeostat.links.truth.process import Departed, PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.truth import find_mismatch, mismatches, true_model
from homeostat.process.truth import TrueModel

PLANTS = ("cstr", "mixing_module")
FAULTS = {
    "cstr": (FaultState("fouling", 0.5, 200.0), FaultState("leak", 0.001, 300.0)),
    "mixing_module": (FaultState("sensor_stuck_B201", 1.0, 60.0), FaultState("clogging_main", 0.4, 90.0)),
}


def true_plant(name: str) -> tuple[Plant, TrueModel]:
    plant = load_plant(name)
    truth = true_model(plant.model)
    assert truth is not None
    return plant, truth


def opened(
    name: str, *texts: str, noise: float = 0.0, faults: tuple[FaultState, ...] = (), own: dict[str, float] | None = None
) -> TrueProcess:
    """The plant called ``name`` at its start, its own parameters neutral but for ``own``."""
    plant, truth = true_plant(name)
    neutral = np.array(truth.departures.neutral())
    for parameter, value in (own or {}).items():
        neutral[truth.departures.parameters.index(parameter)] = value
    departed = Departed(truth, neutral, tuple(map(Disturbance.parse, texts)))
    return TrueProcess(
        plant.model,
        plant.description,
        PlantConfiguration(plant.true_parameters(5), plant.start, faults, 1e6, 11, noise, departed),
    )


def modelled(name: str, noise: float = 0.0, faults: tuple[FaultState, ...] = ()) -> TrueProcess:
    plant = load_plant(name)
    parameters = plant.true_parameters(5)
    return TrueProcess(
        plant.model, plant.description, PlantConfiguration(parameters, plant.start, faults, 1e6, 11, noise)
    )


def readings(process: TrueProcess, seconds: int, tag: str) -> list[float]:
    return [process.advance()[tag] for _ in range(seconds)]


@pytest.mark.parametrize("name", PLANTS)
def test_a_true_plant_with_neutral_parameters_is_its_model_to_the_bit(name: str) -> None:
    one, other = opened(name, noise=1.0, faults=FAULTS[name]), modelled(name, 1.0, FAULTS[name])
    for second in range(400):
        if name == "mixing_module" and second in (5, 40, 120):
            command = Command(*{5: ("VI201.cmd", 1.0), 40: ("VO201.cmd", 1.0), 120: ("P101.cmd", 1.0)}[second], None)
            one.command((command,))
            other.command((command,))
        a, b = one.advance(), other.advance()
        assert list(a) == list(b)
        assert np.array_equal(list(a.values()), list(b.values()), equal_nan=True), second


@pytest.mark.parametrize(
    ("text", "difference"),
    [("T1 reads + 2 from 320", 2.0), ("T1 reads - 5 from 320", -5.0), ("T2 reads * 0.8 from 320", -70.0)],
)
def test_an_instrument_that_lies_shows_it_at_once(text: str, difference: float) -> None:
    tag = text.split()[0]
    honest, lying = readings(modelled("cstr"), 321, tag), readings(opened("cstr", text), 321, tag)
    assert lying[:320] == honest[:320]
    assert lying[320] - honest[320] == pytest.approx(difference, rel=0.02)


def test_the_loops_believe_an_instrument_that_lies() -> None:
    lying = opened("cstr", "T1 reads - 5 from 1000")
    readings(lying, 3000, "T1")
    assert lying.truth().signals["T1"][0, -1] == pytest.approx(315.0, abs=0.5)


def test_a_frozen_instrument_keeps_what_it_showed_until_it_is_mended() -> None:
    shown = readings(opened("cstr", "T1 frozen from 320 to 330", noise=1.0), 340, "T1")
    assert len(set(shown[319:330])) == 1 and shown[318] != shown[319] and shown[330] != shown[329]


@pytest.mark.parametrize("tag", ["T1", "F1"])
def test_noise_is_multiplied_and_its_mean_is_not(tag: str) -> None:
    quiet = np.array(readings(opened("cstr", noise=0.0), 2000, tag)[800:])
    usual = np.array(readings(opened("cstr", noise=1.0), 2000, tag)[800:]) - quiet
    loud = np.array(readings(opened("cstr", f"{tag} noise * 5", noise=1.0), 2000, tag)[800:]) - quiet
    assert np.std(np.diff(loud)) == pytest.approx(5.0 * np.std(np.diff(usual)), rel=0.1)


def test_coloured_noise_has_the_variance_of_the_white_one_and_outliers_are_rare() -> None:
    quiet = np.array(readings(opened("cstr"), 3000, "T1")[1000:])
    coloured = np.array(readings(opened("cstr", noise=1.0, own={"coloured": 0.6}), 3000, "T1")[1000:]) - quiet
    assert np.std(coloured) == pytest.approx(0.5, rel=0.15)
    assert np.corrcoef(coloured[1:], coloured[:-1])[0, 1] == pytest.approx(0.6, abs=0.1)
    wild = np.array(readings(opened("cstr", noise=1.0, own={"outliers": 0.01}), 3000, "T1")[1000:]) - quiet
    assert 5 <= np.count_nonzero(np.abs(wild) > 2.5) <= 40


def test_a_resolution_shows_multiples_of_itself() -> None:
    shown = np.array(readings(opened("cstr", noise=1.0, own={"T1 resolution": 0.25}), 50, "T1"))
    assert np.allclose(shown / 0.25, np.round(shown / 0.25))


def test_a_damped_instrument_follows_with_its_lag() -> None:
    own = {"T1 damping_s": 10.0}
    steps = np.array(readings(opened("cstr", "T_feed + 0", own=own), 5, "T1"))
    true = np.array(readings(modelled("cstr"), 5, "T1"))
    gap = np.abs(steps - true)
    assert gap[0] > 0.0 and np.all(gap <= np.abs(true - 350.0) + 1.0)


def moved(own: dict[str, float], *texts: str) -> list[float]:
    """Positions of V2, commanded by hand to 0.8 at 400 s."""
    process = opened("cstr", *texts, own=own)
    readings(process, 400, "V2.pos")
    process.command((Command("V2.man", 0.8, None),))
    return readings(process, 60, "V2.pos")


def test_a_dead_time_delays_a_command_by_so_many_seconds() -> None:
    prompt, late = moved({}), moved({"V2 dead_s": 5.0})
    assert late[5:20] == pytest.approx(prompt[:15], abs=5e-3)
    assert abs(late[4] - prompt[4]) > 0.1


def test_a_slow_actuator_goes_63_percent_in_its_lag() -> None:
    slow = moved({}, "V2 slow 25 from 399")
    begin = moved({})[0] * 0.0 + slow[0]
    assert (slow[25] - begin) / (0.8 - begin) == pytest.approx(0.63, abs=0.06)


def test_an_actuator_that_sticks_moves_not_at_all_and_then_all_the_way() -> None:
    process = opened("cstr", "V2 stiction 0.06 from 2000", noise=1.0)
    positions = np.array(readings(process, 3000, "V2.pos"))[2001:]
    true = process.truth().signals["V2.pos"][0, 2001:]
    steps = np.abs(np.diff(true))
    assert np.all((steps < 0.01) | (steps > 0.05)) and positions.size


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("T1.sp + 2 from 500 to 700", {499: 310.0, 500: 312.0, 699: 312.0, 700: 310.0}),
        ("F1.sp * 0.5 from 500 over 100", {500: 1 / 30, 550: 0.75 / 30, 600: 0.5 / 30, 690: 0.5 / 30}),
        ("F1.sp * 0 from 500 to 700", {500: 0.0, 700: 1 / 30}),
    ],
)
def test_people_move_setpoints_and_put_them_back(text: str, values: dict[int, float]) -> None:
    shown = readings(opened("cstr", text), 720, text.split()[0])
    for second, value in values.items():
        assert shown[second] == pytest.approx(value), second


@pytest.mark.parametrize(
    ("texts", "values"),
    [
        (("T1.sp + 2 from 500 to 700", "T1.sp + 1 from 600"), {500: 312.0, 600: 313.0, 700: 311.0}),
        (("T1.sp - 2 from 500 over 100", "T1.sp - 3 from 500 over 100"), {550: 307.5, 610: 305.0}),
        (("T1.sp - 2 from 500", "T1.sp - 2 from 500"), {500: 306.0}),
        (("T1.sp - 400 from 500 to 600",), {500: 296.0, 600: 310.0}),
        (("T1.sp * 1e308 from 500 to 600",), {500: 313.0, 600: 310.0}),
        (
            ("T1.sp - 4 every 40 from 500", "T1.sp - 3 from 505 to 540"),
            {500: 310.0, 510: 303.0, 530: 311.0, 560: 310.0},
        ),
    ],
)
def test_moves_of_one_setpoint_add_up_within_its_range(texts: tuple[str, ...], values: dict[int, float]) -> None:
    shown = readings(opened("cstr", *texts), 720, "T1.sp")
    for second, value in values.items():
        assert shown[second] == pytest.approx(value), second


@pytest.mark.parametrize(("text", "speed"), [("P101.cmd * 0.5 from 5", 0.45), ("P101.cmd + 5 from 5", 1.0)])
def test_a_disturbed_command_stays_disturbed_when_it_is_given_again(text: str, speed: float) -> None:
    process = opened("mixing_module", text)
    for second in range(60):
        if second in (10, 30):
            process.command((Command("P101.cmd", 0.9, None),))
        values = process.advance()
    assert values["P101.cmd"] == pytest.approx(speed) and process.accepted["P101.cmd"] == 0.9
    assert process.truth().signals["P101.speed"][0, -1] == pytest.approx(speed, abs=0.01)


def test_a_slow_actuator_that_sticks_goes_all_the_way_too() -> None:
    process = opened("mixing_module", "P101 stiction 0.06")
    process.command((Command("P101.cmd", 0.9, None),))
    readings(process, 30, "P101.speed")
    assert process.truth().signals["P101.speed"][0, -1] == pytest.approx(0.9, abs=1e-6)
    process.command((Command("P101.cmd", 0.85, None),))
    readings(process, 30, "P101.speed")
    assert process.truth().signals["P101.speed"][0, -1] == pytest.approx(0.9, abs=1e-6), "less than it sticks"


def test_a_level_switch_that_lies_does_not_change_what_is_true() -> None:
    process = opened("mixing_module", "B201.high reads + 1 from 5")
    assert readings(process, 10, "B201.high")[-1] == 1.0
    assert process.truth().signals["B201.high"][0, -1] == 0.0


def test_what_somebody_else_commanded_meanwhile_is_gone_on_from() -> None:
    process = opened("cstr", "T1.sp + 2 from 500 to 700")
    readings(process, 600, "T1.sp")
    process.command((Command("T1.sp", 300.0, None),))
    assert readings(process, 150, "T1.sp")[-1] == pytest.approx(300.0)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("cstr", "T1 + 3", "say 'T1 reads + 3'"),
        ("cstr", "UAA * 2", "did you mean 'UA'"),
        ("cstr", "V2.man + 0.1", "no parameter or commanded tag 'V2.man'"),
        ("cstr", "V1.travel frozen", "no instrument with the tag 'V1.travel'"),
        ("cstr", "V2.pos stiction 0.1", "no actuator 'V2.pos'"),
        ("mixing_module", "batch.delivered reads + 1", "no instrument"),
        ("mixing_module", "P103 slow 3", "no actuator"),
    ],
)
def test_what_the_plant_does_not_have_cannot_be_disturbed(name: str, text: str, words: str) -> None:
    with pytest.raises(DisturbanceError, match=re.escape(words)):
        opened(name, text)


@pytest.mark.parametrize("name", PLANTS)
def test_every_instrument_actuator_and_parameter_can_be_disturbed(name: str) -> None:
    plant, truth = true_plant(name)
    shown = {v: tag for tag, v in plant.description.variables.items()}
    texts = [f"{p} * 1.001" for p in plant.model.parameters]
    texts += [f"{shown[v]} reads * 1.001" for v in truth.departures.instruments]
    texts += [f"{a} slow 0.5" for a in truth.departures.actuators]
    process = opened(name, *texts, noise=1.0)
    assert all(np.isfinite(readings(process, 30, shown[truth.departures.instruments[0]])))


@pytest.mark.parametrize("name", PLANTS)
def test_every_mismatch_of_a_plant_can_be_run_and_says_what_it_is(name: str) -> None:
    plant, truth = true_plant(name)
    assert mismatches(plant.model)
    for mismatch in mismatches(plant.model).values():
        assert mismatch.description and str(find_mismatch(plant.model, mismatch.name)) == str(mismatch)
        departed = Departed(truth, mismatch.parameters, mismatch.drifts)
        start = plant.true_parameters(2, mismatch.spread), plant.start
        process = TrueProcess(plant.model, plant.description, PlantConfiguration(*start, (), 1e6, 7, 1.0, departed))
        tag = next(tag for tag, v in plant.description.variables.items() if v == truth.departures.instruments[0])
        assert np.isfinite(readings(process, 300, tag)).all()


@pytest.mark.slow
@settings(max_examples=20)
@given(st.integers(0, 400), st.integers(1, 200))
def test_a_disturbance_that_is_over_leaves_no_trace_in_the_parameters(begin: int, last: int) -> None:
    process = opened("cstr", f"UA * 0.5 from {begin} to {begin + last}", f"UA + 7 from {begin} to {begin + last}")
    before = process._parameters.copy()
    readings(process, begin + last + 1, "T1")
    assert np.array_equal(process._parameters, before)


def test_members_of_a_true_plant_are_the_plant_and_leave_the_schedules_as_they_are() -> None:
    """What is held for some seconds is a step here, so that nothing but rounding could differ."""
    plant, truth = true_plant("cstr")
    disturbances = tuple(map(Disturbance.parse, ("UA * 0.9 from 500", "XV1.cmd * 0 from 600", "T1 reads + 1 from 400")))
    departed = Departed(truth, np.array(truth.departures.neutral()), disturbances)
    configuration = PlantConfiguration(plant.true_parameters(5), plant.start, (), 1e6, 11, 1.0, departed)
    process = TrueProcess(plant.model, plant.description, configuration)
    readings(process, 700, "T1")
    members, schedules = Members(plant.model, plant.description, configuration), np.tile(plant.start, (2, 700, 1))
    record = members.simulate(np.tile(members.start(), (2, 1)), schedules, 0.0, 700, 1).record
    assert np.array_equal(schedules, np.tile(plant.start, (2, 700, 1)), equal_nan=True)
    for member in record:
        assert np.array_equal(plant.model.truth(member[None], schedules[:1])["T1"], process.truth().signals["T1"])


@pytest.mark.parametrize("repaired_s", [450.0, 502.5, 699.0, 700.0, math.inf])
@pytest.mark.parametrize("disturbed", [False, True])
def test_members_are_repaired_when_the_plant_is(repaired_s: float, disturbed: bool) -> None:
    plant, truth = true_plant("cstr")
    disturbances = (Disturbance.parse("XV1.cmd * 0 from 600"),) if disturbed else ()
    departed = Departed(truth, np.array(truth.departures.neutral()), disturbances) if disturbed else None
    given = (plant.true_parameters(5), plant.start, (FaultState("temp_bias", 4.0, 440.0),), 1e6, 11, 1.0, departed)
    configuration = PlantConfiguration(*given, repaired_s=repaired_s)
    process = TrueProcess(plant.model, plant.description, configuration)
    readings(process, 700, "T1")
    members = Members(plant.model, plant.description, configuration)
    for start_s, steps in ((0, 700), (500, 200)):
        state = members.start()[None]
        if start_s:
            state = members.simulate(state, np.tile(plant.start, (1, start_s, 1)), 0.0, start_s, 1).state
        schedules = np.tile(plant.start, (1, steps, 1))
        record = members.simulate(state, schedules, float(start_s), steps, 1).record
        assert np.array_equal(plant.model.truth(record, schedules)["T1"], process.truth().signals["T1"][:, start_s:])
