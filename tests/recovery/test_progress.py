"""ProgressMonitor: a step that is late, early or forbidden calls for attention, and one that is on time does not."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.verdict import StepBand
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.recovery.progress import ProgressMonitor
from tests.safety.world import BATCH, LIMITS, reading, rollout, sequencer

BANDS = (StepBand(120.0, 130.0), StepBand(150.0, 170.0))
"""When the vessel should be emptied, and when it should rest [s]."""
SLACK_S, REPEAT_S = 5.0, 20.0
FULL = {"L": 9.5}
FORBIDDEN = {"L": 11.5}
"""Full as well, but no permissive lets the next step be taken."""


def expecting(slack_s: float = SLACK_S) -> tuple[ProgressMonitor, Sequencer]:
    """A sequencer with a batch from 100 s on, and what is expected of it."""
    subject, expected = sequencer(LIMITS), ProgressMonitor(slack_s, REPEAT_S)
    subject.load(BATCH, 0.0)
    expected.expect(BATCH.then, replace(rollout(BATCH), bands=BANDS), 0.0)
    return expected, subject


def seen(subject: Sequencer, at_s: float) -> Observation:
    """What the guard says of ``subject`` at ``at_s`` [s]."""
    return Observation(
        at_s, None, subject.state, subject.rest(), subject.way(), subject.refused, (), None, Mode.CLOSED_LOOP, (), None
    )


def enter(expected: ProgressMonitor, subject: Sequencer) -> None:
    entered = tuple(subject.drain())
    expected.follow(replace(seen(subject, entered[-1][1]), entered=entered))


def test_a_step_is_late_when_every_member_has_taken_it_and_the_slack_is_over() -> None:
    expected, subject = expecting()
    assert not any(expected.deviates(seen(subject, at_s)) for at_s in (100.0, 125.0, 130.0, 135.0))
    found = expected.deviates(seen(subject, 136.0))
    assert found is not None and (found.transition, found.earliest_s, found.latest_s) == ("empty", 120.0, 130.0)
    assert found.reason == "'L >= 9 and T <= 310' does not hold at 136 s, predicted by 130 s"


def test_a_deviation_is_repeated_only_after_its_time() -> None:
    expected, subject = expecting()
    assert [at_s for at_s in range(100, 200) if expected.deviates(seen(subject, float(at_s)))] == [136, 156, 176, 196]


def test_a_new_prediction_starts_afresh() -> None:
    expected, subject = expecting()
    assert expected.deviates(seen(subject, 136.0)) is not None
    expected.expect(BATCH.then, replace(rollout(BATCH), bands=(StepBand(150.0, 160.0), StepBand(190.0, 200.0))), 136.0)
    assert [at_s for at_s in range(137, 200) if expected.deviates(seen(subject, float(at_s)))] == [166, 186]


def test_a_step_that_is_taken_in_time_is_no_news_and_the_next_one_is_watched() -> None:
    expected, subject = expecting()
    subject.sample(reading(125.0, **FULL))
    enter(expected, subject)
    assert not any(expected.deviates(seen(subject, at_s)) for at_s in (125.0, 136.0, 175.0))
    found = expected.deviates(seen(subject, 176.0))
    assert found is not None and found.transition == "rest"


@pytest.mark.parametrize(("at_s", "called"), [(114.0, True), (115.0, False), (119.0, False)])
def test_a_step_is_early_when_it_is_taken_long_before_any_member(at_s: float, called: bool) -> None:
    expected, subject = expecting()
    subject.sample(reading(at_s, **FULL))
    enter(expected, subject)
    found = expected.deviates(seen(subject, at_s))
    assert (found is not None) is called
    if found is not None:
        assert found.reason == "'emptying' is entered at 114 s, 6 s before the earliest prediction"
        assert expected.deviates(seen(subject, at_s + REPEAT_S)) is None, "what was early once is told once"


def test_a_step_that_is_forbidden_calls_once_the_slack_is_over() -> None:
    expected, subject = expecting()
    found = None
    for at_s in range(110, 120):
        assert found is None or at_s > 117
        subject.sample(reading(float(at_s), **(FORBIDDEN if at_s >= 112 else {})))
        found = found or expected.deviates(seen(subject, float(at_s)))
    assert found is not None and found.transition == "empty"
    assert "'emptying' is due and forbidden since 112 s" in found.reason and "PRM-FEED" in found.reason


def test_a_step_that_is_forbidden_for_a_moment_does_not_call() -> None:
    expected, subject = expecting()
    for at_s in range(100, 120):
        subject.sample(reading(float(at_s), **(FORBIDDEN if at_s % 4 else {})))
        assert expected.deviates(seen(subject, float(at_s))) is None


def test_a_member_that_never_takes_a_step_makes_it_never_late() -> None:
    expected, subject = expecting()
    expected.expect(BATCH.then, replace(rollout(BATCH), bands=(StepBand(120.0, math.inf), BANDS[1])), 0.0)
    assert expected.deviates(seen(subject, 1e6)) is None


def test_nothing_is_expected_without_a_prediction() -> None:
    expected, subject = ProgressMonitor(SLACK_S, REPEAT_S), sequencer(LIMITS)
    subject.load(BATCH, 0.0)
    assert expected.lacks(BATCH.then) and not expected.lacks(())
    assert expected.deviates(seen(subject, 1e6)) is None
    expected.expect(BATCH.then, rollout(BATCH), 0.0)
    assert not expected.lacks(BATCH.then) and expected.deviates(seen(subject, 1e6)) is None, "the twin broke down"


def test_nothing_is_expected_where_the_slack_is_infinite() -> None:
    expected, subject = expecting(math.inf)
    assert not ProgressMonitor(math.inf, REPEAT_S).lacks(BATCH.then)
    assert expected.deviates(seen(subject, 1e6)) is None


def test_a_prediction_says_nothing_of_other_steps() -> None:
    expected, subject = expecting()
    subject.load(replace(BATCH, then=BATCH.then[:1]), 0.0)
    assert expected.lacks(BATCH.then[:1]) and expected.deviates(seen(subject, 1e6)) is None
