"""Probabilities of faults: hypotheses that differ in severity alone are one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState, Hypothesis, by_fault_set

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
