"""Hypotheses that count: what people are told besides has no part in what is decided."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.agents.hypotheses import plausible, plausible_faults
from homeostat.domain.diagnosis import SOMETHING_ELSE, Diagnosis, FaultState, Hypothesis

LEAK, BIAS = FaultState("leak", 0.1, 5.0), FaultState("bias", 1.0, 7.0)
ELSE = FaultState(SOMETHING_ELSE, 1.0, 5.0)


def said(*held: tuple[tuple[FaultState, ...], float]) -> Diagnosis:
    return Diagnosis(10.0, (), tuple(Hypothesis(faults, probability) for faults, probability in held))


def test_a_share_for_something_else_is_rolled_out_by_nobody_and_drops_nothing() -> None:
    """What is just plausible among what can be rolled out stays so."""
    diagnosis = said(((LEAK,), 0.8 * 0.979), ((ELSE,), 0.2), ((BIAS,), 0.8 * 0.021))
    kept = plausible(diagnosis)
    assert [h.name for h in kept] == ["leak", "bias"]
    assert [h.probability for h in kept] == pytest.approx([0.979, 0.021])
    assert plausible_faults(diagnosis) == ("bias", "leak")


def test_something_else_that_is_as_likely_as_not_is_rolled_out() -> None:
    assert [h.name for h in plausible(said(((ELSE,), 0.5), ((LEAK,), 0.5)))] == [SOMETHING_ELSE, "leak"]


def test_where_probably_nothing_is_wrong_no_cause_is_acted_on() -> None:
    diagnosis = replace(said(((), 0.5), ((LEAK,), 0.4), ((ELSE,), 0.1)), doubts=True)
    assert not diagnosis.faulty and plausible(diagnosis) == (Hypothesis((), 1.0),)
    assert plausible_faults(diagnosis) == ()


def test_sizes_of_one_fault_count_together() -> None:
    """What closes paths is rolled out, whatever number of sizes it has: one threshold for both."""
    sizes = [((replace(BIAS, severity=s),), 0.03 * part) for s, part in ((1.0, 0.6), (0.5, 0.2), (2.0, 0.2))]
    diagnosis = said(((LEAK,), 0.97), *sizes)
    assert plausible_faults(diagnosis) == ("bias", "leak")
    kept = [(h.faults, h.probability) for h in plausible(diagnosis)]
    assert kept == [((LEAK,), 0.97), ((BIAS,), pytest.approx(0.03))]


def test_the_best_size_stands_for_those_that_are_too_unlikely_by_themselves() -> None:
    sizes = [((replace(BIAS, severity=s),), part) for s, part in ((1.0, 0.06), (0.5, 0.02), (2.0, 0.01))]
    kept = plausible(said(((LEAK,), 0.91), *sizes))
    assert [(h.faults[0].severity, h.probability) for h in kept[1:]] == [(1.0, pytest.approx(0.07)), (0.5, 0.02)]


def test_the_faults_that_count_are_those_of_what_is_rolled_out() -> None:
    for share in (0.01, 0.019, 0.021, 0.04, 0.3):
        sizes = [((replace(BIAS, severity=s),), share * part) for s, part in ((1.0, 0.6), (0.5, 0.2), (2.0, 0.2))]
        diagnosis = said(((LEAK,), 1.0 - share), *sizes)
        rolled_out = {f.fault for h in plausible(diagnosis) for f in h.faults}
        assert set(plausible_faults(diagnosis)) == rolled_out
