"""Probabilities of faults: hypotheses that differ in severity alone are one."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import (
    SOMETHING_ELSE,
    Diagnosis,
    FaultState,
    Hypothesis,
    by_fault_set,
    with_a_twin,
)

FAULTS = st.lists(st.sampled_from(["leak", "fouling", "bias"]), unique=True, max_size=2).map(
    lambda names: tuple(FaultState(name, 0.5, 0.0) for name in sorted(names))
)
HYPOTHESES = st.lists(st.builds(Hypothesis, FAULTS, st.floats(0.0, 1.0)), max_size=8)


def test_probabilities_add_up_and_the_most_probable_severity_speaks() -> None:
    small, large, other = (FaultState("leak", 0.1, 5.0), FaultState("leak", 0.2, 6.0), FaultState("bias", 1.0, 7.0))
    items = by_fault_set([Hypothesis((small,), 0.3), Hypothesis((other,), 0.25), Hypothesis((large,), 0.45)])
    assert [(b.name, b.faults) for b in items] == [("leak", (large,)), ("bias", (other,))]
    assert items[0].probability == pytest.approx(0.75)


@given(HYPOTHESES)
def test_nothing_is_lost_and_nothing_is_twice(hypotheses: list[Hypothesis]) -> None:
    items = by_fault_set(hypotheses)
    assert sum(b.probability for b in items) == pytest.approx(sum(h.probability for h in hypotheses))
    assert {b.name for b in items} == {h.name for h in hypotheses}
    assert len({b.name for b in items}) == len(items)
    assert [b.probability for b in items] == sorted((b.probability for b in items), reverse=True)


ELSE = FaultState(SOMETHING_ELSE, 1.0, 0.0)


@given(HYPOTHESES.filter(lambda held: sum(h.probability for h in held) > 0.01), st.floats(0.01, 0.49))
def test_a_share_for_something_else_makes_no_explanation_weaker(hypotheses: list[Hypothesis], misled: float) -> None:
    """Whatever share is put aside, what a twin can carry has the probabilities among itself that it had without."""
    total = sum(h.probability for h in hypotheses)
    alone = [replace(h, probability=h.probability / total) for h in hypotheses]
    said = [*(replace(h, probability=(1.0 - misled) * h.probability) for h in alone), Hypothesis((ELSE,), misled)]
    found = with_a_twin(said)
    assert [h.faults for h in found] == [h.faults for h in alone]
    assert [h.probability for h in found] == pytest.approx([h.probability for h in alone])


def test_something_else_that_is_as_likely_as_not_counts_as_it_is_said() -> None:
    said = (Hypothesis((ELSE,), 0.5), Hypothesis((FaultState("leak", 0.1, 5.0),), 0.5))
    assert with_a_twin(said) == said
    assert with_a_twin(said[1:]) == said[1:] and with_a_twin(()) == ()


@pytest.mark.parametrize("doubts", [True, False])
def test_nothing_is_probably_wrong_where_there_are_doubts_only(doubts: bool) -> None:
    held = (Hypothesis((), 0.5), Hypothesis((FaultState("leak", 0.1, 5.0),), 0.3), Hypothesis((ELSE,), 0.2))
    assert Diagnosis(0.0, (), held, doubts=doubts).faulty is not doubts
    assert not Diagnosis(0.0, (), ()).faulty and not Diagnosis(0.0, (), held[:1]).faulty
