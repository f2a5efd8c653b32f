"""Adoption: the unknown of a run's last diagnosis as rows of the tables, or one line that says why not."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultState, Hypothesis, Symptom
from homeostat.domain.events.recovery import Diagnosed
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.plant.tag import Range
from homeostat.domain.recovery import Command
from homeostat.evaluate.recorded.adoption import AdoptionError, _possible, adoption
from homeostat.record.run_record import RunRecord
from tests.twin.followed import reactor

PLANT = reactor().description
SEEN = Symptom("S-COOLANT-OFF", 1510.0, -0.06, 0.04, 1.5)


def record(*diagnoses: dict[str, float], rule: str = SEEN.rule, severity: float = -0.12) -> RunRecord:
    """A run with these diagnoses: name, several joined by '+' -> probability."""
    made = RunRecord()
    for k, said in enumerate(diagnoses):
        found = [
            Hypothesis(tuple(FaultState(f, severity, 1500.0) for f in name.split("+") if f != "none"), probability)
            for name, probability in said.items()
        ]
        seen = Symptom(rule, 1510.0 + k, -0.06, 0.04, 1.5)
        made(Diagnosed((seen,), tuple(found)), 1510.0 + 600.0 * k)
    return made


def test_what_was_unknown_is_a_row_and_a_symptom() -> None:
    found = adoption(record({"unknown_V2_F3_max": 0.94, SOMETHING_ELSE: 0.06}), PLANT, "scale", "Scale in the pipe")
    assert found.mode.name == "unknown_V2_F3_max" and found.symptoms == ("S-COOLANT-OFF",)
    row = dict(found.fault)
    assert (row["id"], row["label"], row["component"], row["mode"]) == (
        "scale", "Scale in the pipe", "V2", "unknown_V2_F3_max"
    )  # fmt: skip
    assert (row["nominal"], row["low"], row["high"], row["severity_unit"]) == ("-0.12", "-0.36", "-0.03", "L/s")
    assert float(row["prior"]) == pytest.approx(sum(f.prior for f in PLANT.faults) / len(PLANT.faults), rel=1e-3)
    assert found.rows["symptom_faults"] == ({"symptom": "S-COOLANT-OFF", "fault": "scale"},)


def test_the_last_diagnosis_counts_and_symptoms_of_all_that_said_it() -> None:
    made = record({"unknown_V2_F3_max": 0.5, "F3_reads_low": 0.5})
    later = record({"unknown_V2_F3_max": 1.0}, rule="S-HOT").entries[0]
    made(later.event, 2100.0)
    assert adoption(made, PLANT, "scale", "").symptoms == ("S-COOLANT-OFF", "S-HOT")
    assert adoption(made, PLANT, "scale", "").fault["label"] == PLANT.fault_mode("unknown_V2_F3_max").label


def released(made: RunRecord, at_s: float) -> None:
    commands = (Command("V2.man", 0.4, 0.05),)
    made(WriteIntended(1, 1, Cause.REQUEST, "search-1", commands, "", "reduced_load"), at_s)


def test_what_was_seen_first_shows_it_although_other_causes_were_likelier_then() -> None:
    """And what is seen after a release may be what that has done."""
    made = record({"fouling": 0.9, SOMETHING_ELSE: 0.1})
    released(made, 1520.0)
    for later_s, rule in ((1630.0, "S-HOT"), (2230.0, "S-COLD")):
        seen = (Symptom(SEEN.rule, 1510.0, -0.06, 0.04, 1.5), Symptom(rule, later_s, 2.0, 1.4, 1.4))
        state = FaultState("unknown_V2_F3_max", -0.12, 1500.0)
        made(Diagnosed(seen[(rule == "S-COLD") :], (Hypothesis((state,), 1.0),)), later_s + 1.0)
    assert adoption(made, PLANT, "scale", "").symptoms == (SEEN.rule,)


def test_what_was_seen_after_a_release_alone_is_better_than_nothing() -> None:
    made = record({"none": 1.0}, rule="no rule")
    released(made, 1505.0)
    made(record({"unknown_V2_F3_max": 1.0}, rule="S-HOT").entries[0].event, 1512.0)
    assert adoption(made, PLANT, "scale", "").symptoms == ("S-HOT",)


def test_which_of_a_set_it_was_is_for_a_person_to_say() -> None:
    made = record({"unknown_V2_F3_max": 0.44, "F3_reads_low": 0.5, SOMETHING_ELSE: 0.06})
    with pytest.raises(AdoptionError, match=r"a set .*FT3 and V2 tells.*--mode unknown_V2_F3_max") as caught:
        adoption(made, PLANT, "scale", "")
    assert "\n" not in str(caught.value)
    assert adoption(made, PLANT, "scale", "", "unknown_V2_F3_max").mode.name == "unknown_V2_F3_max"
    with pytest.raises(AdoptionError, match=r"'unknown_P1_K_P1'.*it has "):
        adoption(made, PLANT, "scale", "", "unknown_P1_K_P1")


REFUSED: list[tuple[tuple[dict[str, float], ...], str, str]] = [
    ((), "scale", "nothing was diagnosed"),
    (({"fouling": 0.94, SOMETHING_ELSE: 0.06},), "scale", "94 % fouling|100 % fouling"),
    (({"none": 0.9, "unknown_V2_F3_max": 0.05},), "scale", "no unknown disturbance"),
    (({SOMETHING_ELSE: 0.6, "fouling": 0.4},), "scale", "no unknown disturbance"),
    (({SOMETHING_ELSE: 1.0},), "scale", "no unknown disturbance"),
    (({"F3_noisy": 1.0},), "scale", "nothing simulates it"),
    (({"T1_swings": 1.0},), "scale", "a table states no period"),
    (({"unknown_V2_F3_max+leak": 1.0},), "scale", "no unknown disturbance of one item"),
    (({"unknown_V2_F3_max": 0.6, "leak": 0.4},), "scale", "R1 and V2"),
    (({"unknown_V2_F3_max": 1.0},), "fouling", "choose another name"),
    (({"unknown_V2_F3_max": 1.0},), "unknown_V2_F3_max", "choose another name"),
    (({"unknown_V2_F3_max": 1.0},), "none", "choose another name"),
    (({"unknown_V2_F3_max": 1.0},), "two words", "letters, digits"),
    (({"unknown_V2_F3_max": 1.0},), "a+b", "letters, digits"),
    (({"unknown_V2_F3_max": 1.0},), "", "letters, digits"),
]


@pytest.mark.parametrize(("diagnoses", "name", "why"), REFUSED)
def test_what_cannot_get_a_name_is_one_line(diagnoses: tuple[dict[str, float], ...], name: str, why: str) -> None:
    with pytest.raises(AdoptionError, match=why) as caught:
        adoption(record(*diagnoses), PLANT, name, "")
    assert "\n" not in str(caught.value)


def test_without_a_symptom_nothing_could_be_diagnosed() -> None:
    with pytest.raises(AdoptionError, match="no symptom"):
        adoption(record({"unknown_V2_F3_max": 1.0}, rule="S-OF-ANOTHER-PLANT"), PLANT, "scale", "")


@given(st.sampled_from(["unknown_V2_F3_max", "unknown_heat_R1", "T1_reads_low", "T1_frozen"]), st.floats(-1e3, 1e3))
def test_a_row_stays_inside_what_its_mode_can_be(mode: str, severity: float) -> None:
    allowed = PLANT.fault_mode(mode).severity_range
    if math.isclose(allowed.clip(severity), 0.0, abs_tol=1e-9):
        return
    row = adoption(record({mode: 1.0}, severity=severity), PLANT, "named", "").fault
    low, nominal, high = (float(row[column]) for column in ("low", "nominal", "high"))
    assert low < high and low <= nominal <= high
    assert allowed.contains(low) and allowed.contains(high)
    assert low >= 0.0 or high <= 0.0, "it is on the side that was seen"


def test_no_more_is_lost_than_there_is_and_what_was_cut_is_said() -> None:
    mode = PLANT.fault_mode("unknown_V2_F3_max")
    sizes, cut = _possible(mode, Range(-0.9, -0.075), PLANT)
    assert (sizes.low, sizes.high) == (-0.475, -0.075)
    assert cut == "sizes end at -0.475 L/s and not at -0.9: F3_max is 0.5 L/s, and no more is lost than there is"
    assert _possible(mode, Range(0.1, 0.9), PLANT) == (Range(0.1, 0.9), ""), "of what is gained there may be more"
    assert adoption(record({"unknown_V2_F3_max": 1.0}), PLANT, "scale", "").cut == ""
