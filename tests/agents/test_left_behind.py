"""Work that was given up goes on in its thread: it neither sees nor changes what others are computing with."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from homeostat.agents.pricing import Pricing
from homeostat.agents.search.action import SearchAction, SearchSettings
from homeostat.agents.simulation import TwinSimulation
from homeostat.domain.advice import Advice
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout
from homeostat.process.model import ProcessModel
from homeostat.twin.twin import Twin
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, now, stuck
from tests.twin.followed import reactor

NOTHING = ActionSet((), "normal")
QUICK = SearchSettings(coarse=(0.1,), bases=1, finalists=1, fine=())


class Interrupted:
    """A process model that does something else first, the next time that it is asked for a present state."""

    def __init__(self, model: ProcessModel) -> None:
        self._model = model
        self.first: Callable[[], object] = lambda: None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def resume(self, *args: Any) -> None:
        first, self.first = self.first, lambda: None
        first()
        self._model.resume(*args)


def followed() -> tuple[Twin, Interrupted]:
    """A twin that has seen the valve stick, and its model."""
    plant = reactor()
    model = Interrupted(plant.model)
    twin = Twin(model, plant.description, plant.twin, 0)  # type: ignore[arg-type]
    for snapshot in stuck()[:NOW_S]:
        twin.observe(snapshot)
    return twin, model


def later() -> list[Snapshot]:
    """The next seconds, in which somebody has turned the feed down."""
    return [replace(s, values={**s.values, "F1.sp": 0.01}) for s in stuck()[NOW_S:]]


def simulation(twin: Twin) -> TwinSimulation:
    return TwinSimulation(twin, reactor().description.tags_by_name, reactor().description.limits)


def same(one: Rollout, other: Rollout) -> bool:
    signals = one.trajectory.signals, other.trajectory.signals
    return all(np.array_equal(signals[0][tag], signals[1][tag], equal_nan=True) for tag in signals[0])


def test_what_is_observed_during_a_rollout_does_not_reach_it() -> None:
    quiet, _ = followed()
    expected = asyncio.run(simulation(quiet).roll_out(DIAGNOSIS, NOTHING))
    twin, model = followed()
    model.first = lambda: [twin.observe(s) for s in later()]
    assert same(asyncio.run(simulation(twin).roll_out(DIAGNOSIS, NOTHING)), expected)


def test_what_was_learned_meanwhile_does_not_reach_a_rollout_either() -> None:
    quiet, _ = followed()
    expected = asyncio.run(simulation(quiet).roll_out(DIAGNOSIS, NOTHING))
    twin, model = followed()
    model.first = lambda: twin.calibrate(300)
    assert same(asyncio.run(simulation(twin).roll_out(DIAGNOSIS, NOTHING)), expected)
    assert not same(asyncio.run(simulation(twin).roll_out(DIAGNOSIS, NOTHING)), expected), "the next one knows it"


def search(twin: Twin) -> SearchAction:
    plant = reactor()
    d = plant.description
    pricing = Pricing(plant.prices, d.limits, d.scales)
    return SearchAction(twin, d, pricing, QUICK)


def act(subject: SearchAction) -> ActionSet:
    machine = reactor().description.machine
    path = RecoveryPath(machine, tuple(t for t in machine.transitions if t.name == "t_reduce"))
    return asyncio.run(subject.act(now(), path, Advice()))


def test_a_search_that_was_given_up_does_not_disturb_the_next_one() -> None:
    """The first one is left behind while it draws its members, and ends while the second one draws its own."""
    began, go_on = threading.Event(), threading.Event()
    twin, model = followed()
    subject = search(twin)
    model.first = lambda: (began.set(), go_on.wait(120.0))
    left_behind = threading.Thread(target=act, args=(subject,))
    left_behind.start()
    began.wait(120.0)
    for snapshot in later():
        twin.observe(snapshot)

    def meanwhile() -> None:
        go_on.set()
        left_behind.join(120.0)

    model.first = meanwhile
    found = act(subject)
    alone, _ = followed()
    for snapshot in later():
        alone.observe(snapshot)
    assert not left_behind.is_alive() and found == act(search(alone))
