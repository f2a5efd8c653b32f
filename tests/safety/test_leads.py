"""A rollout that the guard would end is refused where it trips; a fallback, which acts from there, at the limit."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.agents.certificates import violated
from homeostat.agents.checks import Part, judge, judge_parts, judge_passing, judge_safety
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise
from homeostat.recovery.deadline import first_violated_s
from tests.safety.world import ACTIONS, DRAIN, HOT, RUNNING, TAGS, rollout

LEADING = Limits((replace(HOT, lead=3.0),), ())
REST = ActionSet((), "running")


@pytest.mark.parametrize(("kelvin", "kept"), [(310.0, True), (310.5, False), (312.9, False), (313.1, False)])
def test_what_goes_on_without_a_fallback_is_refused_where_it_trips(kelvin: float, kept: bool) -> None:
    found = judge(ACTIONS, rollout(T=kelvin), LEADING, RUNNING, TAGS)
    assert isinstance(found, Approve) is kept
    assert isinstance(judge_passing(REST, rollout(REST, T=kelvin), LEADING, TAGS, None), Approve) is kept
    if isinstance(found, Revise):
        (refused,) = found.violated
        assert refused.margin == pytest.approx(310.0 - kelvin) and "'T <= 310'" in refused.message
    assert violated(rollout(T=kelvin), LEADING.watched.hard).any() != kept


@pytest.mark.parametrize(("kelvin", "kept"), [(312.9, True), (313.1, False)])
def test_a_fallback_is_refused_where_it_violates(kelvin: float, kept: bool) -> None:
    found = judge_safety(DRAIN.actions, rollout(DRAIN.actions, T=kelvin), LEADING)
    assert isinstance(found, Approve) is kept


@pytest.mark.parametrize("tick_s", [0.1, 5.0, 60.0])
@pytest.mark.parametrize(("row", "kept"), [(1, False), (6, True)])
def test_what_a_fallback_ends_must_not_trip_before_and_may_come_near_after(row: int, kept: bool, tick_s: float) -> None:
    told = rollout(REST, at=(0, row), dt_s=tick_s, T=312.0)
    then = Part(DRAIN.actions, needs=False)
    assert isinstance(judge_parts(Part(REST, needs=False), then, told, 5 * tick_s, LEADING, TAGS), Approve) is kept


def test_the_time_left_ends_where_it_trips() -> None:
    told = rollout(at=(0, 2), T=312.0)
    assert first_violated_s(told, LEADING) == 10.0
    assert first_violated_s(told, Limits((HOT,), ())) == float("inf")
