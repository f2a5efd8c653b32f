"""The writer without a guard around it: what it knows of a write, and what it does at each of its ends."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from homeostat.domain.events.writes import Cause, ReadBack, WriteEnded, WriteResult
from homeostat.domain.mode import Side
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.restart.recorder import URGENT_S, Recorder
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing.bounded import BoundedLease
from homeostat.guard.writing.flight import Failed, Progress, Write
from homeostat.guard.writing.writer import Writer
from tests.guard.vessel import WRITABLES, Journal, Vessel

WARM = (Command("T.sp", 305.0, 0.5),)
FEED = (Command("F.sp", 0.02, 0.005),)
RULES = WRITABLES | {"F.sp": replace(WRITABLES["F.sp"], ramped_by=Side.GUARD)}
"""The feed is ramped by the guard."""
LOST = Failed("the plant was not read after the attempt", None, unread=True)
"""What becomes of a write that the link does not take, where nothing is read after it."""


class Noted(Recorder):
    """A recorder that says how long it was asked to wait, and that can be told not to sync."""

    def __init__(self) -> None:
        super().__init__(Journal(), 5.0)
        self.events: list[GuardEvent] = []
        self.waits: list[float] = []
        self.syncs = True

    def note(self, event: GuardEvent, at_s: float) -> None:
        self.events.append(event)
        super().note(event, at_s)

    def commit(self, wait_s: float = math.inf) -> bool:
        self.waits.append(wait_s)
        return self.syncs and super().commit(wait_s)


class Desk:
    """A writer with a wire to a vessel."""

    def __init__(self, attempts: int = 1) -> None:
        self.vessel, self.recorder = Vessel(), Noted()
        self.writer = Writer(RULES, self.recorder, GuardSettings(attempts=attempts, write_s=3.0, sync_s=5.0))
        self.writer.attach(self.vessel)

    def begin(self, commands: tuple[Command, ...], now_s: float, cause: Cause = Cause.REQUEST) -> bool:
        return self.writer.begin(Write(cause, "r1", commands, "running"), now_s)

    def see(self, at_s: float, **accepted: float | None) -> Progress | Failed | None:
        """One tick with a reading."""
        readings = read(at_s, **accepted)
        self.writer.see(readings)
        return self.writer.follow(at_s, readings)

    @property
    def sent(self) -> list[tuple[Command, ...]]:
        return [commands for _, commands in self.vessel.wire]

    @property
    def ends(self) -> list[tuple[WriteResult, str]]:
        return [(e.result, e.detail) for e in self.recorder.events if isinstance(e, WriteEnded)]


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.recorder.close()


def read(at_s: float, **accepted: float | None) -> Snapshot:
    return Snapshot(at_s, {}, accepted={tag.replace("_", "."): target for tag, target in accepted.items()})


def test_what_is_sent_and_what_was_given_up_is_expected_and_nothing_else(desk: Desk) -> None:
    desk.begin(WARM, 1.0)
    desk.writer.overtake(2.0, "a trip")
    desk.begin((Command("T.sp", 300.0, 0.5),), 2.0)
    assert [desk.writer.expects("T.sp", t) for t in (305.0, 300.0, 302.0)] == [True, True, False]
    assert not desk.writer.expects("X.cmd", 1.0)
    assert not desk.writer.expects("Q.sp", 1.0)


def test_a_reading_as_old_as_the_write_shows_nothing_of_it(desk: Desk) -> None:
    desk.begin(WARM, 5.0)
    assert desk.writer.see(read(5.0, T_sp=305.0)) == ()
    desk.writer.overtake(5.0, "a trip")
    desk.begin(WARM, 6.0)  # unread so far: nobody knows what became of the first one
    desk.writer.overtake(6.0, "a trip")
    first, _ = desk.writer.read_given_up(8.0, read(8.0, T_sp=310.0))
    assert first.written == first.missing == ()


def test_what_is_held_of_a_write_that_was_given_up_is_not_said_of_one_under_way(desk: Desk) -> None:
    desk.begin(WARM, 1.0)
    desk.writer.overtake(1.0, "a trip")
    assert desk.writer.see(read(2.0, T_sp=305.0)) == ()
    desk.begin(WARM, 2.0)
    assert desk.writer.see(read(3.0, T_sp=305.0)) == WARM


def test_who_leaves_a_target_that_was_held_is_a_person_also_from_automatic(desk: Desk) -> None:
    desk.begin(WARM, 1.0)
    assert not desk.writer.by_hand("T.sp", None, 307.0)
    desk.writer.see(read(2.0, T_sp=305.0))
    assert desk.writer.by_hand("T.sp", None, 307.0)


def test_a_write_without_a_digest_gets_none(desk: Desk) -> None:
    desk.begin((*WARM, *FEED), 1.0, Cause.SEQUENCE)
    assert desk.writer.without("F.sp")
    assert desk.writer.flying is not None and desk.writer.flying.digest == ""


def test_a_ramp_stands_when_the_wire_is_lost(desk: Desk) -> None:
    desk.see(0.0, F_sp=0.0)
    desk.begin(FEED, 1.0)
    desk.see(2.0, F_sp=0.0)
    desk.see(3.0, F_sp=0.0)
    assert [c[0].value for c in desk.sent] == [0.0, 0.005]
    desk.writer.cut()
    desk.writer.attach(desk.vessel)
    desk.see(4.0, F_sp=0.005)
    assert len(desk.sent) == 2


def test_a_new_wire_gets_the_next_attempt_at_once() -> None:
    desk = Desk(attempts=2)
    desk.begin(WARM, 1.0)
    desk.writer.cut()
    desk.writer.attach(desk.vessel)
    desk.writer.repeat(2.0)
    assert desk.sent == [WARM, WARM]
    desk.writer.repeat(3.0)
    assert desk.sent == [WARM, WARM]


def test_what_may_come_late_comes_to_its_own_tag() -> None:
    desk = Desk()
    desk.begin((Command("V.man", 0.02, None), *FEED), 1.0)
    desk.writer.overtake(2.0, "a trip")
    assert not desk.writer.late("T.sp", 0.02)
    assert desk.writer.late("F.sp", 0.02) and not desk.writer.late("F.sp", 0.02)
    desk.writer.forget()
    assert not desk.writer.late("V.man", 0.02)


def test_only_a_target_on_its_ramp_was_brought_there_by_the_ramp(desk: Desk) -> None:
    desk.see(0.0, F_sp=0.0)
    desk.begin((*WARM, *FEED), 1.0)
    desk.see(2.0, F_sp=0.0)
    assert desk.writer.ramped(read(2.0, F_sp=0.0, T_sp=310.0, X_cmd=1.0)) == (Command("F.sp", 0.0, None),)
    assert desk.writer.ramped(read(2.0, F_sp=0.04)) == ()


@pytest.mark.parametrize("end", ["confirmed", "read", "failed"])
def test_where_all_is_read_no_ramp_leads_anywhere_any_more(desk: Desk, end: str) -> None:
    desk.see(0.0, F_sp=0.0)
    desk.begin(FEED, 1.0)
    desk.see(2.0, F_sp=0.0)
    assert desk.writer.ramped(read(2.0, F_sp=0.0)) != ()
    if end == "confirmed":
        assert desk.see(3.0, F_sp=0.02) is Progress.CONFIRMED
    elif end == "failed":
        assert any(isinstance(desk.see(t, F_sp=0.04), Failed) for t in (3.0, 4.0, 5.0, 6.0))
    else:
        desk.writer.overtake(3.0, "a trip")
        assert desk.writer.ramped(read(3.0, F_sp=0.0)) != (), "its last step may be on the wire yet"
        desk.writer.read_given_up(4.0, read(4.0, F_sp=0.005))
    assert desk.writer.ramped(read(5.0, F_sp=0.0)) == ()


@pytest.mark.parametrize(("now_s", "said"), [(3.0, None), (3.9, None), (4.0, LOST), (9.0, LOST)])
def test_a_failed_attempt_waits_so_long_for_a_reading(desk: Desk, now_s: float, said: Failed | None) -> None:
    desk.vessel.raises = True
    desk.begin(WARM, 1.0)
    assert desk.writer.follow(now_s, None) == said
    assert (desk.writer.flying is None) is (said is not None)


def test_without_a_reading_nothing_is_read_of_what_was_given_up(desk: Desk) -> None:
    desk.begin(WARM, 1.0)
    desk.writer.overtake(2.0, "a trip")
    assert desk.writer.read_given_up(3.0, None) == ()
    desk.begin(FEED, 3.0)
    assert desk.writer.read_given_up(4.0, read(4.0, T_sp=305.0)) == ()


def test_a_ramp_ends_with_the_write_that_has_failed(desk: Desk) -> None:
    desk.see(0.0, F_sp=0.0, T_sp=310.0)
    desk.begin((*WARM, *FEED), 1.0)
    stuck = {"F_sp": 0.0, "T_sp": 310.0}
    said = [desk.see(t, **stuck) for t in (2.0, 3.0, 4.0, 5.0, 6.0)]
    (failed,) = (progress for progress in said if isinstance(progress, Failed))
    assert failed.read is not None
    desk.vessel.wire.clear()
    desk.begin(WARM, 7.0)
    for t in (8.0, 9.0):
        desk.see(t, F_sp=0.005, T_sp=310.0)
    assert desk.sent == [WARM]


@pytest.mark.parametrize(("cause", "wait_s"), [
    (Cause.FALLBACK, URGENT_S), (Cause.REQUEST, math.inf), (Cause.SEQUENCE, math.inf), (Cause.PERSON, math.inf),
])  # fmt: skip
def test_only_a_fallback_does_not_wait_for_its_sync(desk: Desk, cause: Cause, wait_s: float) -> None:
    desk.begin(WARM, 1.0, cause)
    assert desk.recorder.waits == [wait_s]


@pytest.mark.parametrize(("cause", "sent"), [
    (Cause.FALLBACK, 1), (Cause.SEQUENCE, 1), (Cause.REQUEST, 0), (Cause.PERSON, 0),
])  # fmt: skip
def test_without_a_journal_nothing_new_is_sent(desk: Desk, cause: Cause, sent: int) -> None:
    desk.recorder.syncs = False
    assert desk.begin(WARM, 1.0, cause) is bool(sent) and len(desk.sent) == sent
    if not sent:
        text = "the intention could not be journalled"
        assert desk.ends == [(WriteResult.GIVEN_UP, text)]


def test_what_stands_before_the_link_has_answered_was_taken(desk: Desk) -> None:
    desk.vessel.silent = True
    desk.begin(WARM, 1.0)
    assert desk.see(2.0, T_sp=305.0) is Progress.CONFIRMED
    assert desk.ends == [(WriteResult.ACCEPTED, "")]
    assert isinstance(desk.recorder.events[-1], ReadBack)


def test_without_a_lease_it_says_so(desk: Desk) -> None:
    desk.writer.detach()
    assert desk.begin(WARM, 1.0)
    assert desk.ends == [(WriteResult.FAILED, "there is no lease to write with")] and desk.writer.broken


@pytest.mark.parametrize(("cause", "urgent"), [(Cause.FALLBACK, True), (Cause.REQUEST, False)])
def test_a_fallback_goes_past_what_hangs_in_a_link_that_may_block(cause: Cause, urgent: bool) -> None:
    desk = Desk()
    wire = BoundedLease(desk.vessel, GuardSettings(call_s=5.0, lease_s=5.0)).take()
    ways: list[bool] = []
    for way in (wire, wire.urgent):
        send = way.send
        way.send = lambda c, way=way, send=send: (ways.append(way is wire.urgent), send(c))[1]  # type: ignore[method-assign, misc]
    desk.writer.attach(wire)
    desk.begin(WARM, 1.0, cause)
    assert ways == [urgent] and desk.sent == [WARM]


def test_a_tag_that_the_tables_do_not_know_has_no_tolerance_and_no_time(desk: Desk) -> None:
    desk.begin((Command("Q.sp", 1.0, None),), 1.0)
    assert [desk.writer.expects("Q.sp", t) for t in (1.0, 1.1, 1.9)] == [True, False, False]
    desk.vessel.accepted["Q.sp"] = 2.0
    assert isinstance(desk.see(1.5, Q_sp=2.0), Failed)


def test_the_slowest_of_the_tags_says_how_long_the_plant_may_take() -> None:
    desk = Desk()
    slow = {"T.sp": replace(WRITABLES["T.sp"], confirm_s=9.0), "V.man": replace(WRITABLES["V.man"], confirm_s=1.0)}
    desk.writer = Writer(slow, desk.recorder, GuardSettings(attempts=1, sync_s=5.0))
    desk.writer.attach(desk.vessel)
    desk.begin((*WARM, Command("V.man", 0.5, None)), 1.0)
    assert desk.see(9.0, T_sp=310.0, V_man=0.5) is None
    assert isinstance(desk.see(10.0, T_sp=310.0, V_man=0.5), Failed)
