"""Reprompting that teaches: who should change something, when it is over, and when the model is asked at all."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from homeostat.agents.checks import repetition_finding
from homeostat.agents.language.answers import ANSWER
from homeostat.agents.language.reach import HALF
from homeostat.agents.language.reprompting import (
    MOST_REPEATS,
    PROGRESS,
    TRIES,
    TeachingReprompting,
)
from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.agents.search.reprompting import MarginReprompting
from homeostat.domain.advice import COST, Advice, Attempt, Sensitivity
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.remark import RemarkKind
from homeostat.domain.verdict import CIRCUMSTANCES, Approve, Finding, Revise
from homeostat.llm.model import ModelError, Question
from homeostat.llm.scripted import ScriptedModel
from tests.agents.briefings import briefing
from tests.agents.scripted import ScriptedSimulation
from tests.agents.stuck_valve import now
from tests.safety.world import rollout
from tests.twin.followed import reactor

PLANT = reactor().description
PATH = RecoveryPath(PLANT.machine, (next(t for t in PLANT.machine.transitions if t.name == "t_reduce"),))
TARGET = PLANT.machine.state("reduced_load")
ACTIONS = ActionSet((Command("F1.sp", 0.03, 0.005), Command("T1.sp", 310.0, 0.5)), "reduced_load")
FEED_WAY = 0.03 - TARGET.setpoint("F1.sp").low  # type: ignore[union-attr]


class Slopes(ScriptedSimulation):
    """A simulation that knows the sensitivities, and counts how often they are asked for."""

    def __init__(self, *slopes: Sensitivity) -> None:
        super().__init__(lambda actions: rollout(actions))
        self._slopes = slopes
        self.criteria: list[tuple[str, ...]] = []

    async def sensitivities(
        self, diagnosis: Diagnosis, actions: ActionSet, states: Sequence[State], criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        self.criteria.append(tuple(criteria))
        return tuple(s for s in self._slopes if s.criterion in criteria)


def finding(margin: float, name: str = "ACC-T-HIGH", owner: Owner = Owner.ACTION, unit: str = "K") -> Finding:
    return Finding(name, owner, margin, unit, 100.0, 0, f"{name} by {margin}")


def attempt(*findings: Finding, number: int = 1, members: int = 12) -> Attempt:
    return Attempt(number, PATH, ACTIONS, Revise(findings), members)


def feed(slope: float, name: str = "ACC-T-HIGH") -> Sensitivity:
    return Sensitivity(name, "F1.sp", slope)


class Desk:
    """Reprompting with what is around it."""

    def __init__(self, *slopes: Sensitivity, answer: str | ModelError | None = None) -> None:
        def says(question: Question) -> str:
            if isinstance(answer, ModelError):
                raise answer
            return reasonable(question) if answer is None else answer

        self.model = ScriptedModel("scripted", says)
        self.simulation = Slopes(*slopes)
        self.reprompting = TeachingReprompting(briefing(self.model, reactor(), self.simulation))

    def advise(self, after: Attempt, before: Advice | None = None) -> Advice:
        return asyncio.run(self.reprompting.advise(now(), after, before or Advice()))


def keeps(advice: Advice) -> bool:
    """Whether the same path is tried again; asserts that the two ways of saying so agree."""
    if advice.route is Owner.ACTION:
        assert advice.keep_path == PATH and advice.refused_paths == ()
        return True
    assert advice.keep_path is None
    return False


# --- who should change something --------------------------------------------------------------------------------


def test_an_approval_needs_no_advice() -> None:
    approved = Attempt(1, PATH, ACTIONS, Approve(ACTIONS.digest, ()), 12)
    assert Desk().advise(approved, Advice(tries=3)) == Advice()


def test_what_the_commands_can_cure_is_for_action() -> None:
    desk = Desk(feed(-400.0))
    advice = desk.advise(attempt(finding(-2.0), finding(3.0, "FINE")))
    assert keeps(advice) and advice.tries == 1 and advice.refused_paths == ()
    assert advice.findings == (finding(-2.0),) and advice.sensitivities == (feed(-400.0),)
    assert desk.model.asked == [], "the rules know what to say"


EDGE = 400.0 * FEED_WAY / HALF


@pytest.mark.parametrize(("missing", "kept"), [(0.999 * EDGE, True), (1.01 * EDGE, False), (math.inf, False)])
def test_what_is_beyond_the_commands_reach_is_for_planning(missing: float, kept: bool) -> None:
    advice = Desk(feed(-400.0)).advise(attempt(finding(-missing)))
    assert keeps(advice) is kept
    assert advice.refused_paths == (() if kept else (PATH.commanded,))


def test_one_violation_out_of_reach_is_enough() -> None:
    both = attempt(finding(-1.0), finding(-1000.0, "ACC-STEADY"))
    assert not keeps(Desk(feed(-400.0), feed(-1.0, "ACC-STEADY")).advise(both))
    assert keeps(Desk(feed(-400.0)).advise(both)), "one that does not move at all says nothing"


def test_what_only_planning_can_cure_is_for_planning() -> None:
    """However well the commands move it."""
    advice = Desk(feed(-400.0)).advise(attempt(finding(-1.0), finding(-0.1, "X", Owner.PLANNING)))
    assert not keeps(advice) and advice.refused_paths == (PATH.commanded,)


def test_a_path_is_given_up_when_its_tries_are_used_up() -> None:
    desk, advice, attempts = Desk(feed(-400.0)), Advice(), 0
    while advice.keep_path is not None or attempts == 0:
        advice = desk.advise(attempt(finding(-(0.5**attempts)), number=attempts + 1), advice)
        attempts += 1
    assert attempts == TRIES and advice.refused_paths == (PATH.commanded,) and advice.tries == 0


@pytest.mark.parametrize(("missing", "kept"), [(PROGRESS * 2.0 - 0.01, True), (PROGRESS * 2.0, False), (3.0, False)])
def test_a_path_is_given_up_when_another_attempt_gets_no_further(missing: float, kept: bool) -> None:
    desk = Desk(feed(-400.0))
    first = desk.advise(attempt(finding(-2.0)))
    assert keeps(desk.advise(attempt(finding(-missing), number=2), first)) is kept


def test_progress_is_measured_from_a_margin_not_from_a_refusal() -> None:
    desk = Desk(feed(-400.0))
    first = desk.advise(Attempt(1, PATH, None, Revise((finding(-math.inf, "CHK-ANSWER", unit="1"),))))
    assert keeps(desk.advise(attempt(finding(-2.0), number=2), first))


def test_what_was_refused_stays_refused() -> None:
    before = Advice(refused_paths=(("holding",),))
    assert Desk(feed(-400.0)).advise(attempt(finding(-1.0)), before).refused_paths == before.refused_paths
    given_up = Desk(feed(-400.0)).advise(attempt(finding(-1e6)), before)
    assert given_up.refused_paths == (("holding",), PATH.commanded)


def test_an_answer_without_path_is_for_planning_and_refuses_none() -> None:
    wrong = finding(-math.inf, "CHK-ANSWER", unit="1")
    advice = Desk().advise(Attempt(1, None, None, Revise((wrong,))))
    assert advice.route is Owner.PLANNING and advice.refused_paths == () and "schema" in advice.hint


def test_an_answer_without_commands_keeps_the_path() -> None:
    wrong = finding(-math.inf, "CHK-ANSWER", unit="1")
    desk = Desk()
    advice = desk.advise(Attempt(1, PATH, None, Revise((wrong,))))
    assert keeps(advice) and advice.tries == 0 and "schema" in advice.hint
    assert desk.simulation.criteria == [] and desk.model.asked == []


def test_sensitivities_are_asked_for_what_is_violated_and_what_holds_only_just() -> None:
    desk = Desk(feed(-400.0))
    desk.advise(attempt(finding(-2.0), finding(0.05, "LIM-L-HIGH", unit="L"), finding(14.0, "LIM-T-LOW")))
    assert desk.simulation.criteria == [("ACC-T-HIGH", "LIM-L-HIGH", COST)]


# --- the same again ---------------------------------------------------------------------------------------------


def repeated(number: int) -> Attempt:
    return Attempt(number, PATH, ACTIONS, Revise((repetition_finding(1),)))


def test_the_same_again_is_told_so_and_closes_nothing() -> None:
    desk = Desk(feed(-400.0))
    first = desk.advise(attempt(finding(-1.0)))
    first = replace(first, attempts=(attempt(finding(-1.0)),))
    again = desk.advise(repeated(2), first)
    assert keeps(again) and again.tries == first.tries, "nothing new is known of this path"
    assert again.findings == first.findings and "judged before" in again.hint
    assert len(desk.simulation.criteria) == 1, "nothing is computed twice"


def test_a_model_that_goes_on_saying_the_same_is_not_asked_any_more() -> None:
    desk, attempts = Desk(feed(-400.0)), [attempt(finding(-1.0))]
    advice = replace(desk.advise(attempts[0]), attempts=tuple(attempts))
    for number in range(2, 2 + MOST_REPEATS - 1):
        attempts.append(repeated(number))
        advice = replace(desk.advise(attempts[-1], advice), attempts=tuple(attempts))
    with pytest.raises(NoAdmissiblePlan, match="scripted: repeats"):
        desk.advise(repeated(9), advice)


def test_the_same_by_another_path_closes_neither() -> None:
    other = RecoveryPath(PLANT.machine, (next(t for t in PLANT.machine.transitions if t.name == "t_hold"),))
    before = Advice(findings=(finding(-1.0),), attempts=(attempt(finding(-1.0)),), refused_paths=(PATH.commanded,))
    advice = Desk().advise(Attempt(2, other, ACTIONS, Revise((repetition_finding(1),))), before)
    assert advice.route is Owner.PLANNING and advice.keep_path is None and advice.refused_paths == (PATH.commanded,)


# --- what says nothing of the path -------------------------------------------------------------------------------


def unread() -> Attempt:
    return Attempt(1, PATH, None, Revise((finding(-math.inf, ANSWER),)))


def test_malformed_answers_spend_no_try_and_close_nothing() -> None:
    """Three of them and one small violation closed the path."""
    desk, advice = Desk(feed(-400.0)), Advice()
    for _ in range(TRIES):
        advice = desk.advise(unread(), advice)
        assert keeps(advice) and advice.tries == 0
    advice = desk.advise(attempt(finding(-2.0)), advice)
    assert keeps(advice) and advice.tries == 1
    again = desk.advise(unread(), advice)
    assert keeps(again) and again.tries == 1 and again.findings == (finding(-2.0),)
    assert again.sensitivities == advice.sensitivities, "what was learnt still holds"


def test_an_answer_that_cannot_be_read_keeps_a_hold_a_hold() -> None:
    advice = Desk().advise(replace(unread(), kind=AlternativeKind.HOLD, seconds=60.0))
    assert keeps(advice) and advice.keep_s == 60.0


def test_a_hold_that_is_too_long_closes_no_path() -> None:
    late = Finding("CHK-WAIT", Owner.PLANNING, -20.0, "s", 0.0, 0, "hold it for less")
    hold = replace(attempt(late), kind=AlternativeKind.HOLD, seconds=300.0)
    advice = Desk(feed(-400.0)).advise(hold, Advice(refused_paths=(("other",),)))
    assert advice.route is Owner.PLANNING and advice.refused_paths == (("other",),) and advice.keep_path is None
    assert "name a shorter time" in advice.hint


def test_a_hold_that_violates_too_much_says_nothing_of_the_path_for_good() -> None:
    hold = replace(attempt(finding(-1000.0)), kind=AlternativeKind.HOLD, seconds=300.0)
    advice = Desk(feed(-400.0)).advise(hold)
    assert advice.route is Owner.PLANNING and advice.refused_paths == ()
    curable = replace(attempt(finding(-1.0)), kind=AlternativeKind.HOLD, seconds=300.0)
    kept = Desk(feed(-400.0)).advise(curable)
    assert keeps(kept) and kept.keep_s == 300.0


@pytest.mark.parametrize("name", sorted(CIRCUMSTANCES))
def test_what_would_have_met_any_proposal_closes_no_path(name: str) -> None:
    desk = Desk(feed(-400.0))
    advice = desk.advise(attempt(finding(-math.inf, name)))
    assert advice.refused_paths == () and advice.hint and desk.model.asked == []
    with pytest.raises(NoAdmissiblePlan, match=name):
        asyncio.run(MarginReprompting({}).advise(now(), attempt(finding(-math.inf, name)), Advice()))


def test_what_obeys_the_rules_of_its_prompt_is_an_answer() -> None:
    """They ask for a reasoning; what gives one was dropped without a word."""
    answer = '{"route": "action", "hint": "Less feed.", "reasoning": "The jacket is at its end."}'
    desk = Desk(feed(0.0), answer=answer)
    assert desk.advise(attempt(finding(-1.0))).hint == "Less feed." and len(desk.model.asked) == 1
    (remark,) = desk.reprompting._briefing.said.drain()
    assert remark.text == "The jacket is at its end." and remark.kind is RemarkKind.REASONING
    assert "reasoning" in str(desk.model.asked[0].schema)
