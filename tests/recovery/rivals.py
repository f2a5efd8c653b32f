"""Proposers that compete at a desk, and what their proposals cost.

Over 100 s the line makes 3 EUR at full feed. At half feed it loses 1.5 EUR, 0.03 EUR for the state and 0.27 EUR for the
release: GOOD costs 1.80 EUR, and to hold 3.00 + 0.06 + 0.27 = 3.33 EUR.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from homeostat.agents.roles import NoAdmissiblePlan, Plan, Proposer, Situation
from homeostat.domain.events.recovery import Attempted, ReleasedActions
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.recovery.bounds import Budget
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedPlanning, ScriptedReprompting
from tests.recovery.desk import DOOMED, FINE, Recovery, ticks
from tests.recovery.line import COOLING, HALF, OFF, feed

HELD = feed(OFF, "still")
GOOD_EUR, HELD_EUR = 1.80, 3.33
SAVING = feed(0.8 * HALF, "reduced")
"""Costs 2.10 EUR: less than to hold, more than GOOD."""
SAVING_EUR = 2.10
DEARER = feed(0.7 * HALF, "reduced")


def proposer(
    name: str, action: ScriptedAction, *paths: str | Plan | BaseException, thorough: bool = False, **more: Any
) -> Proposer:
    """One that knows ``paths`` as names of transitions, the last one for ever; by default the way to reduced."""
    ways = [(p,) if isinstance(p, str) else p for p in paths or ("reduce",)]
    reprompting = more.pop("reprompting", ScriptedReprompting())
    made = {"attempts": 4, "improves": True, **more}
    return Proposer(name, ScriptedPlanning(COOLING, *ways), action, reprompting, thorough=thorough, **made)


NO_OTHER = NoAdmissiblePlan("no other path")


def thorough(action: ScriptedAction, *paths: str | BaseException, **more: Any) -> Proposer:
    return proposer("thorough", action, *(paths or ("reduce", NO_OTHER)), thorough=True, **more)


def doomed(*answers: ActionSet | BaseException, others: tuple[Proposer, ...] = (), **more: Any) -> Recovery:
    """A line that runs through its limit if nothing is done; a first proposer with ``answers``, and others after it."""
    made = {"attempts": len(answers), **more}
    return Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(*answers), others=others, **made)


def safe(*answers: ActionSet | BaseException, others: tuple[Proposer, ...] = (), **more: Any) -> Recovery:
    """A line that may stay at half feed for 1.53 EUR."""
    made = {"attempts": len(answers), "improves": True, **more}
    seen = ticks(1, 20, FINE, "reduced", feed=HALF)
    return Recovery(seen, action=ScriptedAction(*answers), others=others, **made)


def by(done: Recovery) -> list[tuple[str, str]]:
    """Who had something released, and its digest."""
    return [(r.proposer, r.digest) for r in done.trace.of(ReleasedActions)]


def asked(done: Recovery) -> list[str]:
    """Who proposed, in order."""
    return [a.proposer for a in done.trace.of(Attempted)]


LATENCY = Bounds(Budget(latency_s=3.0))
MORE_THAN_HALF_S = 1.6
"""Time that is there where all of it is used, also on a busy host, and not where half of it is kept [s]."""
HANGS_S = 0.6
"""One answer hangs after this, where thinking costs what is declared [s]."""


class Polish:
    """Implements `homeostat.agents.roles.Polishing`: gives one answer, fails, or never answers."""

    def __init__(
        self, answer: ActionSet | BaseException | None, tracked: Mapping[str, ActionSet | BaseException] | None = None
    ) -> None:
        """``tracked``: digest -> the same by hand."""
        self._answer, self._tracked = answer, tracked or {}

    async def polish(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        if self._answer is None:
            await asyncio.sleep(60.0)
            raise AssertionError
        if isinstance(self._answer, BaseException):
            raise self._answer
        return self._answer

    async def tracked(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        by_hand = self._tracked.get(actions.digest, actions)
        if isinstance(by_hand, BaseException):
            raise by_hand
        return by_hand
