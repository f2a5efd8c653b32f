"""Names: an unknown disturbance that a table names is said by that name, and nothing else is said otherwise."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultMode, FaultState, Hypothesis, by_fault_set, with_a_twin
from homeostat.plants.plant import Plant
from homeostat.twin.isolation.classes import LEAST_PROBABILITY, hypotheses
from homeostat.twin.isolation.course import continues
from homeostat.twin.isolation.names import Names
from homeostat.twin.isolation.search import Scored
from tests.plants.named_causes import copied
from tests.twin.followed import disturbed, follow, reactor, readings

ONSET_S = 1450


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """A reactor that knows three causes more; none looks like one of its own faults."""
    where = tmp_path_factory.mktemp("plants")
    return copied(where, "coolant_pipe_scaled", "thermowell_loose", "lagging_lost", "thermometer_stuck").load()


@pytest.fixture(scope="module")
def overlapping(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """One whose worn impeller does what its degraded pump does."""
    return copied(tmp_path_factory.mktemp("overlapping"), "impeller_worn").load()


def explained(plant: Plant, disturbance: str, seed: int, lag_s: int) -> tuple[Hypothesis, ...]:
    twin = follow(disturbed(seed, ONSET_S + lag_s, disturbance), seed, plant=plant)
    return twin.explain(candidates(plant), (), since_s=float(ONSET_S + lag_s // 3), news=True)


def candidates(plant: Plant) -> tuple[str, ...]:
    return tuple(fault.name for fault in plant.description.faults)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbance", "lag_s", "name", "severity"),
    [
        ("F3_max * 0.75 from 1450", 30, "coolant_pipe_scaled", -0.125),
        pytest.param("F3_max * 0.5 from 1450", 30, "coolant_pipe_scaled", -0.25, marks=pytest.mark.wide),
        ("T1 reads - 5 from 1450", 30, "thermowell_loose", 5.0),
        pytest.param("T1 reads - 2.5 from 1450", 60, "thermowell_loose", 2.5, marks=pytest.mark.wide),
        pytest.param("UA_ambient * 4 from 1450", 300, "lagging_lost", 150.0, marks=pytest.mark.wide),
    ],
)
def test_a_cause_is_said_by_its_name_with_its_size(
    plant: Plant, disturbance: str, lag_s: int, name: str, severity: float
) -> None:
    before, found = (explained(p, disturbance, 3, lag_s) for p in (reactor(), plant))
    assert name not in {h.name for h in before}
    best = by_fault_set(with_a_twin(found))[0]
    assert best.name == name and best.probability >= 0.6
    assert best.faults[0].severity == pytest.approx(severity, rel=0.15) and abs(best.faults[0].onset_s - ONSET_S) <= 5.0
    assert best.between is not None and best.between[0] <= severity <= best.between[1]


def test_a_stuck_thermometer_has_its_name(plant: Plant) -> None:
    before, found = (explained(p, "T1 frozen from 1450", 3, 60) for p in (reactor(), plant))
    assert before[0].name == "T1_frozen" and found[0].name == "thermometer_stuck"
    assert found[0].probability >= before[0].probability - 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "disturbance", [pytest.param("F3_max * 1.3 from 1450", marks=pytest.mark.wide), "T1 reads + 3 from 1450"]
)
def test_the_other_direction_is_said_as_before(plant: Plant, disturbance: str) -> None:
    before, found = (explained(p, disturbance, 3, 30) for p in (reactor(), plant))
    assert {h.name for h in found} == {h.name for h in before}
    assert [h.probability for h in found] == pytest.approx([h.probability for h in before], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        *("temp_bias", "cool_stuck_closed"),
        *(pytest.param(name, marks=pytest.mark.wide) for name in ("level_bias", "pump_degrade", "inlet_stuck_open")),
    ],
)
def test_other_faults_are_named_as_before(plant: Plant, name: str) -> None:
    fault = (FaultState(name, plant.description.fault(name).severity_nominal, float(ONSET_S)),)
    before, found = (
        follow(readings(3, ONSET_S + 15, fault), 3, plant=p).explain(candidates(p), ()) for p in (reactor(), plant)
    )
    assert [h.name for h in found] == [h.name for h in before]
    assert [h.probability for h in found] == pytest.approx([h.probability for h in before], abs=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_healthy_plant_has_none_of_them(plant: Plant, seed: int) -> None:
    found = follow(readings(seed, ONSET_S + 200, ()), seed, plant=plant).explain(candidates(plant), ())
    assert found[0].name == "none" and found[0].probability >= 0.8


@pytest.mark.parametrize("severity", [0.2, 0.35])
def test_what_looks_like_a_fault_with_an_equation_is_a_set(overlapping: Plant, severity: float) -> None:
    """Either name alone would be wrong where the other one is true."""
    fault = (FaultState("pump_degrade", severity, float(ONSET_S)),)
    found = follow(readings(3, ONSET_S + 25, fault), 3, plant=overlapping).explain(candidates(overlapping), ())
    said = {h.name: h.probability for h in by_fault_set(with_a_twin(found))}
    assert {"pump_degrade", "impeller_worn"} <= set(said) and max(said.values()) < 0.9
    assert said["pump_degrade"] + said["impeller_worn"] >= 0.9


def test_beyond_its_range_a_cause_has_no_say(overlapping: Plant) -> None:
    fault = (FaultState("pump_degrade", 0.7, float(ONSET_S)),)
    found = follow(readings(3, ONSET_S + 15, fault), 3, plant=overlapping).explain(candidates(overlapping), ())
    assert "impeller_worn" not in {h.name for h in found}


def test_a_name_is_given_within_its_range_and_nowhere_else(plant: Plant) -> None:
    names = Names(plant.description.faults)
    of = {size: [f.name for f in names.of(FaultState("unknown_V2_F3_max", size, 1.0))] for size in (-0.3, -0.005, 0.1)}
    assert of == {-0.3: ["coolant_pipe_scaled"], -0.005: [], 0.1: []}
    assert not names.of(FaultState("unknown_V2_F3_max_growing", -0.1, 1.0))


def test_what_got_a_name_continues_what_had_none(plant: Plant) -> None:
    modes = {mode.name: mode for mode in plant.description.fault_modes}
    known = FaultState("unknown_V2_F3_max", -0.1, 5.0)
    assert continues(FaultState("coolant_pipe_scaled", -0.12, 5.0), known, modes)
    assert not continues(FaultState("lagging_lost", 100.0, 5.0), known, modes)
    assert not continues(
        FaultState("coolant_pipe_scaled", -0.12, 5.0), FaultState("unknown_V2_F3_max", 0.1, 5.0), modes
    )


def _scored(modes: dict[str, FaultMode], name: str, score: float) -> Scored:
    return Scored((FaultState(name, modes[name].severity_nominal, 100.0),), score)


@given(st.lists(st.floats(-12.0, 0.0), min_size=4, max_size=4), st.sampled_from([0.0, 0.05, 0.2]))
@settings(max_examples=60, deadline=None)
def test_whatever_stands_beside_one_another_comes_to_one(scores: list[float], misled: float) -> None:
    modes = _modes()
    names = ("impeller_worn", "pump_degrade", "outlet_block", "unknown_P1_tau_P1")
    group = [_scored(modes, name, score) for name, score in zip(names, scores, strict=True)]
    found = hypotheses(group, -3.0, modes, misled=misled)
    assert 1.0 - LEAST_PROBABILITY <= sum(h.probability for h in found) <= 1.0 + 1e-9
    assert [h.probability for h in found] == sorted((h.probability for h in found), reverse=True)
    said = {h.name for h in found} & set(names)
    best = max(scores[:3])
    leaders = {name for score, name in zip(scores, names[:3], strict=False) if score == best}
    assert not said or best < max(scores) - 8.0 or leaders & said, "the best name of the tables is among what is said"


def test_without_names_of_that_kind_one_explanation_stands_for_a_class() -> None:
    modes = _modes()
    group = [_scored(modes, "pump_degrade", 0.0), _scored(modes, "outlet_block", -0.1)]
    assert {h.name for h in hypotheses(group, -50.0, modes)} == {"pump_degrade"}
    beside = hypotheses([*group, _scored(modes, "impeller_worn", -0.2)], -50.0, modes)
    assert {h.name for h in beside} == {"pump_degrade", "impeller_worn"}


def _modes() -> dict[str, FaultMode]:
    """Fault modes of a reactor with a worn impeller, without a copy of its folder."""
    description = reactor().description
    mode = description.fault_mode("unknown_P1_K_P1")
    worn = FaultMode(
        "impeller_worn", "", "P1", None, mode.severity_range, -0.016, "L/s", 0.11, "", mode.effect, mode=mode.name
    )
    return {each.name: each for each in (*description.fault_modes, worn)}


def test_two_names_of_one_disturbance_are_a_set() -> None:
    modes = _modes()
    modes["impeller_eroded"] = replace(modes["impeller_worn"], name="impeller_eroded", prior=0.05)
    names = Names(modes.values())
    assert len(names.of(FaultState("unknown_P1_K_P1", -0.016, 1.0))) == 2
    group = [_scored(modes, "impeller_worn", 0.0), _scored(modes, "impeller_eroded", -0.8)]
    found = {h.name: h.probability for h in hypotheses(group, -50.0, modes)}
    assert set(found) == {"impeller_worn", "impeller_eroded"} and 0.6 < found["impeller_worn"] < 0.75
