"""Scenarios: the ground truth of a run, and what cannot be asked for."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.evaluate.scenario import ScenarioError, repaired, scenario
from homeostat.plants.plant import load_plant
from tests.twin.followed import reactor


def test_defaults_come_from_the_case_and_the_fault() -> None:
    plant = reactor()
    made = scenario(plant, "fouling", 3)
    assert made.faults == (FaultState("fouling", plant.description.fault("fouling").severity_nominal, plant.onset_s),)
    assert (made.case, made.seed, made.end_s, made.fault, made.onset_s) == (
        "cstr",
        3,
        plant.end_s,
        "fouling",
        plant.onset_s,
    )


def test_a_fault_free_scenario_has_no_onset() -> None:
    made = scenario(reactor(), "none", 0)
    assert made.faults == () and made.fault == "none" and made.onset_s is None


def test_faults_can_be_combined() -> None:
    made = scenario(reactor(), "fouling+leak", 0, onset_s=1500.0)
    assert [f.fault for f in made.faults] == ["fouling", "leak"] and made.fault == "fouling+leak"
    assert {f.onset_s for f in made.faults} == {1500.0}


def test_a_fault_with_several_places_is_named_with_its_place() -> None:
    plant = load_plant("mixing_module")
    assert scenario(plant, "clogging", 0, location="B202").faults == scenario(plant, "clogging_B202", 0).faults
    assert scenario(plant, "clogging", 0, location="B202").fault == "clogging_B202"


@pytest.mark.parametrize(
    ("fault", "location", "message"),
    [
        ("clogging", "B209", r"'clogging' has no location 'B209'; it can be at B201, B202, B203, common, main"),
        ("pump_degradation", "P101", r"'pump_degradation' has no location 'P101'; it has only one place"),
        ("none", "B202", r"location 'B202' needs exactly one fault, and none is named; name it"),
        (
            "clogging+leakage",
            "main",
            r"location 'main' needs exactly one fault, and 2 are named, clogging\+leakage; name one",
        ),
    ],
)
def test_a_place_that_there_is_not_is_refused(fault: str, location: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        scenario(load_plant("mixing_module"), fault, 0, location=location)


@pytest.mark.parametrize(
    ("severity", "allowed"),
    [
        (0.05, True),
        (0.95, True),
        (math.nextafter(0.05, 0.0), False),
        (math.nextafter(0.95, 1.0), False),
        (math.nan, False),
        (math.inf, False),
        (-0.5, False),
    ],
)
def test_the_severity_lies_in_the_fault_s_range(severity: float, allowed: bool) -> None:
    if allowed:
        assert scenario(reactor(), "fouling", 0, severity=severity).faults[0].severity == severity
    else:
        with pytest.raises(ScenarioError, match=r"severity .* of 'fouling' must lie in 0.05 to 0.95"):
            scenario(reactor(), "fouling", 0, severity=severity)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"fault": "foulin"}, r"no fault 'foulin'; did you mean 'fouling'\?"),
        ({"fault": ""}, r"no fault ''"),
        ({"fault": "fouling+"}, r"no fault ''"),
        ({"fault": "fouling+fouling"}, r"names a fault twice"),
        ({"fault": "fouling+leak", "severity": 0.5}, r"severity 0.5 needs exactly one fault"),
        ({"fault": "none", "severity": 0.5}, r"severity 0.5 needs exactly one fault"),
        ({"fault": "none", "onset_s": 100.0}, r"needs a fault"),
        ({"seed": -1}, r"seed -1 must"),
        ({"onset_s": -1.0}, r"onset -1 s must lie in the run, .*; choose an onset from 0 s on"),
        ({"onset_s": 6000.0}, r"onset 6000 s must lie in the run, 0 s to 6000 s; choose an earlier onset, or a later"),
        ({"onset_s": math.nan}, r"onset nan s must lie in the run"),
        ({"onset_s": math.inf}, r"onset inf s must lie in the run"),
        ({"end_s": 0.0}, r"end of the run 0 s must lie"),
        ({"end_s": math.nan}, r"end of the run nan s must lie"),
        ({"end_s": math.inf}, r"end of the run inf s must lie"),
        ({"end_s": 100.0}, r"onset 2000 s must lie in the run"),
    ],
)
def test_what_cannot_be_asked_for_is_said_in_one_line(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message) as refused:
        scenario(reactor(), **({"fault": "fouling", "seed": 0} | arguments))  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)


def test_a_repair_ends_every_fault_and_needs_one_before_it() -> None:
    made = repaired(scenario(reactor(), "fouling", 0, onset_s=1500.0), 2000.0)
    assert made.repaired_s == 2000.0 and made.undisturbed.repaired_s is None
    assert repaired(made, None) is made
    for fault, at_s, message in (
        ("none", 2000.0, "needs a fault"),
        ("fouling", 1500.0, "must come after the onset at 1500 s"),
        ("fouling", 1499.0, "must come after the onset at 1500 s"),
        ("fouling", reactor().end_s, "before the end of the run"),
        ("fouling", math.nan, "must come after the onset"),
    ):
        chosen = scenario(reactor(), fault, 0, onset_s=1500.0 if fault != "none" else None)
        with pytest.raises(ScenarioError, match=message):
            repaired(chosen, at_s)
