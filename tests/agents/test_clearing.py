"""Clearing: after a symptom has gone the plant is looked at again, and then left in peace."""

from __future__ import annotations

from homeostat.agents.monitoring.clearing import LOOKS_S, Clearing


def looks(clearing: Clearing, first_s: int, last_s: int, *active: str) -> list[float]:
    return [float(at_s) for at_s in range(first_s, last_s + 1) if clearing.due(active, float(at_s))]


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
