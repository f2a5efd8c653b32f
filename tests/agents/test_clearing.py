"""Clearing: after a symptom has gone the plant is looked at again, and then left in peace."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.monitoring.clearing import LOOKS_S, RETURNS, Clearing, may_return
from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultState, Hypothesis


def looks(clearing: Clearing, first_s: int, last_s: int, *active: str) -> list[float]:
    return [float(at_s) for at_s in range(first_s, last_s + 1) if clearing.due(active, float(at_s))]


@given(st.lists(st.floats(0.01, 0.9), min_size=1, max_size=5), st.floats(0.0, 0.5))
def test_what_may_return_is_less_likely_than_nothing_and_as_likely_among_itself(
    shares: list[float], other: float
) -> None:
    said = [Hypothesis((FaultState(f"fault-{k}", 1.0, 0.0),), p) for k, p in enumerate(shares)]
    nothing, *left = may_return(
        [*said, Hypothesis((FaultState(SOMETHING_ELSE, 1.0, 0.0),), other), Hypothesis((), 0.1)]
    )
    assert nothing == Hypothesis((), 1.0 - RETURNS)
    assert [h.faults for h in left] == [h.faults for h in said]
    assert sum(h.probability for h in left) == pytest.approx(RETURNS)
    assert left[0].probability * shares[-1] == pytest.approx(left[-1].probability * shares[0])


def test_of_what_was_never_said_nothing_returns() -> None:
    assert may_return([]) == may_return([Hypothesis((), 1.0)]) == ()


def test_nothing_was_explained_and_nothing_is_looked_at() -> None:
    assert looks(Clearing(), 0, 1000) == []


def test_a_symptom_that_stays_is_no_reason() -> None:
    clearing = Clearing()
    clearing.explained(["S-X"])
    assert looks(clearing, 0, 1000, "S-X") == []


def test_after_one_has_gone_it_is_looked_a_few_times() -> None:
    clearing = Clearing()
    clearing.explained(["S-X", "S-Y"])
    assert looks(clearing, 0, 99, "S-X", "S-Y") == []
    assert looks(clearing, 100, 1000, "S-Y") == [100.0 + after_s for after_s in LOOKS_S]


def test_one_more_that_goes_begins_anew() -> None:
    clearing = Clearing()
    clearing.explained(["S-X", "S-Y"])
    assert looks(clearing, 100, 110, "S-Y") == [100.0 + LOOKS_S[0]]
    assert looks(clearing, 111, 1000) == [111.0 + after_s for after_s in LOOKS_S]


def test_looks_that_nobody_had_time_for_are_one() -> None:
    clearing = Clearing()
    clearing.explained(["S-X"])
    assert not clearing.due((), 100.0)
    assert clearing.due((), 100.0 + LOOKS_S[-1]) and not clearing.due((), 1000.0)


def test_what_is_over_is_not_looked_at() -> None:
    clearing = Clearing()
    clearing.explained(["S-X"])
    assert not clearing.due((), 100.0)
    clearing.over()
    assert looks(clearing, 101, 1000) == []
