"""Service: whose a tag is, what the plant was read to hold, and what of that is said."""

from __future__ import annotations

from typing import Any

import pytest

from homeostat.domain.events.people import ServiceChanged
from homeostat.domain.events.writes import TargetsHeld
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.sequence.service import Moved, Service
from tests.guard.test_hands import dies
from tests.guard.vessel import WRITABLES, Vessel, World, finding, running, statuses


def nobody(tag: str, before: float | None, target: float | None) -> bool:
    return False


def service() -> tuple[Service, list[tuple[Any, float]]]:
    noted: list[tuple[Any, float]] = []
    return Service(WRITABLES, lambda event, at_s: noted.append((event, at_s))), noted


def told(**accepted: float | None) -> Snapshot:
    return Snapshot(1.0, {}, accepted={tag.replace("_", "."): value for tag, value in accepted.items()})


def test_what_changes_nothing_is_not_said() -> None:
    own, noted = service()
    assert not own.change("T.sp", True, "Ada", "again", 1.0) and not own.change("T", False, "Ada", "no target", 1.0)
    assert own.change("T.sp", False, "Ada", "repair", 2.0) and not own.change("T.sp", False, "Bo", "repair", 3.0)
    assert noted == [(ServiceChanged("T.sp", False, "Ada", "repair"), 2.0)]
    assert own.out == {"T.sp"} and own.tags == WRITABLES.keys() - {"T.sp"}
    assert own.change("T.sp", True, "Ada", "done", 4.0) and own.out == frozenset()


def test_a_journal_of_another_configuration_takes_nothing_out_that_may_not_be_written() -> None:
    own, _ = service()
    own.restore(frozenset({"T.sp", "gone"}))
    assert own.out == {"T.sp"}


def test_what_a_journal_says_is_expected_and_not_said_again() -> None:
    own, _ = service()
    own.restore_targets({"T.sp": 310.0, "V.man": None})
    assert own.news() == {} and own.target("T.sp") == 310.0 and own.target("V.man") is None
    assert own.moved(told(T_sp=305.0, V_man=None), nobody) == (Moved("T.sp", 310.0, 305.0),)
    assert own.news() == {"T.sp": 305.0} and own.news() == {}


def test_a_target_that_was_seen_first_was_moved_by_nobody() -> None:
    own, _ = service()
    assert own.moved(told(T_sp=305.0), nobody) == () and own.news() == {"T.sp": 305.0}


@pytest.mark.parametrize(("target", "moved"), [(310.05, False), (309.95, False), (310.06, True), (309.94, True)])
def test_what_is_within_the_tolerance_of_the_tables_is_the_same(target: float, moved: bool) -> None:
    own, _ = service()
    own.expect((Command("T.sp", 310.0, 0.5),))
    assert bool(own.moved(told(T_sp=target), nobody)) is moved
    assert own.target("T.sp") == (target if moved else 310.0)


def test_what_was_written_is_asked_about_with_where_it_came_from_and_where_it_went() -> None:
    own, _ = service()
    own.expect((Command("T.sp", 310.0, 0.5),))
    asked: list[Any] = []

    def pending(*question: Any) -> bool:
        asked.append(question)
        return True

    assert own.moved(told(T_sp=305.0), pending) == () and asked == [("T.sp", 310.0, 305.0)]


def test_what_became_of_a_write_is_no_stranger_s_doing_and_what_the_plant_does_not_tell_is_as_before() -> None:
    own, _ = service()
    own.expect((Command("T.sp", 310.0, 0.5), Command("F.sp", 0.02, 0.005)))
    commands = (Command("T.sp", 300.0, 0.5), Command("F.sp", 0.0, 0.005))
    own.adopt(commands, None)
    own.adopt(commands, told(T_sp=303.0))
    assert own.target("T.sp") == 303.0 and own.target("F.sp") == 0.02
    assert own.news() == {"T.sp": 303.0}, "nothing was journalled of it"


def test_where_a_ramp_was_given_up_is_news() -> None:
    own, _ = service()
    ramped = (Command("T.sp", 307.5, None),)
    own.expect(ramped)
    own.adopt((Command("T.sp", 300.0, 0.5),), told(T_sp=307.5))
    assert own.news() == {"T.sp": 307.5} and own.news() == {}


class Mute(Vessel):
    """A plant that does not tell one of its targets."""

    def sample(self) -> Snapshot:
        full = super().sample()
        return Snapshot(full.at_s, full.values, accepted={t: v for t, v in full.accepted.items() if t != "T.sp"})


def test_a_target_that_the_plant_does_not_tell_breaks_nothing_and_confirms_nothing() -> None:
    world = running(vessel=Mute())
    world.ask()
    world.tick(12)
    assert statuses(world)[-1] == "failed" and finding(world) == "CHK-OBEYED"
    assert not [name for name in world.alarms if name.startswith("guard:")] and world.guard.out_of_service == set()


def test_a_restart_says_no_target_again_that_the_journal_knows() -> None:
    world: World = dies(running(), {})
    world.tick(5)
    assert world.journal.of(TargetsHeld) == []


@pytest.mark.parametrize(("target", "changed"), [(310.05, False), (310.06, True)])
def test_what_has_changed_since_the_last_reading_is_told_within_the_tolerance(target: float, changed: bool) -> None:
    own, _ = service()
    own.restore_targets({"T.sp": 310.0, "F.sp": 0.03, "gone": 1.0})
    assert own.changed(told(T_sp=target)) == ((Moved("T.sp", 310.0, target),) if changed else ())
    assert own.changed(told(T_sp=310.0, gone=1.0)) == ()
    assert own.changed(told(gone=1.1)) == (Moved("gone", 1.0, 1.1),), "of what may not be written nothing is known"
