"""A journal that fails, hangs or is slow: an alarm, no new release, and nothing that keeps a fallback from acting."""

from __future__ import annotations

import threading
import time

import pytest

from homeostat.domain.events.guard import Stopped
from homeostat.domain.events.people import AlarmReturned
from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.ports import GuardEvent, Kept
from homeostat.guard.restart import recorder as module
from homeostat.guard.restart.recorder import Recorder
from homeostat.guard.settings import GuardSettings
from tests.equipment.waiting import waits
from tests.guard.vessel import ADJUSTED, DRAIN, Journal, World, finding, running, statuses

IMPATIENT = GuardSettings(sync_s=0.05)
FULL = OSError(28, "No space left on device")


class Hanging(Journal):
    """A record that answers nothing until it is released."""

    def __init__(self) -> None:
        super().__init__()
        self.gate = threading.Event()
        self.gate.set()

    def record(self, event: GuardEvent, at_s: float) -> None:
        self.gate.wait()
        super().record(event, at_s)

    def sync(self) -> None:
        self.gate.wait()
        super().sync()


def events(n: int) -> list[Stopped]:
    return [Stopped(str(k)) for k in range(n)]


def test_events_are_appended_in_order_and_committed() -> None:
    journal = Journal()
    recorder = Recorder(journal, 5.0)
    for event in events(100):
        recorder.note(event, 1.0)
    assert recorder.commit() and journal.syncs == 1
    assert [e for e, _ in journal.events] == events(100) and recorder.trouble == ""
    recorder.close()
    assert not recorder._thread.is_alive()


def test_settling_waits_for_what_was_noted() -> None:
    journal = Journal()
    recorder = Recorder(journal, 5.0)
    recorder.settle()
    recorder.note(Stopped("a"), 1.0)
    recorder.settle()
    assert journal.kinds == ["stopped"] and journal.syncs == 0


def test_what_finds_a_full_disk_is_kept_and_nothing_is_committed_before_it_is_written() -> None:
    journal = Journal(error=FULL)
    recorder = Recorder(journal, 5.0)
    for event in events(3):
        recorder.note(event, 1.0)
    assert not recorder.commit() and "No space left" in recorder.trouble
    journal.error = None
    recorder.note(Stopped("3"), 1.0)
    assert recorder.commit() and recorder.trouble == "" and recorder.lost == 0
    assert [e for e, _ in journal.events] == events(4)


def test_an_event_that_the_record_cannot_take_is_lost_and_counted_and_not_committed() -> None:
    class Picky(Journal):
        def record(self, event: GuardEvent, at_s: float) -> None:
            if event == Stopped("1"):
                raise TypeError("cannot be written")
            super().record(event, at_s)

    journal = Picky()
    recorder = Recorder(journal, 5.0)
    for event in events(2):
        recorder.note(event, 1.0)
    recorder.settle()
    assert recorder.trouble == "the journal failed: cannot be written" and recorder.lost == 1
    recorder.note(Stopped("2"), 1.0)
    assert recorder.commit() and [e for e, _ in journal.events] == [Stopped("0"), Stopped("2")]


def test_a_record_that_hangs_is_waited_for_once() -> None:
    journal = Hanging()
    recorder = Recorder(journal, 0.05)
    journal.gate.clear()
    with waits() as waited:
        recorder.note(Stopped("a"), 1.0)
        assert not recorder.commit()
        assert recorder.trouble == "the journal does not answer within 0.05 s"
        for _ in range(200):
            recorder.note(Stopped("b"), 1.0)
            assert not recorder.commit()
            recorder.settle()
    journal.gate.set()
    recorder._wait_s = 5.0
    recorder._late.done.wait(5.0)  # type: ignore[union-attr]
    assert recorder.commit() and recorder.trouble == "" and len(journal.events) == 201
    assert waited.limits_s == [0.05]  # not once per event


def test_a_backlog_has_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BACKLOG", 10)
    journal = Hanging()
    recorder = Recorder(journal, 0.01)
    journal.gate.clear()
    for event in events(30):
        recorder.note(event, 1.0)
    assert 15 <= recorder.lost <= 20
    assert not recorder.commit()
    recorder.close()
    journal.gate.set()
    journal = Hanging()
    journal.error = FULL
    recorder = Recorder(journal, 5.0)
    for event in events(12):
        recorder.note(event, 1.0)
        recorder.settle()
    assert recorder.lost == 2
    journal.error = None
    assert recorder.commit() and [e for e, _ in journal.events] == events(10)


def test_the_end_of_the_process_holds_up_nobody() -> None:
    class Ends(Journal):
        def record(self, event: GuardEvent, at_s: float) -> None:
            raise SystemExit

    recorder = Recorder(Ends(), 5.0)
    for event in events(5):
        recorder.note(event, 1.0)
    assert not recorder.commit() and recorder.trouble == "the journal has ended: SystemExit"
    recorder._thread.join(5.0)
    assert not recorder.commit()


def test_a_record_that_fails_without_a_word_is_named_by_its_error() -> None:
    recorder = Recorder(Journal(error=OSError()), 5.0)
    recorder.note(Stopped("a"), 1.0)
    assert not recorder.commit() and recorder.trouble == "the journal failed: OSError"
    recorder.close()


def test_after_the_end_nobody_waits() -> None:
    """Neither once the recorder was closed nor once its thread has ended, whatever was handed over before or after."""

    class Ends(Hanging):
        def record(self, event: GuardEvent, at_s: float) -> None:
            self.gate.wait()
            raise SystemExit

    recorder = Recorder(Journal(), 5.0)
    recorder.close()
    assert recorder.trouble == ""
    with waits() as waited:
        recorder.note(Stopped("late"), 1.0)
        recorder.settle()
        assert not recorder.commit() and recorder.trouble == ""
    assert waited.limits_s == []
    journal = Ends()
    journal.gate.clear()
    recorder = Recorder(journal, 5.0)
    recorder.note(Stopped("a"), 1.0)
    recorder.note(Stopped("b"), 1.0)
    threading.Timer(0.1, journal.gate.set).start()
    with waits() as waited:
        assert not recorder.commit()  # waits when the thread ends
        recorder.note(Stopped("c"), 1.0)
        recorder.settle()
        assert not recorder.commit() and recorder.trouble == "the journal has ended: SystemExit"
    assert len(waited.limits_s) == 1 and waited.vain_s == 0.0


def test_ten_thousand_events_wait_and_no_more() -> None:
    class Entered(Hanging):
        def __init__(self) -> None:
            super().__init__()
            self.gate.clear()
            self.entered = threading.Event()

        def record(self, event: GuardEvent, at_s: float) -> None:
            self.entered.set()
            super().record(event, at_s)

    journal = Entered()
    recorder = Recorder(journal, 5.0)
    recorder.note(Stopped("in hand"), 1.0)
    assert journal.entered.wait(5.0)
    for event in events(10_000):
        recorder.note(event, 1.0)
    assert recorder.lost == 0
    recorder.note(Stopped("too many"), 1.0)
    assert recorder.lost == 1
    with waits() as waited:
        assert not recorder.commit() and recorder.lost == 2  # there is no room, and nothing to wait for
    assert waited.limits_s == []
    journal.gate.set()


def test_a_recorder_keeps_no_process_alive() -> None:
    before = set(threading.enumerate())
    recorder = Recorder(Journal(), 5.0)
    started = set(threading.enumerate()) - before
    assert started and all(thread.daemon for thread in started)
    recorder.close()


def test_closing_waits_ten_times_as_long_as_anything_else() -> None:
    journal = Hanging()
    journal.gate.clear()
    recorder = Recorder(journal, 0.03)
    recorder.note(Stopped("a"), 1.0)
    with waits() as waited:
        recorder.close()
    journal.gate.set()
    assert waited.limits_s == [pytest.approx(0.3)] and waited.vain_s == pytest.approx(0.3)


def test_a_fallback_waits_a_tenth_of_a_second_for_its_sync_however_patient_the_guard_is() -> None:
    journal = Hanging()
    world = running(record=journal, settings=GuardSettings(sync_s=5.0))
    journal.gate.clear()
    with waits() as waited:
        world.tick(1, L=14.0)
    journal.gate.set()
    assert world.sent == [DRAIN.actions.commands] and waited.vain_s == pytest.approx(0.1)


def test_while_the_journal_fails_nothing_new_is_released_and_the_sequence_goes_on() -> None:
    world = World()
    world.tick(1, L=4.0)
    world.journal.error = FULL
    world.tick(2, L=8.0)
    assert world.seen[-1].state == "running" and "journal" in world.alarms
    world.vessel.wire.clear()
    world.ask()
    world.tick(2)
    assert world.sent == [] and finding(world) == "CHK-JOURNAL"
    world.journal.error = None
    world.tick()
    world.ask(name="r2")
    world.tick(2)
    assert world.sent == [ADJUSTED.commands] and "journal" not in world.alarms
    assert [e.source for e in world.journal.of(WriteIntended)] == ["start", "r2"]


def test_a_request_whose_own_intention_finds_the_disk_full_is_not_sent() -> None:
    world = running()
    record = world.journal.record

    def full(event: GuardEvent, at_s: float) -> None:
        if isinstance(event, WriteIntended):
            raise FULL
        record(event, at_s)

    world.journal.record = full  # type: ignore[method-assign]
    world.ask()
    world.tick()
    assert world.sent == [] and statuses(world)[-1] == "failed" and finding(world) == "CHK-JOURNAL"


@pytest.mark.parametrize("how", ["fails", "hangs", "odd"])
def test_a_fallback_acts_whatever_the_journal_does(how: str) -> None:
    journal = Hanging()
    world = running(record=journal, settings=IMPATIENT)
    if how == "hangs":
        journal.gate.clear()
    else:
        journal.error = FULL if how == "fails" else RuntimeError("a reader has failed")
    before = len(world.seen)
    world.tick(1, L=14.0)
    assert world.sent == [DRAIN.actions.commands] and "journal" in world.alarms
    assert world.seen[before].latched is not None
    world.tick(2)
    journal.error = None
    journal.gate.set()
    if world.guard._parts.recorder._late is not None:
        world.guard._parts.recorder._late.done.wait(5.0)
    world.guard._parts.recorder._wait_s = 5.0
    world.tick(2)
    assert "journal" not in world.alarms
    assert len(journal.of(FallbackStands)) == (0 if how == "odd" else 1)
    assert any(e.alarm == "journal" for e in journal.of(AlarmReturned))


def test_a_fallback_waits_for_its_sync_no_longer_than_it_may_though_much_is_noted_before_it() -> None:
    class Slow(Journal):
        slow = False

        def record(self, event: GuardEvent, at_s: float) -> None:
            if self.slow:
                time.sleep(0.04)
            super().record(event, at_s)

    journal = Slow()
    world = running(record=journal, settings=GuardSettings(sync_s=0.1))
    for k in range(30):
        world.ask(name=f"r{k}", state="waiting" if k else "running")
    waited_s: list[float] = []
    send = world.vessel.send
    journal.slow = True
    with waits() as waited:
        world.vessel.send = lambda commands: (waited_s.append(sum(waited.limits_s)), send(commands))[1]  # type: ignore[method-assign]
        world.tick(1, L=14.0)
    assert world.sent[0] == DRAIN.actions.commands
    assert waited_s[0] < 5 * 0.1  # thirty answers of 0.04 s each would be 1.2 s


def test_a_stop_is_the_last_that_is_journalled() -> None:
    world = running()
    world.guard.stop("done")
    world.guard.stop("once more")
    assert world.journal.kinds[-1] == "stopped" and world.journal.kinds.count("stopped") == 1
    seen = world.guard.tick(100.0, None)
    assert seen.latched is None and world.sent == []


def test_what_the_record_keeps_by_itself_is_not_recorded_again() -> None:
    class Keeping(Journal):
        room = False

        def record(self, event: GuardEvent, at_s: float) -> None:
            super().record(event, at_s)
            self.sync()

        def sync(self) -> None:
            if not self.room:
                raise Kept("no room")

    journal = Keeping()
    recorder = Recorder(journal, 5.0)
    for event in events(2):
        recorder.note(event, 1.0)
    recorder.settle()
    assert recorder.trouble == "the journal failed: no room" and not recorder.commit()
    journal.room = True
    recorder.settle()
    assert (recorder.trouble, recorder.lost) == ("", 0)
    assert [event for event, _ in journal.events] == events(2)
