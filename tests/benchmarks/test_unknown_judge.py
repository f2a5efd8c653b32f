"""The study of unknown causes: the words that a look is judged by, and what many of them come to."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.unknown.causes import Cause
from benchmarks.unknown.jobs import Job
from benchmarks.unknown.judge import (
    EDGES,
    LEAST_COUNT,
    Statement,
    Verdict,
    answer,
    is_alike,
    is_right,
    merged,
    named,
    reliability,
    verdict,
)
from benchmarks.unknown.judging import NO_LOOK, Judged
from benchmarks.unknown.looks import balance_said
from benchmarks.unknown.operated import Operated, longer, poorer
from benchmarks.unknown.tally import Look, Share, right_from, severity_errors, statements, truly, with_a_name
from homeostat.domain.diagnosis import SOMETHING_ELSE
from homeostat.plants.plant import load_plant

JACKET = Cause("jacket", "heat", "J1", ("heat R1",), alike=("R1", "TT2"))
VALVE = Cause("valve", "actuator", "V2", (), alike=("FT3",))
WARM = Cause("warm", "input", "M_Feed", ("heat R1",), measured=True)
HARMLESS = Cause("sp", "harmless")
FOULING = Statement("fouling", "J1", "", 0.95)
BIAS = Statement("temp_bias", "TT1", "", 0.95)
HEAT = Statement("unknown heat", "", "heat R1", 0.95)
NOTHING = Statement("none", "", "", 0.95)


def at(one: Statement, probability: float) -> Statement:
    return Statement(one.name, one.component, one.balance, probability, one.severity)


@pytest.mark.parametrize(
    ("said", "cause", "expected"),
    [
        ([FOULING], JACKET, Verdict.RIGHT),
        ([HEAT], JACKET, Verdict.RIGHT),
        ([at(HEAT, 0.5), at(BIAS, 0.3)], JACKET, Verdict.RIGHT),
        ([at(BIAS, 0.5), at(FOULING, 0.3)], JACKET, Verdict.SET),
        ([at(BIAS, 0.6), at(FOULING, 0.03)], JACKET, Verdict.SET),
        ([at(BIAS, 0.8), at(FOULING, 0.03)], JACKET, Verdict.UNSURE),
        ([BIAS], JACKET, Verdict.WRONG),
        ([at(BIAS, 0.9), at(FOULING, 0.1)], JACKET, Verdict.WRONG),
        ([at(BIAS, 0.89), at(FOULING, 0.11)], JACKET, Verdict.SET),
        ([HEAT], VALVE, Verdict.ELSEWHERE),
        ([Statement("unknown TT1", "TT1", "", 0.95)], VALVE, Verdict.ELSEWHERE),
        ([Statement("unknown V2", "V2", "", 0.95)], VALVE, Verdict.RIGHT),
        ([Statement("unknown, poor fit", "", "", 0.95)], VALVE, Verdict.UNSURE),
        ([], VALVE, Verdict.NOTHING),
        ([NOTHING], VALVE, Verdict.NOTHING),
        ([at(NOTHING, 0.6), at(BIAS, 0.4)], VALVE, Verdict.NOTHING),
        ([], WARM, Verdict.RIGHT),
        ([NOTHING], WARM, Verdict.RIGHT),
        ([], HARMLESS, Verdict.RIGHT),
        ([BIAS], HARMLESS, Verdict.WRONG),
        ([HEAT], HARMLESS, Verdict.ELSEWHERE),
    ],
)  # fmt: skip
def test_a_look_is_judged_by_the_words_of_the_study(said: list[Statement], cause: Cause, expected: Verdict) -> None:
    assert verdict(said, cause) is expected


def test_after_a_disturbance_has_ended_it_is_right_that_nothing_is_wrong() -> None:
    passing, nothing = replace(JACKET, spec="UA * 0.6 from 2000 to 2400"), Statement("none", "", "", 0.95)
    for said in ([nothing], []):
        assert verdict(said, passing, 2399.0) is Verdict.NOTHING and verdict(said, passing, 2400.0) is Verdict.RIGHT
        assert verdict(said, JACKET, 2400.0) is Verdict.NOTHING, "what does not end goes on"
    assert verdict([BIAS], passing, 2400.0) is Verdict.WRONG, "a wrong name is wrong after it, too"
    assert truly(nothing, passing, 2400.0) and not truly(nothing, passing, 2399.0)


def test_a_phantom_beside_the_truth_is_another_item() -> None:
    assert verdict([Statement("fouling+temp_bias", "J1+TT1", "", 0.95)], JACKET) is Verdict.WRONG
    assert verdict([Statement("fouling+temp_bias", "J1+TT1", "", 0.5), at(FOULING, 0.4)], JACKET) is Verdict.SET


def test_of_a_pair_that_counts_which_is_false() -> None:
    lag, bias = ("unknown_P1_tau_P1", "P1"), ("temp_bias", "TT1")

    def pair(*parts: tuple[str, str]) -> Statement:
        return Statement("+".join(name for name, _ in parts), "+".join(about for _, about in parts), "", 0.95)

    for said in (pair(lag, bias), pair(bias, lag)):
        assert verdict([said], JACKET) is Verdict.WRONG and named([said]) == (said.name,)
    fouling = ("fouling", "J1")
    assert verdict([pair(lag, fouling)], JACKET) is verdict([pair(fouling, lag)], JACKET) is Verdict.ELSEWHERE
    assert verdict([pair(("pump_degrade", "P1"), ("outlet_block", "P1"))], JACKET) is Verdict.WRONG


def test_two_names_of_one_wrong_item_add_up() -> None:
    said = [Statement("pump_degrade", "P1", "", 0.5), Statement("outlet_block", "P1", "", 0.45)]
    assert verdict(said, VALVE) is Verdict.WRONG
    assert verdict([said[0], Statement("leak", "R1", "", 0.45)], VALVE) is Verdict.UNSURE


def test_another_name_on_the_true_balance_is_not_right() -> None:
    assert not is_right(Statement("reaction", "R1", "heat R1", 0.95), JACKET)
    assert is_alike(Statement("reaction", "R1", "heat R1", 0.95), JACKET)
    assert not is_alike(BIAS, JACKET) and not is_alike(NOTHING, JACKET)
    assert is_alike(Statement("x", "FT3", "", 1.0), VALVE)


def test_the_other_balance_of_a_vessel_is_another_cause() -> None:
    weir = Cause("weir", "mass", "R1", ("mass R1",))
    heat, mass = (
        Statement("unknown_heat_R1", "R1", "heat R1", 0.95),
        Statement("unknown_mass_R1", "R1", "mass R1", 0.95),
    )
    assert verdict([heat], weir) is Verdict.ELSEWHERE and verdict([mass], weir) is Verdict.RIGHT
    assert verdict([at(heat, 0.8), at(mass, 0.2)], weir) is Verdict.SET
    leak = Statement("leak", "R1", "mass R1", 0.95)
    draught = Cause("draught", "heat", "R1", ("heat R1",))
    assert verdict([leak], draught) is Verdict.WRONG and verdict([leak], weir) is Verdict.RIGHT
    assert verdict([heat], JACKET) is Verdict.RIGHT


@pytest.mark.parametrize(
    ("fault", "component", "balance"),
    [
        ("unknown_heat_R1", "R1", "heat R1"),
        ("unknown_mass_B204_growing", "B204", "mass B204"),
        ("unknown_heat_R1_UA", "R1", "heat R1"),
        ("fouling", "J1", "heat R1"),
        ("temp_bias", "TT1", ""),
    ],
)
def test_a_statement_says_its_balance(fault: str, component: str, balance: str) -> None:
    assert balance_said("cstr", fault, component) == balance


def test_the_answer_is_what_lies_within_three_nats() -> None:
    close, far = at(FOULING, 0.6 * math.exp(-2.9)), at(FOULING, 0.6 * math.exp(-3.1))
    assert answer([at(BIAS, 0.6), close]) == (at(BIAS, 0.6), close)
    assert answer([at(BIAS, 0.6), far]) == (at(BIAS, 0.6),)
    assert answer([]) == ()


def test_unknown_and_none_are_no_names() -> None:
    assert named([FOULING, HEAT, NOTHING]) == ("fouling",)
    assert named([at(FOULING, 0.49)]) == () and named([at(FOULING, 0.5)]) == ("fouling",)


def test_every_statement_is_in_one_bin() -> None:
    bins = reliability([(0.0, False), (0.5, True), (0.5, False), (1.0, True)], (0.0, 0.5, 1.0))
    assert [(b.count, b.right) for b in bins] == [(1, 0.0), (3, pytest.approx(2 / 3))]
    assert math.isnan(reliability([], (0.0, 1.0))[0].right)


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.booleans()), max_size=700))
def test_merged_bins_hold_enough_and_every_statement(said: list[tuple[float, bool]]) -> None:
    bins = merged(said)
    assert sum(b.count for b in bins) == len(said)
    assert len(bins) == 1 or all(b.count >= LEAST_COUNT for b in bins)
    assert [b.high for b in bins[:-1]] == [b.low for b in bins[1:]]
    assert {b.low for b in bins} | {b.high for b in bins} <= set(EDGES)


def test_a_bin_with_too_few_goes_to_its_smaller_neighbour() -> None:
    said = (
        [(0.05, False)] * 400 + [(0.2, False)] * 160 + [(0.4, True)] * 149 + [(0.6, True)] * 300 + [(0.97, True)] * 160
    )
    assert [(b.low, b.high, b.count) for b in merged(said)] == [
        (0.0, 0.1, 400),
        (0.1, 0.5, 309),
        (0.5, 0.7, 300),
        (0.7, 1.0, 160),
    ]


ELSE = Statement(SOMETHING_ELSE, "reactor", "", 0.2)


def test_a_share_for_something_else_makes_no_wrong_name_unsure() -> None:
    said = [at(BIAS, 0.8 * 0.95), ELSE, at(FOULING, 0.8 * 0.05)]
    assert verdict(said, JACKET) is Verdict.WRONG and answer(said) == (said[0], said[2])
    assert named([at(BIAS, 0.41), ELSE, at(FOULING, 0.39)]) == ("temp_bias",)
    assert verdict([at(ELSE, 0.5), at(BIAS, 0.5)], JACKET) is Verdict.UNSURE, "what fits nothing is sure of nothing"


def test_something_else_is_right_where_nothing_that_is_said_is() -> None:
    said = [at(BIAS, 0.7), at(FOULING, 0.1), ELSE]
    assert [right for _, right in statements(looks(JACKET, said))] == [False, True, False]
    assert [right for _, right in statements(looks(JACKET, [said[0], ELSE]))] == [False, True]


def looks(cause: Cause, *said: list[Statement], noticeable: bool = True, part: str = "unknown") -> list[Look]:
    job = Job("cstr", part, cause, 1, "plant")
    after = (0, 60, 120, 240)
    return [Look(job, Judged(job.name, after[k], 2000.0, tuple(s), 0.1, noticeable)) for k, s in enumerate(said)]


def silent(cause: Cause, noticeable: bool) -> Look:
    job = Job("cstr", "unknown", cause, 2, "plant")
    return Look(job, Judged(job.name, NO_LOOK, 0.0, (), 0.0, noticeable))


def test_a_noticeable_cause_without_a_symptom_was_not_recognised() -> None:
    seen = looks(JACKET, [BIAS], [HEAT], [FOULING])
    assert right_from(seen, 60) == Share(2, 2)
    assert right_from([*seen, silent(JACKET, True)], 60) == Share(3, 2)
    assert right_from([*seen, silent(JACKET, False)], 60) == Share(2, 2)
    assert right_from(looks(JACKET, [BIAS], [HEAT], noticeable=False), 60) == Share(0, 0)
    assert str(Share(3, 2)) == "2 of 3 (67 %)" and str(Share(0, 0)) == "none"


def test_a_known_fault_is_named_by_its_name_alone() -> None:
    named = [look.named for look in looks(JACKET, [FOULING], [HEAT], [BIAS], [])]
    assert named == [True, False, False, False]
    borrowed = [look.borrowed for look in looks(JACKET, [FOULING], [HEAT], [BIAS], [])]
    assert borrowed == [True, False, False, False]
    assert not looks(Cause("fouling", "known", "J1", known=True), [FOULING])[0].borrowed


def test_that_nothing_is_wrong_is_true_where_nothing_is() -> None:
    assert statements(looks(HARMLESS, [NOTHING])) == [(0.95, True)]
    assert statements(looks(JACKET, [NOTHING])) == [(0.95, False)]
    assert statements(looks(WARM, [NOTHING])) == [(0.95, True)]
    assert statements([silent(JACKET, True)]) == []


def test_severities_are_compared_where_the_fault_is_named() -> None:
    pump = load_plant("cstr").description.fault("pump_degrade")
    truth = Cause("pump_degrade", "known", "P1", severity=0.5, fault="pump_degrade")
    right, other = Statement("pump_degrade", "P1", "", 0.9, 0.59), Statement("outlet_block", "P1", "", 0.9, 0.9)
    assert severity_errors(looks(truth, [], [], [right]), pump) == pytest.approx([0.1])
    assert severity_errors(looks(truth, [right], [right], [other]), pump) == []


def test_runs_with_a_name_say_which() -> None:
    seen = looks(HARMLESS, [BIAS], [BIAS], [NOTHING], [FOULING], part="harmless")
    assert with_a_name(seen) == ("cstr-plant-harmless-sp-1: temp_bias, fouling",), "one run, however often"
    violates = [Look(x.job, replace(x.judged, violated=("ACC-T-HIGH",))) for x in seen]
    assert with_a_name(violates) == (), "it is not harmless"


def test_harm_is_what_doing_nothing_would_not_have_done() -> None:
    fine = Operated("a", 10.0, True, 0.0, 1, 0, 1, (), "recovered", 1.0)
    worse = Operated("b", 10.5, True, 0.2, 1, 0, 1, (), "held", 1.0)
    unsafe = Operated("c", -5.0, False, 0.9, 1, 0, 1, (), "held", 1.0)
    none = Operated("d", 0.0, True, math.nan, 1, 0, 1, (), "held", 1.0)
    assert longer([fine, worse, unsafe, none]) == (worse,)
    assert poorer([fine, worse, unsafe, none], 0.1) == (worse,)
