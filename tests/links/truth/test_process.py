"""The process behind a simulated plant: seeds, faults, ramps, truth, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.recovery import Command
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from tests.contracts.link import equal
from tests.plants.cstr import reactor
from tests.plants.cstr.reactor import MODEL, VARIABLES, P


def process(seed: int = 3, faults: tuple[FaultState, ...] = (), noise: float = 1.0, **changes: float) -> TrueProcess:
    """A reactor at its start."""
    configuration = PlantConfiguration(reactor.parameters(**changes), reactor.inputs(), faults, 1e6, seed, noise)
    return TrueProcess(MODEL, reactor.plant(), configuration)


def run(subject: TrueProcess, seconds: int) -> list[dict[str, float]]:
    """The readings of so many seconds."""
    return [dict(subject.advance()) for _ in range(seconds)]


def same(a: list[dict[str, float]], b: list[dict[str, float]]) -> bool:
    return all(x.keys() == y.keys() and all(map(equal, x.values(), y.values())) for x, y in zip(a, b, strict=True))


def test_the_same_seed_is_the_same_plant_and_another_is_not() -> None:
    one, again, other = (run(process(seed), 400) for seed in (3, 3, 4))
    assert same(one, again) and not same(one, other)


def test_a_quiet_plant_does_not_depend_on_its_seed() -> None:
    assert same(run(process(3, noise=0.0), 100), run(process(4, noise=0.0), 100))


def test_injected_faults_act() -> None:
    healthy = run(process(noise=0.0), 350)
    faulty = run(process(noise=0.0, faults=(FaultState("temp_bias", 5.0, 350.0),)), 350)
    assert same(healthy[:349], faulty[:349])
    assert faulty[349]["T1"] - healthy[349]["T1"] == pytest.approx(5.0)


def test_a_repaired_fault_acts_no_more_and_what_it_did_stays() -> None:
    fault = (FaultState("temp_bias", 5.0, 350.0),)
    parameters, inputs = reactor.parameters(), reactor.inputs()
    healthy, faulty = (
        run(TrueProcess(MODEL, reactor.plant(), PlantConfiguration(parameters, inputs, given, 1e6, 3, 0.0)), 500)
        for given in ((), fault)
    )
    configuration = PlantConfiguration(parameters, inputs, fault, 1e6, 3, 0.0, repaired_s=400.0)
    repaired = run(TrueProcess(MODEL, reactor.plant(), configuration), 500)
    assert same(repaired[:400], faulty[:400]) and not same(repaired[400:], faulty[400:])
    assert repaired[400]["T1"] - repaired[399]["T1"] == pytest.approx(-5.0, abs=0.2), "the reading is true again"
    assert repaired[400]["T1"] < healthy[400]["T1"], "what the wrong reading has cooled is still cold"


def test_commands_are_ramped_from_the_next_second_on() -> None:
    subject = process()
    run(subject, 10)
    subject.command((Command("T1.sp", 308.8, 0.5), Command("F1.sp", 0.02, None)))
    found = run(subject, 4)
    assert [v["T1.sp"] for v in found] == pytest.approx([309.5, 309.0, 308.8, 308.8])
    assert [v["F1.sp"] for v in found] == [0.02] * 4
    truth = subject.truth().signals
    assert truth["T1.sp"][0, 8:14] == pytest.approx([310.0, 310.0, 309.5, 309.0, 308.8, 308.8])
    assert np.isnan(truth["V2.man"]).all()


def test_a_manual_output_starts_from_the_present_output() -> None:
    subject = process()
    before = run(subject, 600)[-1]["V2.cmd"]
    subject.command((Command("V2.man", before + 0.35, 0.2),))
    expected = [before + 0.2, before + 0.35, before + 0.35, before + 0.35]
    assert [v["V2.cmd"] for v in run(subject, 4)] == pytest.approx(expected)


def test_what_can_be_commanded_and_handed_back_is_known() -> None:
    subject = process()
    assert subject.manual == {"V1.man", "P1.man", "V2.man"}
    assert subject.accepted.keys() == {tag for tag, v in VARIABLES.items() if v in MODEL.inputs}


def test_commands_of_nothing_leave_a_ramp_its_bits() -> None:
    one, other = process(), process()
    for subject in (one, other):
        subject.command((Command("T1.sp", 305.0, 0.1),))
    for _ in range(30):
        other.command(())
        assert same([dict(one.advance())], [dict(other.advance())])


def test_what_was_recorded_is_not_rewritten_by_a_later_command() -> None:
    subject = process()
    run(subject, 10)
    before = subject.truth().signals
    subject.command((Command("V2.man", 0.7, None), Command("T1.sp", 305.0, None)))
    run(subject, 5)
    after = subject.truth().signals
    assert all(np.array_equal(before[tag], after[tag][:, :10], equal_nan=True) for tag in before)


def test_the_truth_is_every_tag_and_what_nobody_measures() -> None:
    subject = process()
    run(subject, 30)
    truth = subject.truth()
    assert truth.start_s == 1.0 and truth.length == 30 and truth.members == 1
    assert set(VARIABLES) | {"CA", "leak", "UA", "product"} <= set(truth.signals)


def test_the_truth_has_no_noise_no_calibration_error_and_no_sensor_fault() -> None:
    faults = (FaultState("temp_bias", 5.0, 0.0), FaultState("level_bias", 1.0, 0.0))
    subject = process(faults=faults, bias_T3=0.4, bias_F3=0.02)
    run(subject, 1500)
    truth, read = subject.truth().signals, subject.measured().signals
    off = {tag: float((read[tag] - truth[tag])[0, 500:].mean()) for tag in ("T1", "L1", "T3", "F3")}
    assert off["T1"] == pytest.approx(5.0, abs=0.1) and off["L1"] == pytest.approx(-1.0, abs=0.01)
    assert off["T3"] == pytest.approx(0.4, abs=0.03)
    assert off["F3"] == pytest.approx(0.02 * truth["F3"][0, 500:].mean(), rel=0.15)
    assert (truth["T3"] == 290.0).all()


def test_parameters_must_be_finite() -> None:
    with pytest.raises(ValueError, match="'UA' is nan; must be finite"):
        process(UA=math.nan)


@pytest.mark.parametrize(("severity", "onset_s"), [(math.nan, 0.0), (math.inf, 0.0), (-math.inf, 0.0), (0.5, math.nan)])
def test_faults_must_have_a_size_and_a_time(severity: float, onset_s: float) -> None:
    with pytest.raises(ValueError, match="severity must be finite, the onset a time"):
        process(faults=(FaultState("leak", severity, onset_s),))


def test_an_unknown_fault_is_named() -> None:
    with pytest.raises(KeyError, match="no 'gremlins'; it has fouling"):
        process(faults=(FaultState("gremlins", 1.0, 0.0),))


def test_the_configuration_stays_what_it_was() -> None:
    parameters, inputs = reactor.parameters(), reactor.inputs()
    kept = parameters.copy(), inputs.copy()
    subject = TrueProcess(MODEL, reactor.plant(), PlantConfiguration(parameters, inputs, (), 30.0, 1))
    parameters[P.UA], inputs[0] = 0.0, 0.0
    again = TrueProcess(MODEL, reactor.plant(), PlantConfiguration(*kept, (), 30.0, 1))
    assert same(run(subject, 30), run(again, 30))
