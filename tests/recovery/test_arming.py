"""Arming where the rollouts are late: what the tables say of the limit in danger decides, and nobody claims more."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from homeostat.domain.events.recovery import FallbackArmed
from homeostat.domain.observation import Arm
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.recovery import Effect
from homeostat.domain.verdict import Rollout
from homeostat.recovery.arming import Arming
from homeostat.recovery.bounds import Budget
from homeostat.recovery.deadline import endangered
from tests.recovery.desk import DOOMED, Recovery, tick
from tests.safety.world import DRAIN, LIMITS, VENT, broken_down, rollout, rule

WET = rule("LIM-WET", LimitKind.TRIP_LIMIT, "L <= 11", hard=True)
BOTH = Limits((*LIMITS.limits, WET), LIMITS.criteria)
FALLBACKS = (DRAIN, replace(VENT, serves={"LIM-WET": Effect(60.0)}))


class Scene:
    """One in which everything that takes time is late."""

    now = SimpleNamespace(act_by_s=None)
    seen_s = 100.0
    age_s = 0.0

    def __init__(self) -> None:
        self.sent: list[Any] = []
        self.alarms: list[str] = []

    def send(self, message: object) -> None:
        self.sent.append(message)

    def alarm(self, name: str, cause: str) -> None:
        self.alarms.append(f"{name}: {cause}")

    async def within(self, what: str, limit_s: float, work: Coroutine[Any, Any, object]) -> object:
        work.close()
        raise TimeoutError(f"{what} took longer than {limit_s:g} s")


def armed(idle: Rollout) -> tuple[Arm, str]:
    scene, simulation = Scene(), SimpleNamespace(instrument_errors=lambda diagnosis: ())
    rules = SimpleNamespace(limits=BOTH, fallbacks=FALLBACKS, scales={})
    asyncio.run(Arming(scene, simulation, rules, Budget(arming_s=2.0)).arm(None, idle))  # type: ignore[arg-type]
    (message,) = [m for m in scene.sent if isinstance(m, Arm)]
    (alarm,) = scene.alarms
    return message, alarm


def test_what_is_in_danger_is_named_in_the_order_in_which_it_trips() -> None:
    assert endangered(rollout(), BOTH) == ()
    (hot,) = endangered(rollout(T=330.0, at=(1, 5)), BOTH)
    assert endangered(rollout(L=12.0, at=(0, 3)), BOTH) == ("LIM-WET",)
    both = rollout(T=330.0, at=(1, 5))
    both.trajectory.signals["L"][0, 3] = 12.0
    assert endangered(both, BOTH) == ("LIM-WET", hot)
    assert endangered(broken_down(), BOTH) == (), "nobody knows"


def test_late_rollouts_leave_what_serves_the_limit_in_danger_in_front_untried() -> None:
    message, alarm = armed(rollout(L=12.0, at=(0, 3)))
    assert message.strategies == (VENT.name, DRAIN.name) and message.tried is False and message.act_by_s is not None
    assert alarm.endswith(f"took longer than 2 s; {VENT.name!r} acts first, it is to bring LIM-WET back")


@pytest.mark.parametrize(
    "idle", [rollout(), rollout(T=330.0, at=(1, 5)), broken_down()], ids=["no danger", "unserved", "unknown"]
)
def test_where_no_table_says_more_its_order_counts(idle: Rollout) -> None:
    message, alarm = armed(idle)
    assert message.strategies == (DRAIN.name, VENT.name) and message.tried is False
    assert alarm.endswith(f"{DRAIN.name!r} acts first, as in the tables")


def test_what_physics_leaves_is_counted_from_the_last_sample_and_not_from_when_somebody_looks() -> None:
    """Nothing was read for 9 s while somebody thought: the limit is nearer by as much, and so is the time to act by."""
    seen = [tick(float(at_s), DOOMED, sampled=not 10 < at_s < 20) for at_s in range(1, 31)]
    at_once, late = Recovery(seen[:10]).run(), Recovery(seen, thinking=9).run()
    assert late.when(FallbackArmed)[0] == 19.0 > at_once.when(FallbackArmed)[0] == 10.0
    assert late.armed[0].act_by_s == pytest.approx(at_once.armed[0].act_by_s)
    (soon,), (later,) = at_once.trace.of(FallbackArmed), late.trace.of(FallbackArmed)[:1]
    assert later.deadline_s <= soon.deadline_s
