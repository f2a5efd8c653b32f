"""A reactor whose cooling valve has just stuck: what agents are asked about."""

from __future__ import annotations

import functools

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Situation
from homeostat.agents.search.action import SearchAction, SearchSettings
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.snapshot import Snapshot
from tests.twin.followed import follow, reactor, readings

STUCK = FaultState("cool_stuck_closed", 0.7, 1450.0)
NOW_S = 1460
DIAGNOSIS = Diagnosis(float(NOW_S), (), (Hypothesis((STUCK,), 0.9), Hypothesis((), 0.1)))


@functools.cache
def stuck() -> tuple[Snapshot, ...]:
    """A reactor whose cooling valve sticks at 1450 s."""
    return readings(3, NOW_S + 5, (STUCK,))


@functools.cache
def grounding() -> Grounding:
    plant = reactor()
    return Grounding(plant.graph, plant.namespace)


def now() -> Situation:
    return Situation(stuck()[NOW_S - 1], DIAGNOSIS, "normal", stuck()[:NOW_S])


QUICK = SearchSettings(coarse=(0.1,), finalists=3, fine=(0.05,))


def search(settings: SearchSettings | None = None) -> SearchAction:
    """A search on a twin that has followed the stuck valve up to now."""
    d, plant = reactor().description, reactor()
    pricing = Pricing(plant.prices, d.limits, d.scales)
    return SearchAction(follow(stuck()[:NOW_S]), d, pricing, settings)
