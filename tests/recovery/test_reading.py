"""A source that raises, blocks or has lost its clock: an alarm, no sample, and the guard goes on by its own clock."""

from __future__ import annotations

import itertools
import math
import threading
from decimal import Decimal

import pytest

from homeostat.domain.events.people import AlarmRaised, AlarmReturned
from homeostat.domain.events.trips import Tripped
from homeostat.domain.observation import Observation, Settled, Trouble
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock
from homeostat.process.batch import ProcessError
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import Hook, Loop
from homeostat.recovery.exchange.reading import Reader
from tests.equipment.waiting import waits
from tests.guard.vessel import DRAIN, Vessel, World, running
from tests.recovery.guarded import Scripted, Seconds

PATIENT_S = 30.0
"""How long a source that only raises is waited for: a host with other work may need longer than a tick may wait [s]."""


class Broken:
    """A vessel's samples; from 10 s on ``wrong`` of it raises, for ``times`` questions."""

    def __init__(self, vessel: Vessel, *wrong: str, times: int = 1_000_000, end_s: float = 60.0) -> None:
        self._vessel, self._wrong, self._end_s = vessel, wrong, end_s
        self._left = dict.fromkeys(wrong, times)

    def _may_break(self, what: str) -> None:
        if what in self._wrong and self._vessel.now_s >= 10.0 and self._left[what] > 0:
            self._left[what] -= 1
            raise OSError(f"{what}: cable unplugged")

    def advance(self) -> Snapshot:
        self._may_break("advance")
        return self._vessel.sample()

    @property
    def now_s(self) -> float:
        self._may_break("now_s")
        return self._vessel.now_s

    @property
    def ended(self) -> bool:
        self._may_break("ended")
        return self._vessel.now_s >= self._end_s


def drive(world: World, source: object, hook: Hook = lambda seen: None) -> list[Observation]:
    """The loop with a real guard and no recovery; the source is waited for as long as it takes."""
    exchange = Exchange(DeclaredClock(0.0), world.guard.mailbox.put, lambda reason: None)
    exchange.hold = lambda: None  # type: ignore[method-assign]
    seen: list[Observation] = []

    def shown(observation: Observation) -> None:
        seen.append(observation)
        hook(observation)

    loop = Loop(world.guard, source, exchange, shown)  # type: ignore[arg-type]
    loop._reader = Reader(source, exchange.report, exchange.settle, PATIENT_S)  # type: ignore[arg-type]
    loop.run_virtual()
    return seen


def raised(world: World, name: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == name]


def returned(world: World, name: str) -> int:
    return sum(e.alarm == name for e in world.journal.of(AlarmReturned))


@pytest.mark.parametrize(
    ("what", "alarm", "text"),
    [
        ("advance", "source", "the source gives no sample: advance: cable unplugged"),
        ("now_s", "source:clock", "the source does not say what time it is: now_s: cable unplugged"),
        ("ended", "source:end", "the source does not say whether it has ended: ended: cable unplugged"),
    ],
)
def test_what_a_source_raises_is_told_once_and_is_over_when_it_works_again(what: str, alarm: str, text: str) -> None:
    world = running()
    seen = drive(world, Broken(world.vessel, what, times=3))
    assert raised(world, alarm) == [text] and returned(world, alarm) == 1
    assert world.vessel.now_s == 60.0 and world.guard.latched is None
    times = [o.now_s for o in seen]
    assert all(b > a for a, b in itertools.pairwise(times)) and times[-1] >= 60.0


def test_a_source_that_raises_for_ever_trips_by_blindness_and_the_fallback_is_sent_until_a_person_stops() -> None:
    world = running()
    began_s = world.vessel.now_s

    def stop(seen: Observation) -> None:
        if seen.now_s >= 60.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(world, Broken(world.vessel, "advance", "now_s", "ended"), stop)
    tripped = [at_s for e, at_s in world.journal.events if isinstance(e, Tripped)]
    assert 10.0 < tripped[0] <= 25.0, "stale after 5 s, and the limit's grace time of 6 s"
    assert DRAIN.actions.commands in world.sent and world.guard.latched is not None
    assert {"source", "source:clock", "source:end", "link"} <= world.alarms
    assert [len(raised(world, n)) for n in ("source", "source:clock", "source:end")] == [1, 1, 1]
    assert began_s < 10.0


def test_nobody_ends_an_alarm_of_the_guard_by_saying_that_a_trouble_is_over() -> None:
    world = running()
    world.tick(4, L=14.0)
    assert "latched" in world.alarms
    for message in (Settled("latched"), Trouble("x", "y"), Settled("x"), Settled("x"), Settled("nobody")):
        world.guard.mailbox.put(message)
    world.tick()
    assert "latched" in world.alarms and "recovery:x" not in world.alarms and returned(world, "recovery:x") == 1


class Slow(Seconds):
    """Blocks in ``what`` from 5 s on, ``times`` times, each until it is let go."""

    never_blocks = False

    def __init__(self, what: str, times: int, end_s: float = 12.0) -> None:
        super().__init__(end_s)
        self._what, self._times, self.let_go = what, times, threading.Event()

    def _block(self, what: str) -> None:
        if what == self._what and self._now >= 5.0 and self._times > 0:
            self._times -= 1
            self.let_go.wait(30.0)

    def advance(self) -> Snapshot | None:
        self._block("advance")
        return super().advance()

    @property
    def now_s(self) -> float:
        self._block("now_s")
        return self._now

    @now_s.setter
    def now_s(self, value: float) -> None:
        self._now = value

    @property
    def ended(self) -> bool:
        self._block("ended")
        return super().ended


def reader(source: object) -> tuple[Reader, list[str]]:
    told: list[str] = []

    def over(name: str) -> None:
        told.append(f"{name} is over")

    return Reader(source, lambda name, cause: told.append(cause), over, 0.05), told  # type: ignore[arg-type]


@pytest.mark.parametrize("what", ["advance", "now_s", "ended"])
def test_a_source_that_blocks_holds_no_tick_and_its_late_sample_is_taken(what: str) -> None:
    source = Slow(what, 1)
    subject, told = reader(source)
    times, threads = [], threading.active_count()
    for _ in range(10):
        with waits() as waited:
            assert not subject.ended
            now_s, sample = subject.read(1.0)
        assert waited.vain_s < 1.0
        times.append((now_s, None if sample is None else sample.at_s))
    assert times[:4] == [(float(k), float(k)) for k in range(1, 5)]
    assert times[-1] == (10.0, None) and threading.active_count() <= threads + 1
    assert len(told) == (2 if what == "ended" else 1) and "has not answered for" in told[0]
    source.let_go.set()
    late, fresh = subject.read(1.0), subject.read(1.0)
    assert late[1] is not None and fresh[1] is not None and fresh[1].at_s == late[1].at_s + 1.0
    assert "source is over" in told


@pytest.mark.parametrize("blocks", [False, True])
def test_the_end_of_the_plant_passes_through_every_source(blocks: bool) -> None:
    source = Seconds(10.0, ProcessError("the vessel is gone"), 2.0)
    source.never_blocks = not blocks
    subject, _ = reader(source)
    assert subject.read(1.0)[0] == 1.0
    with pytest.raises(ProcessError):
        subject.read(1.0)


def test_only_where_a_person_may_interrupt_is_an_interrupt_a_persons() -> None:
    source = Seconds(10.0, KeyboardInterrupt(), 2.0)  # type: ignore[arg-type]
    subject, told = reader(source)
    subject.read(1.0)
    with pytest.raises(KeyboardInterrupt):
        subject.read(1.0)
    source = Seconds(10.0, KeyboardInterrupt(), 2.0)  # type: ignore[arg-type]
    source.never_blocks = False
    subject, told = reader(source)
    assert [subject.read(1.0)[0] for _ in range(2)] == [1.0, 2.0]
    assert told == ["the source gives no sample: KeyboardInterrupt"]


def test_a_clock_that_says_nonsense_is_told_to_the_guard_as_it_is() -> None:
    class Odd(Seconds):
        @property
        def now_s(self) -> object:  # type: ignore[override]
            return "noon"

        @now_s.setter
        def now_s(self, value: float) -> None: ...

        def advance(self) -> Snapshot | None:
            return None

    subject, told = reader(Odd(3.0))
    assert subject.read(1.0) == ("noon", None) and told == []


def test_the_loop_of_a_scripted_guard_ticks_on_while_its_source_blocks() -> None:
    guard, source = Scripted(), Slow("advance", 1, end_s=8.0)
    exchange = Exchange(DeclaredClock(0.0), guard.put, lambda reason: None)
    exchange.hold = lambda: None  # type: ignore[method-assign]

    def let_go(seen: Observation) -> None:
        if len(guard.ticks) == 7:
            source.let_go.set()

    Loop(guard, source, exchange, let_go).run_virtual()
    assert guard.ticks[:7] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    causes = [m.cause for _, m in guard.taken if isinstance(m, Trouble)]
    assert len(causes) == 1 and "the source has not answered" in causes[0]
    assert [m for _, m in guard.taken if isinstance(m, Settled)] == [Settled("source")]


class OneDict(Seconds):
    """A link that fills the same dictionary at each tick, with whatever its plant gave it."""

    def __init__(self, *given: object) -> None:
        super().__init__(float(len(given)))
        self._given, self._values = given, dict[str, float]()

    def advance(self) -> Snapshot | None:
        self.now_s += 1.0
        self._values["T"] = self._given[int(self.now_s) - 1]  # type: ignore[assignment]
        return Snapshot(self.now_s, self._values)


@pytest.mark.parametrize("value", [None, "300", 10**400, Decimal(300), object()])
def test_what_is_no_number_is_none_for_whoever_thinks_as_for_the_guard(value: object) -> None:
    """Thinking failed at it three times, and was lost; the guard took it for a reading that is missing."""
    world = World()
    seen = drive(world, OneDict(300.0, value, 301.0))
    assert [o.sample is not None and o.sample.values["T"] for o in seen] == pytest.approx(
        [300.0, math.nan, 301.0], nan_ok=True
    )


def test_what_is_no_sample_at_all_is_left_to_the_guard() -> None:
    world = World()

    class Odd(Seconds):
        def advance(self) -> Snapshot | None:
            super().advance()
            return "nothing of the kind"  # type: ignore[return-value]

    seen = drive(world, Odd(3.0))
    assert [o.sample for o in seen] == [None] * 3 and len(raised(world, "link")) == 1
