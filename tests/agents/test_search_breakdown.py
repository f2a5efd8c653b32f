"""What leaves the physical world in a rollout of the search is no answer, and no reason to give up searching."""

from __future__ import annotations

import asyncio
import copy
import math
from typing import Any

from homeostat.agents.checks import judge
from homeostat.domain.advice import Advice
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise, RolloutResult
from homeostat.twin.twin import Twin
from tests.agents.stuck_valve import NOW_S, QUICK, now, search, stuck
from tests.twin.followed import follow, reactor

MOST_FEED = 0.02
"""A forecast that leads to more feed than this breaks down in these tests [L/s]."""


def path(transition: str) -> RecoveryPath:
    machine = reactor().description.machine
    return RecoveryPath(machine, (next(t for t in machine.transitions if t.name == transition),))


class Brittle:
    """The kernel of the reactor, of which a forecast breaks down where more than so much is fed in the end."""

    tick_s = 1.0

    def __init__(self, most: float) -> None:
        self.real, self.most, self.lost = reactor().model.kernel, most, 0
        self.feed = reactor().model.inputs.index("F1_sp")

    def __call__(self, *given: Any) -> None:
        self.real(*given)
        first, last, inputs, follows, start_s, broken = given[0], given[1], given[6], given[7], given[8], given[17]
        for m in range(first, last):
            if start_s >= NOW_S and inputs[follows[m], -1, self.feed] > self.most:
                broken[m], self.lost = start_s + given[10], self.lost + 1
                given[16][m, -1] = math.nan  # a kernel writes nothing after that


def brittle_twin(kernel: Brittle) -> Twin:
    twin = follow(stuck()[:NOW_S])
    brittle = copy.copy(reactor().model)
    brittle.kernel = kernel
    twin._model = brittle
    return twin


def searched(kernel: Brittle, transition: str) -> ActionSet:
    action = search(QUICK)
    action._twin = brittle_twin(kernel)
    return asyncio.run(action.act(now(), path(transition), Advice()))


def feed_of(actions: ActionSet) -> float:
    command = actions.command("F1.sp")
    assert command is not None and command.value is not None
    return command.value


def test_the_search_goes_on_beside_what_breaks_down() -> None:
    kernel = Brittle(MOST_FEED)
    found = searched(kernel, "t_reduce")
    assert kernel.lost > 0, "some of what it tried broke down"
    assert 0.0 < feed_of(found) <= MOST_FEED + 1e-9


def test_where_everything_breaks_down_the_judge_says_so_once() -> None:
    """The search still names something, and the rollout that is judged refuses it with the time and the state."""
    kernel = Brittle(-1.0)
    found = searched(kernel, "t_reduce")
    twin = brittle_twin(kernel)
    rollout = twin.roll_out(found, now().diagnosis.hypotheses)
    assert rollout.result is RolloutResult.BROKE_DOWN and "left the physical world" in rollout.note
    d, way = reactor().description, path("t_reduce")
    verdict = judge(found, rollout, d.limits, d.machine.state(way.target), d.tags_by_name, way)
    assert isinstance(verdict, Revise) and len(verdict.findings) == 1
    assert "left the physical world" in verdict.findings[0].message
