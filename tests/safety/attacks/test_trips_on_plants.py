"""The first fallback command leaves at the tick of the violation, on the shipped reactor, whatever hangs beside.

The coolant valve sticks closed as soon as monitoring has its bearings. When the limit is violated is computed here from
the readings that came, never from what the guard says. Where physics leaves recovery no more time, a fallback acts
before that, and never after it.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from homeostat.agents.roles import Monitoring, Proposer
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.observation import Observation
from homeostat.domain.ports import Clock, GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.guard.settings import GuardSettings
from homeostat.guard.watch.trips import TripWatch
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.links.simulated import SimulatedLink
from homeostat.llm.model import Question, Reply
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Arrangement, Language, Workbench, guard_rules, wire
from tests.equipment.links.misbehaving.link import LostHeartbeat, Misbehaving, Misbehaviour
from tests.equipment.links.misbehaving.readings import (
    ALL,
    Freeze,
    Lie,
    NoReadBack,
    NotANumber,
    Silence,
    StuckClock,
    WrongClock,
)
from tests.equipment.links.misbehaving.writes import HangingWrite

SEED = 3
PATIENT = GuardSettings(sync_s=10.0)
"""Nobody waits for a journal in memory, and a busy host may take its time."""
NOTICED_S, EARLY_S = 900.0, 400.0
"""Onsets: one that monitoring notices within seconds, and one shortly after start-up, when the guard is alone [s]."""
LASTS_S = 200.0
"""From the onset to the end of a run [s]."""
LIMIT_K, ALLOWED_KS = 313.0, 10.0
"""The reactor's temperature limit, and what its table allows of it [K s]."""
SCALE = 300.0
"""Process seconds per wall-clock second where something hangs."""


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("cstr")


@pytest.fixture
def stop() -> Iterator[threading.Event]:
    """Ends whatever hangs when the test is over."""
    event = threading.Event()
    yield event
    event.set()


@dataclass
class Run:
    """One run of the reactor, and what came of it."""

    onset_s: float
    wire: list[tuple[float, tuple[str, ...]]] = field(default_factory=list)
    readings: list[tuple[float, float]] = field(default_factory=list)
    fallbacks: list[float] = field(default_factory=list)
    ticks: int = 0

    def look(self, seen: Observation) -> None:
        self.ticks += 1
        if seen.sample is not None and seen.now_s > self.onset_s:
            self.readings.append((seen.sample.at_s, seen.sample.values["T1"]))

    @property
    def violated_s(self) -> float:
        """The tick at which the readings violate the limit after its cumulative sum."""
        total = 0.0
        for at_s, hot in self.readings:
            total = max(0.0, total + hot - LIMIT_K)
            if total > ALLOWED_KS and hot > LIMIT_K:
                return at_s
        return math.inf


def run(
    plant: Plant, clock: Clock, arrangement: Arrangement | None = None, script: tuple[Misbehaviour, ...] = (),
    trace: Any = None, onset_s: float = NOTICED_S, fault: str = "cool_stuck_closed",
) -> Run:  # fmt: skip
    """The reactor with a fault from ``onset_s`` on [s]; by default its coolant valve sticks."""
    began_s = None if fault == "none" else onset_s
    stuck = scenario(plant, fault, SEED, onset_s=began_s, end_s=onset_s + LASTS_S)
    link, done = Misbehaving(SimulatedLink(open_process(plant, stuck)), script), Run(onset_s)
    settings = PATIENT if trace is None or isinstance(trace, MemoryTrace) else GuardSettings()
    arrangement = replace(arrangement or Arrangement(), guard=settings)
    wire(plant, link, clock, trace or MemoryTrace(), SEED, arrangement).run(link.source, done.look)
    done.wire = [(a.at_s, tuple(c.tag for c in a.commands)) for a in link.wire_log]
    done.fallbacks = [a.at_s for a in link.wire_log if any(c.tag == "XV1.cmd" and c.value == 0.0 for c in a.commands)]
    return done


def hang(stop: threading.Event) -> None:
    """Never let go, and keep no core busy either."""
    while not stop.is_set():
        time.sleep(0.005)


def acts_in_time(done: Run) -> bool:
    """Whether a fallback left at the tick of the violation or before, and supervision went on to the end."""
    return done.fallbacks[0] <= done.violated_s and done.ticks == done.onset_s + LASTS_S


class Outside:
    """Another thing with some of its methods replaced."""

    def __init__(self, inner: object, **replaced: Callable[..., object]) -> None:
        self._inner, self._replaced = inner, replaced

    def __getattr__(self, name: str) -> Any:
        return self._replaced.get(name) or getattr(self._inner, name)


def test_while_thinking_takes_longer_than_physics_leaves(plant: Plant) -> None:
    assert acts_in_time(run(plant, DeclaredClock(150.0)))


@pytest.mark.slow
def test_sixty_seconds_of_thinking_are_no_harm(plant: Plant) -> None:
    done = run(plant, DeclaredClock(60.0))
    assert done.violated_s == math.inf or acts_in_time(done)


def test_while_a_diagnosis_never_yields(plant: Plant, stop: threading.Event) -> None:
    def stuck(monitoring: Monitoring) -> Monitoring:
        return Outside(monitoring, diagnose=lambda deviates=False: hang(stop))  # type: ignore[return-value]

    done = run(plant, ThinkingClock(SCALE), Arrangement(given=stuck))
    assert acts_in_time(done) and done.fallbacks[0] == done.violated_s


def test_while_the_store_hangs(plant: Plant, stop: threading.Event) -> None:
    asked: list[str] = []

    def never(query: str) -> None:
        asked.append(query)
        hang(stop)

    graph: Any = Outside(plant.graph, select=never, ask=never, construct=never)
    done = run(replace(plant, graph=graph), ThinkingClock(SCALE))
    assert asked and acts_in_time(done) and done.fallbacks[0] == done.violated_s


class SilentModel:
    """A language model that never answers."""

    name = "silent"
    settings: dict[str, Any] = {}  # noqa: RUF012

    def __init__(self) -> None:
        self.asked = 0

    async def ask(self, question: Question, within_s: float) -> Reply:
        self.asked += 1
        await asyncio.Event().wait()
        raise AssertionError


def speaking_only(bench: Workbench) -> tuple[Proposer, ...]:
    return (bench.speaking(),)


def test_while_the_model_hangs(plant: Plant) -> None:
    model = SilentModel()
    arrangement = Arrangement(language=Language(model), propose=speaking_only)
    assert acts_in_time(run(plant, ThinkingClock(4.0), arrangement)) and model.asked >= 1


def test_while_a_proposer_never_yields(plant: Plant, stop: threading.Event) -> None:
    async def act(*question: object) -> None:
        hang(stop)

    def stubborn(bench: Workbench) -> tuple[Proposer, ...]:
        searching = bench.searching()
        return (replace(searching, action=Outside(searching.action, act=act)),)  # type: ignore[arg-type]

    assert acts_in_time(run(plant, ThinkingClock(SCALE), Arrangement(propose=stubborn)))


class HangingTrace:
    """A trace in memory that hangs from some time on: when an event is recorded, or when it is synced."""

    def __init__(self, stop: threading.Event, where: str) -> None:
        self.inner, self._stop, self._where, self._hangs = MemoryTrace(), stop, where, False

    def record(self, event: GuardEvent, at_s: float) -> None:
        self._hangs = at_s >= NOTICED_S
        if self._hangs and self._where == "record":
            self._stop.wait()
        self.inner.record(event, at_s)

    def sync(self) -> None:
        if self._hangs:
            self._stop.wait()

    def subscribe(self, subscriber: Any) -> None:
        self.inner.subscribe(subscriber)


@pytest.mark.parametrize("where", [pytest.param("record", marks=pytest.mark.wide), "sync"])
def test_while_the_journal_hangs(plant: Plant, stop: threading.Event, where: str) -> None:
    assert acts_in_time(run(plant, ThinkingClock(SCALE), trace=HangingTrace(stop, where)))


@pytest.mark.parametrize(
    "bad", [NoReadBack(ALL, EARLY_S), HangingWrite(EARLY_S), HangingWrite(EARLY_S, delivered=True)], ids=repr
)
def test_while_a_write_or_its_read_back_hangs(plant: Plant, bad: Misbehaviour) -> None:
    done = run(plant, DeclaredClock(1.0), script=(bad,), onset_s=EARLY_S)
    assert acts_in_time(done) and done.fallbacks[0] == done.violated_s
    known = isinstance(bad, HangingWrite) and bad.delivered
    assert (len(done.fallbacks) == 1) is known, "it is sent until it is read to stand"


def test_while_the_lease_is_lost_without_a_word(plant: Plant) -> None:
    done = run(plant, DeclaredClock(1.0), script=(LostHeartbeat(EARLY_S),), onset_s=EARLY_S)
    assert done.fallbacks[0] == done.violated_s


def test_everything_that_is_sent_was_intended_in_the_same_order(plant: Plant) -> None:
    trace = MemoryTrace()
    done = run(
        plant, DeclaredClock(20.0), script=(HangingWrite(EARLY_S, EARLY_S + 100.0),), trace=trace, onset_s=EARLY_S
    )
    intended = [(e.at_s, e.event) for e in trace.entries if isinstance(e.event, WriteIntended)]
    assert [(at_s, tuple(c.tag for c in e.commands)) for at_s, e in intended] == done.wire
    assert Cause.FALLBACK in {e.cause for _, e in intended}


BLIND_S = 430.0


@pytest.mark.parametrize("bad", [Silence(BLIND_S), Freeze(ALL, BLIND_S), NotANumber(ALL, BLIND_S)], ids=repr)
def test_a_reactor_that_says_nothing_more_is_brought_to_rest(plant: Plant, bad: Misbehaviour) -> None:
    """No permissive can be judged either; the tables say which of them a fallback sets aside."""
    done = run(plant, DeclaredClock(1.0), script=(bad,), onset_s=EARLY_S)
    assert done.fallbacks and BLIND_S < done.fallbacks[0] <= BLIND_S + 60.0


@pytest.mark.parametrize("over_K", [3.0, 5.0, 20.0])
def test_a_step_of_three_kelvin_over_the_limit_trips_within_ten_seconds(plant: Plant, over_K: float) -> None:
    """The reactor stands at 310 K; a step that it cannot make is held for uncertain only for its grace time."""
    script = (Lie("T1", LIMIT_K - 310.0 + over_K, EARLY_S + 50.0),)
    done = run(plant, DeclaredClock(1.0), script=script, onset_s=EARLY_S, fault="none")
    assert EARLY_S + 50.0 <= done.fallbacks[0] <= EARLY_S + 60.0


def test_a_reactor_that_stands_a_little_below_its_limit_never_trips(plant: Plant) -> None:
    """A hundred runs of 300 s at 312.7 K with the noise of the table, 0.5 K."""
    rules, noise = guard_rules(plant), np.random.default_rng(12)
    values = {tag: 0.0 for tag in plant.description.tags_by_name} | {"T1": 312.7, "L1": 10.0}
    for _ in range(100):
        watch = TripWatch(rules, lambda event, at_s: None)
        for at_s, hot in enumerate(312.7 + 0.5 * noise.standard_normal(300), start=1):
            readings = Snapshot(float(at_s), values | {"T1": float(hot)})
            assert watch.judge(float(at_s), readings, "normal") == ()


@pytest.mark.parametrize(
    "bad", [Silence(150.0), NotANumber(ALL, 150.0), StuckClock(150.0), WrongClock(30.0, 150.0)], ids=repr
)
def test_a_batch_plant_that_says_nothing_more_is_closed(bad: Misbehaviour) -> None:
    plant = load_plant("mixing_module")
    link = Misbehaving(SimulatedLink(open_process(plant, scenario(plant, "none", SEED, end_s=200.0))), (bad,))
    assembly = wire(plant, link, DeclaredClock(1.0), MemoryTrace(), SEED, Arrangement(guard=PATIENT))
    assembly.run(link.source)
    first = next(a for a in link.wire_log if a.at_s >= 150.0)
    assert first.at_s <= 165.0 and assembly.guard.latched is not None
    assert all(c.value == 0.0 for c in first.commands if c.tag.startswith(("P", "VI")))
