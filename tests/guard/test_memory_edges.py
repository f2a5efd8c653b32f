"""What a memory keeps and lets go at its edges: the time to act, steps that are owed, modes in which nobody writes."""

from __future__ import annotations

import pytest

from homeostat.domain.events.guard import Armed, RequestAnswered, SequenceLoaded, StepTaken
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.trips import Latched
from homeostat.domain.events.writes import Cause, ReadBack
from homeostat.guard.writing.flight import PUT_RIGHT
from tests.guard.test_memory import GIVEN_UP, REQUEST, STEPS, TAGS, intended, remembered, step

ARMED = Armed(("drain",), 60.0)
LOADED = SequenceLoaded("r1", "running", STEPS, False)
TAKEN = StepTaken("empty", "emptying")
OWED = (step(2), TAKEN, ReadBack(2, (), TAGS))
"""A step that counts as taken, and that the plant was read not to hold."""
OBSERVE = ModeEntered("observe", "Ada")


def test_only_a_release_that_the_plant_holds_ends_the_time_to_act() -> None:
    assert remembered(ARMED, REQUEST).act_by_s == 60.0
    assert remembered(ARMED, REQUEST, ReadBack(3, TAGS)).act_by_s is None
    assert remembered(ARMED, REQUEST, GIVEN_UP, ReadBack(3, TAGS)).act_by_s == 60.0
    assert remembered(ARMED, step(3), ReadBack(3, TAGS)).act_by_s == 60.0


@pytest.mark.parametrize("status", ["authorised", "verified", "accepted", "confirmed", "failed", "withdrawn"])
def test_of_the_answers_to_a_request_only_its_confirmation_ends_the_time_to_act(status: str) -> None:
    left = remembered(ARMED, RequestAnswered("r1", "search", "", status)).act_by_s
    assert left == (None if status == "confirmed" else 60.0)


def test_what_is_owed_is_paid_by_its_own_step_and_waits_for_what_is_put_right() -> None:
    assert remembered(*OWED, step(3)).open[3].taken
    assert not remembered(*OWED, step(3, "start")).open[3].taken
    assert not remembered(*OWED, intended(3, Cause.REQUEST, "empty")).open[3].taken
    assert remembered(*OWED, intended(3, Cause.FALLBACK, PUT_RIGHT)).owed is not None
    assert remembered(*OWED, intended(3, Cause.FALLBACK, "drain")).owed is None


def test_where_nobody_writes_no_step_is_owed_any_more() -> None:
    assert remembered(*OWED, OBSERVE).owed is None
    assert remembered(*OWED, ModeEntered("approve", "Ada")).owed is not None
    assert remembered(Latched("hot"), *OWED, OBSERVE).owed is not None, "a fallback's steps are sent in every mode"


def test_where_nobody_writes_a_step_under_way_is_given_up_and_nothing_else_is() -> None:
    assert remembered(step(2), TAKEN, OBSERVE).open[2].given_up
    assert remembered(step(2), TAKEN, OBSERVE, TAKEN).open[2].given_up, "whatever is said of it later"
    assert not remembered(step(2), TAKEN, ModeEntered("approve", "Ada")).open[2].given_up
    assert not remembered(Latched("hot"), step(2), TAKEN, OBSERVE).open[2].given_up
    assert not remembered(step(2), OBSERVE).open[2].given_up, "it does not count as taken"
    assert not remembered(REQUEST, LOADED, OBSERVE).open[3].given_up
    assert not remembered(REQUEST, LOADED, OBSERVE, LOADED).open[3].given_up
    assert remembered(REQUEST, GIVEN_UP, OBSERVE).open[3].given_up
