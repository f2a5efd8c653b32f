"""What every link in virtual time must do. A test class inherits this and says how to open its link."""

from __future__ import annotations

import itertools
import math
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn, TypeAlias

import pytest

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LeaseVoid, LinkError
from tests.equipment.links.virtual import VirtualLink

Open: TypeAlias = Callable[[], VirtualLink]
"""Opens the link under test, with a heartbeat of 5 s and no local setpoints; every call a fresh one."""
MOST_STEPS = 20_000
"""Calls and returns, those of functions in C included, in a call that waits for nothing."""


@dataclass(frozen=True, slots=True)
class Handles:
    """Tags of the plant under test that a test may use."""

    setpoint: str
    """A setpoint."""
    move: float
    """By how much it may be moved, in its unit."""
    rate: float
    """A rate that takes about four seconds for that, per second."""
    manual: str
    """A manual output that is on automatic at the start."""
    reading: str
    """A tag that cannot be commanded."""


def equal(a: float, b: float) -> bool:
    """Equal, NaN to NaN."""
    return a == b or (math.isnan(a) and math.isnan(b))


def read(link: VirtualLink, count: int = 1) -> list[Snapshot]:
    """The next ``count`` samples."""
    found = [link.advance() for _ in range(count)]
    assert all(s is not None for s in found)
    return [s for s in found if s is not None]


class LinkContract:
    """Inherit, and provide the fixtures ``opened`` and ``handles``."""

    def test_samples_come_in_order_with_every_tag(self, opened: Open, handles: Handles) -> None:
        link = opened()
        found = read(link, 20)
        assert [s.at_s for s in found] == [float(t) for t in range(1, 21)] and link.now_s == 20.0
        names = set(found[0].values)
        assert {handles.setpoint, handles.manual, handles.reading} <= names
        assert all(set(s.values) == names for s in found)

    def test_the_run_ends_and_says_so(self, opened: Open) -> None:
        link = opened()
        while not link.ended:
            link.advance()
        assert link.now_s == link.end_s
        with pytest.raises(LinkError, match="is over"):
            link.advance()

    def test_two_runs_are_the_same(self, opened: Open) -> None:
        for a, b in zip(read(opened(), 30), read(opened(), 30), strict=True):
            assert all(equal(v, b.values[tag]) for tag, v in a.values.items()) and a.accepted == b.accepted

    def test_the_source_reads_and_has_nothing_that_writes(self, opened: Open) -> None:
        link = opened()
        source = link.source
        sample = source.advance()
        assert sample is not None and sample.at_s == source.now_s == link.now_s == 1.0
        assert source.end_s == link.end_s and not source.ended
        assert {name for name in dir(source) if not name.startswith("_")} == {
            "advance", "end_s", "ended", "never_blocks", "now_s",
        }  # fmt: skip

    def test_what_says_that_it_never_blocks_waits_for_nothing(self, opened: Open, handles: Handles) -> None:
        """Nobody bounds its calls: each takes computing time only, and little of it."""
        link = opened()
        assert link.never_blocks and link.source.never_blocks
        read(link)  # whatever is compiled or loaded the first time
        commands = (Command(handles.manual, 0.4, None),)
        calls: list[Callable[[], object]] = []
        calls += [link.take, lambda: link.take().send(commands).done, link.beat, link.advance, link.give_back]

        def waiting(*args: object, **rest: object) -> NoReturn:
            raise AssertionError("it waits")

        for call in calls:
            threads, steps = threading.active_count(), itertools.count()
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(time, "sleep", waiting)
                patch.setattr(threading.Condition, "wait", waiting)
                sys.setprofile(lambda frame, event, what, steps=steps: next(steps))
                try:
                    call()
                finally:
                    sys.setprofile(None)
            assert next(steps) < MOST_STEPS
            assert threading.active_count() <= threads

    def test_without_commands_nothing_is_accepted_and_nothing_arrives(self, opened: Open, handles: Handles) -> None:
        link = opened()
        found = read(link, 30)
        assert all(s.accepted == found[0].accepted for s in found) and link.wire_log == ()
        assert found[0].accepted[handles.manual] is None
        assert handles.reading not in found[0].accepted

    def test_a_setpoint_is_accepted_at_once_and_ramped(self, opened: Open, handles: Handles) -> None:
        link = opened()
        start = read(link, 5)[-1].values[handles.setpoint]
        goal = start + handles.move
        ticket = link.take().send((Command(handles.setpoint, goal, handles.rate),))
        assert ticket.done and ticket.error == ""
        found = read(link, 12)
        path = [start, *(s.values[handles.setpoint] for s in found)]
        steps = [(b - a) * math.copysign(1.0, handles.move) for a, b in itertools.pairwise(path)]
        assert all(-1e-9 <= s <= handles.rate * (1.0 + 1e-9) for s in steps), path
        assert path[-1] == goal and path[1] != goal
        assert all(s.accepted[handles.setpoint] == goal for s in found)

    def test_a_manual_output_is_taken_and_handed_back(self, opened: Open, handles: Handles) -> None:
        link = opened()
        read(link, 5)
        wire = link.take()
        wire.send((Command(handles.manual, 0.4, None),))
        held = read(link, 2)[-1]
        assert held.values[handles.manual] == held.accepted[handles.manual] == 0.4
        wire.send((Command(handles.manual, None, None),))
        back = read(link)[-1]
        assert math.isnan(back.values[handles.manual]) and back.accepted[handles.manual] is None

    def test_everything_that_arrives_is_logged_in_order(self, opened: Open, handles: Handles) -> None:
        link = opened()
        wire = link.take()
        first, second = (Command(handles.manual, 0.4, None),), (Command(handles.manual, None, None),)
        read(link, 3)
        wire.send(first)
        wire.send(second)
        read(link, 2)
        wire.send(first)
        assert [(a.at_s, a.commands) for a in link.wire_log] == [(3.0, first), (3.0, second), (5.0, first)]

    @pytest.mark.parametrize("bad", ["reading", "unknown", "automatic setpoint"])
    def test_commands_are_taken_all_or_none(self, opened: Open, handles: Handles, bad: str) -> None:
        refused = {
            "reading": Command(handles.reading, 1.0, None),
            "unknown": Command("no such tag", 1.0, None),
            "automatic setpoint": Command(handles.setpoint, None, None),
        }[bad]
        link = opened()
        before = read(link, 5)[-1]
        ticket = link.take().send((Command(handles.manual, 0.4, None), refused))
        assert ticket.done and repr(refused.tag) in ticket.error
        assert read(link, 3)[-1].accepted == before.accepted
        assert [a.error for a in link.wire_log] == [ticket.error]

    def test_the_wire_of_an_older_lease_is_void(self, opened: Open, handles: Handles) -> None:
        link = opened()
        old, new = link.take(), link.take()
        with pytest.raises(LeaseVoid, match="take a new one"):
            old.send((Command(handles.manual, 0.4, None),))
        assert link.wire_log == () and read(link)[0].accepted[handles.manual] is None
        new.send((Command(handles.manual, 0.4, None),))
        assert read(link)[0].accepted[handles.manual] == 0.4

    def test_a_missing_heartbeat_sheds_to_local_control(self, opened: Open, handles: Handles) -> None:
        link = opened()
        wire = link.take()
        start = read(link)[0].values[handles.setpoint]
        goal = start + handles.move
        wire.send((Command(handles.manual, 0.4, None), Command(handles.setpoint, goal, handles.rate)))
        for _ in range(20):
            link.beat()
            assert read(link)[0].accepted[handles.manual] == 0.4
        silent = read(link, 5)
        assert [s.accepted[handles.manual] for s in silent] == [0.4] * 4 + [None] and link.shed
        assert silent[-1].accepted[handles.setpoint] == goal, "a setpoint without a local one stays"
        assert len(link.wire_log) == 1, "what local control does is not on the guard's wire"
        with pytest.raises(LeaseVoid):
            wire.send((Command(handles.manual, 0.4, None),))
        with pytest.raises(LeaseVoid, match="own control has taken over"):
            link.beat()

    def test_who_never_beats_is_not_waited_for(self, opened: Open, handles: Handles) -> None:
        link = opened()
        wire = link.take()
        wire.send((Command(handles.manual, 0.4, None),))
        assert read(link, 30)[-1].accepted[handles.manual] == 0.4 and not link.shed

    def test_a_lease_that_is_given_back_sheds_at_once(self, opened: Open, handles: Handles) -> None:
        link = opened()
        wire = link.take()
        wire.send((Command(handles.manual, 0.4, None),))
        read(link, 2)
        link.give_back()
        assert link.shed and read(link)[0].accepted[handles.manual] is None
        with pytest.raises(LeaseVoid):
            wire.send(())

    def test_without_a_lease_giving_back_and_beating_change_nothing(self, opened: Open) -> None:
        link = opened()
        link.beat()
        link.give_back()
        found = read(link, 20)
        assert not link.shed and all(s.accepted == found[0].accepted for s in found)

    def test_a_new_lease_ends_local_control(self, opened: Open, handles: Handles) -> None:
        link = opened()
        link.take()
        link.give_back()
        wire = link.take()
        assert not link.shed
        wire.send((Command(handles.manual, 0.4, None),))
        assert read(link, 10)[-1].accepted[handles.manual] == 0.4, "the old heartbeat is forgotten"

    def test_somebody_at_the_plant_is_seen_and_not_on_the_wire(self, opened: Open, handles: Handles) -> None:
        link = opened()
        goal = read(link)[0].values[handles.setpoint] + handles.move
        link.operate(handles.setpoint, goal, handles.rate)
        found = read(link, 12)
        assert found[0].accepted[handles.setpoint] == goal != found[0].values[handles.setpoint]
        assert found[-1].values[handles.setpoint] == goal and link.wire_log == ()
        with pytest.raises(ValueError, match=repr(handles.reading)):
            link.operate(handles.reading, 1.0)
