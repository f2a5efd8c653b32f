"""The line between the two processes: nobody in the guard waits, and thinking that comes again is told all of it."""

from __future__ import annotations

import math
import random
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median

import pytest

from homeostat.domain.events.guard import ThinkingBegan, ThinkingEnded
from homeostat.domain.events.recovery import Noticed
from homeostat.domain.mode import Mode
from homeostat.domain.observation import FallBack, Message, Observation, Settled, Trouble
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.journal import MemoryTrace
from homeostat.service.thinking import line as lines
from homeostat.service.thinking.away import Away, AwayTrace
from homeostat.service.thinking.codec import Hello, Ready, Told
from homeostat.service.thinking.line import MOST_BYTES, Answering, ThinkingLine
from tests.guard.vessel import MACHINE

HELLO = Hello(b"key", "c")
SEEN = Observation(0.0, None, "running", ActionSet((), "running"), None, None, (), None, Mode.OBSERVE, (), None)


def tick(at_s: float) -> Observation:
    return replace(SEEN, now_s=at_s, snapshot=Snapshot(at_s, {"T": at_s}))


class Guard:
    """The guard's end, and what it was told."""

    def __init__(self, path: Path) -> None:
        self.messages: list[Message] = []
        self.trace = MemoryTrace()
        self.line = ThinkingLine(path, HELLO, Answering(self.messages.append, self.trace, MACHINE))


class Thinker:
    """Thinking's end in a thread, until it is told to go."""

    def __init__(self, path: Path) -> None:
        self.told: list[Told] = []
        self._on = True
        self.away = Away(path, MACHINE, lambda: self._on)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for told in self.away.told():
            self.told.append(told)

    @property
    def times(self) -> list[float]:
        return [told.now_s for told in self.told if isinstance(told, Observation)]

    def go(self) -> None:
        self._on = False
        connection = self.away._connection
        if connection is not None:
            connection.end()


def until(holds: Callable[[], object], within_s: float = 60.0) -> None:
    end = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end, "it did not come to that"
        time.sleep(0.01)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "t.sock"


@pytest.fixture
def guard(path: Path) -> Iterator[Guard]:
    made = Guard(path)
    yield made
    made.line.close()


def test_an_hour_of_two_thousand_noisy_tags_is_kept(guard: Guard, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an hour takes follows from a minute of it: so many ticks in so many bytes."""
    chance, steps = random.Random(1), [0.013 + 0.001 * n for n in range(2000)]
    for at_s in range(60):
        noisy = {f"UNIT-{n:04d}.PV": round(chance.gauss(8000.0, 16.0)) * step for n, step in enumerate(steps)}
        judged = {**noisy, "UNIT-0007.PV": math.nan}
        came, seen = Snapshot(float(at_s), noisy), Snapshot(float(at_s), judged, frozenset({"UNIT-0007.PV"}))
        guard.line.show(replace(SEEN, now_s=float(at_s), sample=came, snapshot=seen))
    until(lambda: len(guard.line._kept) == 60)
    assert guard.line._size / 60 * 3600 <= MOST_BYTES


def test_what_was_judged_and_what_came_arrive_as_they_were(guard: Guard, path: Path) -> None:
    came = Snapshot(1.0, {"A": 0.0, "B": 2.0, "C": math.nan}, frozenset(), taken_s={"B": 0.5})
    judged = Snapshot(1.0, {"A": -0.0, "B": 2.0, "C": math.nan}, frozenset({"C"}), reasons={"C": "no number"})
    guard.line.show(replace(SEEN, now_s=1.0, sample=came, snapshot=judged))
    thinker = Thinker(path)
    until(lambda: thinker.times)
    told = thinker.told[1]
    assert isinstance(told, Observation) and repr(told.snapshot) == repr(judged) and repr(told.sample) == repr(came)


def test_thinking_is_told_what_was_seen_before_it_came_and_answers(guard: Guard, path: Path) -> None:
    for at_s in (1.0, 2.0, 3.0):
        guard.line.show(tick(at_s))
    thinker = Thinker(path)
    until(lambda: thinker.times == [1.0, 2.0, 3.0])
    assert thinker.told[0] == HELLO
    thinker.away.ready()
    thinker.away.send(FallBack("nothing helps"))
    AwayTrace(thinker.away.send).record(Noticed(("SYM",)), 3.0)
    until(lambda: guard.trace.of(Noticed))
    assert FallBack("nothing helps") in guard.messages and Settled("recovery:thinking") in guard.messages
    assert len(guard.trace.of(ThinkingBegan)) == 1
    thinker.go()


def test_thinking_that_is_gone_is_an_alarm_and_the_next_one_is_told_everything(guard: Guard, path: Path) -> None:
    first = Thinker(path)
    first.away.ready()
    until(lambda: guard.trace.of(ThinkingBegan))
    guard.line.show(tick(1.0))
    until(lambda: first.times == [1.0])
    first.away.send(FallBack("x"))
    first.go()
    guard.line.show(tick(2.0))
    until(lambda: any(isinstance(m, Trouble) and m.name == "recovery:thinking" for m in guard.messages))
    assert len(guard.trace.of(ThinkingEnded)) == 1
    second = Thinker(path)
    until(lambda: {1.0, 2.0} <= set(second.times))
    second.go()


def test_what_troubled_thinking_that_is_gone_is_over_when_another_process_thinks(guard: Guard, path: Path) -> None:
    """It said that it is lost: that stood for ever, while plant and recovery were well, and hid the next time."""
    lost, late = Trouble("recovery:lost", "it failed 3 times"), Trouble("recovery:diagnosis", "it took too long")
    first = Thinker(path)
    until(lambda: first.told)
    for said in (Ready(1, ""), late, Settled("recovery:diagnosis"), lost):
        first.away.send(said)
    until(lambda: lost in guard.messages)
    first.away.send(Ready(1, ""))  # the same one comes back: what it said holds
    until(lambda: len(guard.trace.of(ThinkingBegan)) == 2)
    assert Settled("recovery:lost") not in guard.messages
    first.go()
    until(lambda: guard.trace.of(ThinkingEnded))
    second = Thinker(path)
    until(lambda: second.told)
    second.away.send(Ready(2, ""))
    until(lambda: len(guard.trace.of(ThinkingBegan)) == 3)
    assert Settled("recovery:lost") in guard.messages
    assert guard.messages.count(Settled("recovery:diagnosis")) == 1, "that was over before"
    second.go()


def test_thinking_that_reads_nothing_holds_nobody(guard: Guard, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "MOST", 50)
    from multiprocessing.connection import Client

    deaf = Client(str(path), family="AF_UNIX")
    wide = {f"T{k}": float(k) for k in range(500)}
    took: list[float] = []
    for at_s in range(3000):
        begin = time.monotonic()
        guard.line.show(replace(SEEN, now_s=float(at_s), snapshot=Snapshot(float(at_s), wide)))
        took.append(time.monotonic() - begin)
    assert median(took) < 5.0 / 3000
    deaf.close()
    late = Thinker(path)
    until(lambda: late.times and late.times[-1] == 2999.0)
    assert len(late.times) <= 700, "what is kept is bounded"
    late.go()


def test_what_nobody_can_take_is_an_alarm_and_the_line_stays(guard: Guard, path: Path) -> None:
    from multiprocessing.connection import Client

    with Client(str(path), family="AF_UNIX") as rude:
        rude.send_bytes(b"{}")
        rude.send_bytes(b"\xff")
        rude.send_bytes(b'{"message":"FallBack","fields":{"reason":"still here"}}')
        until(lambda: FallBack("still here") in guard.messages)
    troubles = [m for m in guard.messages if isinstance(m, Trouble) and m.name == "recovery:message"]
    assert len(troubles) == 2


def test_thinking_comes_back_to_a_guard_that_has_begun_again(path: Path) -> None:
    first = Guard(path)
    thinker = Thinker(path)
    thinker.away.ready()
    until(lambda: first.trace.of(ThinkingBegan))
    first.line.close()
    second = Guard(path)
    until(lambda: second.trace.of(ThinkingBegan))
    second.line.show(tick(9.0))
    until(lambda: thinker.times == [9.0])
    thinker.go()
    second.line.close()


def test_the_socket_is_for_its_owner_alone(guard: Guard, path: Path) -> None:
    assert path.stat().st_mode & 0o777 == 0o600


def test_alarms_that_thinking_repeats_leave_the_guard_room_for_its_own(guard: Guard, path: Path) -> None:
    thinker = Thinker(path)
    guard.line.show(tick(1.0))
    until(lambda: thinker.times)
    for n in range(10 * lines.MOST_ALARMS):
        thinker.away.send(Trouble("recovery:failed", f"the {n}th time"))
    thinker.away.send(FallBack("nothing passes"))
    until(lambda: any(isinstance(message, FallBack) for message in guard.messages))
    assert sum(isinstance(message, Trouble) for message in guard.messages) == lines.MOST_ALARMS
    guard.line.show(tick(2.0))
    thinker.away.send(Trouble("recovery:failed", "once more"))
    until(lambda: Trouble("recovery:failed", "once more") in guard.messages)
    thinker.go()
