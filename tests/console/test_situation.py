"""What was so before a restart, a change of mode, an end or a time is not said of now."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from homeostat.console.outlook import changes_s, outlook
from homeostat.console.overview import Overview, overview
from homeostat.console.situation import Situation, situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import (
    GuardStarted,
    QualityChanged,
    RequestAnswered,
    StartUpBegan,
    StartUpEnded,
    ThinkingEnded,
)
from homeostat.domain.events.people import AlarmRaised, AlarmReturned, ModeEntered, PersonHeard
from homeostat.domain.events.recovery import Compared, FaultsEnded, NoActionTaken, Noticed, SymptomsCleared, Waited
from homeostat.domain.events.trips import FallbackActivated, FallbackStands, Latched, LatchReset, Shed
from homeostat.domain.events.writes import LeaseLost, LeaseTried
from homeostat.domain.mode import Mode, Role, Verb
from homeostat.journal import Event
from homeostat.journal.memory import Entry
from homeostat.plants.plant import load_plant
from tests.guard.test_lapse import lapsing

PLANT = load_plant("cstr").description
NOTICED = Noticed(("S-HOT",))
CHOSEN = Compared("EUR", (), "d")
ADVISED = RequestAnswered("r", "search", "d", "advised")
WAITED = Waited("recovery", 60.0, "reduced load")
ACTED, LATCHED = FallbackActivated("isolate", (), "too hot"), Latched("too hot")
RESET = LatchReset(("Ada",), "it is well", "s")
GONE = ThinkingEnded(7, "killed")
LOST, GIVEN = LeaseLost("the heartbeat is not taken"), LeaseTried(1, True)
SECOND = PersonHeard("c", "Ada", Role.ENGINEER, "mode", "closed-loop", False, "1 of 2 people", missing=1)


def began(mode: str) -> GuardStarted:
    return GuardStarted("cstr", "c", mode, "plant", True)


def entered(mode: str) -> ModeEntered:
    return ModeEntered(mode, "Ada")


def stands(mode: str, *events: Event) -> Situation:
    """Where a run stands after ``events`` that come at 10 s."""
    return situation([Entry(0.0, began(mode)), *(Entry(10.0, event) for event in events)])


def waiting(now: Situation, at_s: float = 20.0, wrong: bool = True) -> str:
    return outlook(now, at_s, (), wrong, PLANT).waiting


def line(now: Situation, at_s: float) -> Overview:
    return overview(now, None, PLANT, at_s)


WATCHED = "nothing: the plant is watched"


@pytest.mark.parametrize(
    ("mode", "events"),
    [
        pytest.param("closed-loop", (NOTICED, CHOSEN, began("closed-loop")), id="decided, and the guard begins again"),
        pytest.param("closed-loop", (NOTICED, CHOSEN, GONE), id="decided, and the process that thinks dies"),
        pytest.param("closed-loop", (NOTICED, CHOSEN, entered("approve")), id="decided, and the mode changes"),
        pytest.param("advise", (NOTICED, ADVISED, began("observe")), id="advised, and the guard begins again"),
        pytest.param("advise", (NOTICED, ADVISED, entered("observe")), id="advised, and the mode changes"),
        pytest.param("closed-loop", (NOTICED, WAITED, began("closed-loop")), id="waits, and the guard begins again"),
        pytest.param("closed-loop", (NOTICED, WAITED, GONE), id="waits, and the process that thinks dies"),
        pytest.param("closed-loop", (NOTICED, WAITED, FaultsEnded((), 9.0)), id="waits, and what was wrong is over"),
        pytest.param("closed-loop", (NOTICED, WAITED, SymptomsCleared((), 9.0)), id="waits, and the symptoms are over"),
        pytest.param("closed-loop", (NOTICED, WAITED, NoActionTaken("s", 0.1)), id="waits, and it is left as it is"),
    ],
)  # fmt: skip
def test_what_was_overtaken_is_not_waited_for(mode: str, events: Sequence[Event]) -> None:
    assert waiting(stands(mode, *events[:-1])) != WATCHED
    assert waiting(stands(mode, *events)) == WATCHED


def test_a_wait_whose_time_has_passed_is_not_waited_for() -> None:
    now = stands("closed-loop", NOTICED, WAITED)
    assert waiting(now, 69.0) == "reduced load at 70 s: waiting costs less than acting now"
    assert "70 s" not in waiting(now, 71.0) and 70.0 in set(changes_s(now, PLANT))


def test_a_second_person_is_not_waited_for_longer_than_the_first_ones_word_counts() -> None:
    now = stands("approve", SECOND)
    assert line(now, 600.0).requested == "closed-loop"
    assert line(now, 611.0).requested == "approve" and 610.0 in set(changes_s(now, PLANT))
    assert line(stands("approve", SECOND, entered("closed-loop")), 700.0).requested == "closed-loop"


SHED = Shed("nothing helps")
SILENT, WILD = (AlarmRaised(name, "it takes none", Priority.HIGH) for name in ("heartbeat", "shed"))
HEARD, TAME = AlarmReturned("heartbeat"), AlarmReturned("shed")


@pytest.mark.parametrize(
    "events",
    [
        pytest.param((LOST, SILENT, began("observe")), id="the guard begins again"),
        pytest.param((LOST, SILENT, entered("observe"), HEARD), id="given back"),
        pytest.param((LOST, SILENT, entered("observe"), HEARD, entered("approve")), id="given back, and taken again"),
        pytest.param((LOST, SILENT, GIVEN), id="given again"),
        pytest.param((SHED, WILD, ACTED, FallbackStands("isolate"), TAME), id="a shed, and then a fallback stands"),
        pytest.param((SHED, WILD, LATCHED, TAME, RESET, entered("observe")), id="a shed, and a reset"),
    ],
)
def test_a_plant_that_takes_commands_again_is_not_said_to_take_none(events: Sequence[Event]) -> None:
    assert stands("closed-loop", *events[:1]).lease_lost
    assert stands("closed-loop", *events).lease_lost == ""


def test_a_plant_that_takes_none_is_said_to_as_long_as_it_lasts() -> None:
    sent = stands("closed-loop", ACTED, LATCHED, LOST, SILENT, entered("observe"))
    assert sent.lease_lost == LOST.reason
    assert situation([Entry(11.0, SHED), Entry(11.0, WILD), Entry(11.0, HEARD)], sent).lease_lost == SHED.reason


def test_what_the_twin_cannot_say_is_not_beside_that_nothing_is_wrong() -> None:
    shown = line(stands("observe", Foreseen("", 10.0, 900.0, 0, note="it diverged")), 20.0)
    assert shown.level == "high" and "not known" in shown.alarm


def test_a_guard_that_begins_again_has_judged_no_reading_yet() -> None:
    bad = QualityChanged("T1", "bad", "it is frozen")
    assert stands("observe", bad).quality == {"T1": ("bad", "it is frozen")}
    assert stands("observe", bad, began("observe")).quality == {}
    assert stands("observe", bad, began("observe"), bad).quality == {"T1": ("bad", "it is frozen")}


def test_a_second_start_up_has_limits_of_its_own_again() -> None:
    began_again = StartUpBegan("heating", 10.0)
    assert stands("observe", StartUpEnded("s")).started_s == 10.0
    now = stands("observe", StartUpEnded("s"), began_again)
    assert (now.started, now.started_s) == (False, None)
    assert stands("observe", StartUpEnded("s"), began_again, StartUpEnded("s")).started


def test_a_guard_that_holds_its_lease_is_shown_to_whatever_came_before() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(2)

    def shown() -> tuple[str, str]:
        now = situation(Entry(at_s, event) for event, at_s in world.journal.events)
        return now.mode, now.lease_lost

    assert shown()[1]
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(2)
    vessel.keeps = False
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick(2)
    assert world.guard.mode is Mode.APPROVE and shown() == ("approve", "")
    vessel.shed()
    world.tick(3)
    assert shown() == ("approve", "")
