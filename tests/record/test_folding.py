"""A story says nothing twice, means something to a person, and never runs back in time."""

from __future__ import annotations

import math

from homeostat.agents.checks import repetition_finding
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed, GaveUp, ReleasedActions
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding
from homeostat.journal import Event
from homeostat.record.story.story import Story
from tests.plants.cstr.reactor import plant

PLANT = plant()
HOT = Finding("LIM-T-HIGH", Owner.ACTION, -1.5, "K", 0.0, 0, "too hot")
STUCK = Diagnosed((), (Hypothesis((FaultState("cool_stuck_closed", 0.3, 2000.0),), 1.0),))


def attempted(number: int, finding: Finding, digest: str = "d1") -> Attempted:
    path, command = ("normal", "holding"), Command("F1.sp", 0.02, None)
    return Attempted(number, "search", path, (command,), digest, finding.satisfied, (finding,), 4)


def told(*events: tuple[Event, float]) -> list[str]:
    story = Story(PLANT)
    return [str(line) for event, at_s in events for line in story.tell(event, at_s)]


def test_a_refusal_without_a_margin_is_told_in_its_own_words() -> None:
    story = Story(PLANT)
    blind = Finding("LIM-T-HIGH", Owner.ACTION, -math.inf, "K", 0.0, 0, "'T1 <= 313' cannot be judged")
    (line,) = story.tell(attempted(1, blind), 10.0)
    assert line.text.endswith("; refused because 'T1 <= 313' cannot be judged (LIM-T-HIGH)") and "inf" not in line.text


def test_attempts_that_repeat_others_are_counted_before_what_comes_next() -> None:
    again = repetition_finding(1)
    events: list[tuple[Event, float]] = [(attempted(1, HOT), 10.0)]
    events += [(attempted(number, again), 10.0) for number in range(2, 10)]
    events += [(attempted(1, HOT), 40.0), (attempted(2, again), 40.0), (GaveUp("search", "no path is open"), 41.0)]
    first, counted, last = told(*events)
    assert first.endswith("refused because worst margin -1.5 K (LIM-T-HIGH)")
    assert counted == (
        "     40 s  proposed  10 more: 9 repeated one that was judged already (CHK-REPEATED), 1 refused as before"
    )
    assert last == "     41 s  gave up   no path is open"


def test_what_says_something_else_is_told() -> None:
    other = attempted(1, HOT, "d2")
    lines = told((attempted(1, HOT), 10.0), (other, 40.0), (attempted(2, Finding("A", *FINE)), 41.0))
    assert len(lines) == 3 and "approved" in lines[-1]


FINE = (Owner.ACTION, 1.0, "K", 0.0, 0, "fine")


def test_after_a_release_everything_is_told_again() -> None:
    released = ReleasedActions("search", (), "d9", "holding", 1.0)
    lines = told((attempted(1, HOT), 10.0), (released, 11.0), (attempted(1, HOT), 40.0))
    assert [line.split()[2] for line in lines] == ["proposed", "released", "proposed"]


def test_a_review_that_believes_the_same_is_told_once() -> None:
    lines = told((STUCK, 10.0), (STUCK, 40.0), (STUCK, 70.0), (StateEntered("normal"), 80.0))
    assert [line.split()[2] for line in lines] == ["diagnosed", "review", "state"]


def test_what_becomes_known_later_stands_there_with_the_time_at_which_it_was() -> None:
    lines = told((STUCK, 100.0), (StateEntered("normal"), 188.0), (STUCK, 187.0), (StateEntered("holding"), 189.0))
    assert [line.split()[0] for line in lines] == ["100", "188", "188", "189"]
    assert lines[2].endswith(" (at 187 s)")
