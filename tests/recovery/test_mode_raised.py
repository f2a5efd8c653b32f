"""A mode in which more is written: what was only advised, or wanted of a fallback, is looked at again at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import FallBack, Observation
from homeostat.domain.request import RequestStatus
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import AT_ONCE, DOOMED, FINE, Recovery, nothing, ticks, watching
from tests.recovery.line import BAD, GOOD, Stage, run


def in_mode(mode: Mode, first: int, last: int, hot: float = DOOMED) -> tuple[Observation, ...]:
    return tuple(replace(seen, mode=mode) for seen in ticks(first, last, hot))


@pytest.mark.parametrize("before", [Mode.OBSERVE, Mode.ADVISE])
@pytest.mark.parametrize("after", [Mode.APPROVE, Mode.CLOSED_LOOP])
def test_what_was_advised_is_asked_for_again_as_soon_as_it_may_be_written(before: Mode, after: Mode) -> None:
    """A plant on its way to a limit: who raises the mode wants it brought away from there, not in ten minutes."""
    done = Recovery(in_mode(before, 1, 20))
    done.desk.answer = RequestStatus.ADVISED
    assert done.run().released == [10.0], "it is told, and nothing is written"
    done.desk.answer = RequestStatus.CONFIRMED
    assert done.run(*in_mode(after, 21, 40)).released == [10.0, 21.0]
    assert done.run(*in_mode(before, 41, 50), *in_mode(after, 51, 60)).released == [10.0, 21.0], "it is written by now"


def test_what_was_advised_is_not_asked_for_again_in_a_mode_in_which_nobody_writes() -> None:
    done = Recovery(in_mode(Mode.OBSERVE, 1, 20))
    done.desk.answer = RequestStatus.ADVISED
    assert done.run(*in_mode(Mode.ADVISE, 21, 40)).released == [10.0]


@pytest.mark.parametrize("before", [Mode.OBSERVE, Mode.ADVISE, Mode.APPROVE])
def test_a_fallback_that_was_wanted_is_wanted_again_where_recovery_has_the_say(before: Mode) -> None:
    done = Recovery(in_mode(before, 1, 20), action=ScriptedAction(BAD), bounds=AT_ONCE)
    done.run(*in_mode(Mode.CLOSED_LOOP, 21, 40))
    assert [at_s for at_s, _ in done.sent(FallBack)] == [10.0, 21.0]


def test_where_nothing_was_to_be_written_a_mode_that_is_raised_is_no_reason_to_think() -> None:
    done = Recovery(in_mode(Mode.OBSERVE, 1, 20, FINE), watching(10.0, answer=nothing))
    done.run(*in_mode(Mode.CLOSED_LOOP, 21, 40, FINE))
    assert done.desk.thoughts == 1


@pytest.mark.parametrize("before", [Mode.OBSERVE, Mode.ADVISE])
def test_a_plant_whose_mode_is_raised_in_time_does_not_come_to_its_limit(before: Mode) -> None:
    """With a real guard: it went on until the trip at 313 K, and the fallback acted."""
    stage = Stage(ScriptedAction(GOOD), start=301.0, mode=before, end_s=150.0)

    def order(seen: Observation) -> None:
        if seen.now_s == 60.0:
            command = PersonCommand("o1", "ann", Role.ENGINEER, Verb.MODE, Mode.CLOSED_LOOP.value)
            stage.guard.mailbox.put(command)

    stage.hook = order
    run(stage)
    assert stage.guard.mode is Mode.CLOSED_LOOP and stage.guard.latched is None
    ((at_s, commands),) = stage.plant.written
    assert commands == GOOD.commands and at_s < 65.0 and stage.plant.hottest < 308.0
