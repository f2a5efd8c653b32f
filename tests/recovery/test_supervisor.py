"""The supervisor at a desk whose ticks are known: when it thinks, what it does, what it records, whom it tells."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.bounds import Budget, Patience
from homeostat.agents.crew import NoAdmissiblePlan
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.limits import Limits
from homeostat.domain.observation import Arm, FallBack, Observation
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import HandedOver, LeftAlone, Outcome, Released, RolloutResult, StepBand
from homeostat.recovery.plant_rules import Bounds
from homeostat.trace.decisions import Departed, Diagnosed, LeftAsIs, Noticed, Retrieved
from tests.agents.scripted import ScriptedAction, diagnosis
from tests.recovery.desk import Graph, Recovery, Watching, tick, ticks
from tests.recovery.line import BAD, COOLS, GOOD, HALF, OFF, feed
from tests.safety.world import CALM, HOT, criterion

SOFT = Limits((HOT,), (CALM, criterion("ACC-SOFT", "always (T <= 306)")))
"""Limits with a wish; it may be missed by 0.6 K once the plant was recovered."""
FINE, DOOMED = 300.0, 305.0
"""At full feed the line heats by 10 K within the horizon: from 305 K through the limit of 313 K [K]."""
NEXT = (Step(COOLS, ()),)
"""What is left of the sequence: the line goes on when it is cold."""


def nothing(at_s: float) -> Diagnosis:
    """The diagnosis of a healthy plant."""
    return Diagnosis(at_s, (), ())


def at_first(answer: Callable[[float], Diagnosis], then: Callable[[float], Diagnosis]) -> Callable[[float], Diagnosis]:
    """One diagnosis before 20 s, another one from then on."""
    return lambda at_s: answer(at_s) if at_s < 20.0 else then(at_s)


def watching(*noticed_s: float, answer: Callable[[float], Diagnosis] = diagnosis) -> Watching:
    return Watching(*noticed_s, answer=answer)


# --- when it thinks ---------------------------------------------------------------------------------------------


def test_a_plant_about_which_nothing_is_noticed_is_watched_and_nothing_else() -> None:
    done = Recovery(ticks(1, 30, DOOMED), watching()).run()
    assert done.desk.sent == [] and done.kinds == [] and done.desk.thoughts == 0
    assert done.monitoring.outcomes == [] and len(done.monitoring.seen) == 30


def test_what_is_noticed_is_thought_about_once() -> None:
    done = Recovery(ticks(1, 30, DOOMED)).run()
    assert done.monitoring.diagnosed == [10.0] and done.desk.thoughts == 1
    assert done.kinds == ["noticed", "diagnosed", "fallback-armed", "attempted", "released"]
    assert done.trace.of(Noticed)[0].symptoms == ("S-HOT",)
    assert done.monitoring.departures == [False]


def test_a_tick_without_a_sample_is_thought_about_with_the_last_one() -> None:
    """What was noticed at 10 s is attended to at 12 s, as soon as the ticks that passed before were seen."""
    gap = tuple(tick(float(s), DOOMED, sampled=s != 12) for s in range(1, 20))
    done = Recovery(gap, watching(5.0, 8.0), thinking=2).run()
    assert 12.0 not in done.monitoring.seen and done.monitoring.seen[-1] == 19.0


def test_what_is_noticed_while_ticks_wait_is_thought_about_when_they_are_seen() -> None:
    """Thinking at 5 s takes until 13 s; what is noticed at 7 s is looked at then, not on a plant of 7 s."""
    done = Recovery(ticks(1, 40), watching(5.0, 7.0), thinking=4).run()
    assert done.monitoring.diagnosed[0] == 5.0 and len(done.monitoring.diagnosed) == 2
    first, second = done.when(Noticed)
    assert first == 5.0 and second > 7.0 and done.monitoring.diagnosed[1] == second


def test_what_was_overtaken_is_thought_about_again() -> None:
    done = Recovery(ticks(1, 30, DOOMED), thinking=1, overtaking_s=11.0).run()
    assert done.monitoring.diagnosed == [10.0, 11.0] and done.desk.thoughts == 2
    assert len(done.released) == 1


class Bug(Exception):
    """Something that nobody expects."""


def test_what_failed_is_thought_about_again_when_recovery_is_begun_again() -> None:
    done = Recovery(ticks(1, 10, DOOMED))
    done.twin.bug = lambda actions: Bug()
    with pytest.raises(Bug):
        done.run()
    done.twin.bug = lambda actions: None
    done.run(*ticks(11, 20, DOOMED))
    assert done.monitoring.diagnosed == [10.0, 11.0] and done.released == [11.0]


def test_a_departure_that_recovery_failed_at_is_looked_at_again_when_it_is_begun_again() -> None:
    done = late(last=16)
    done.twin.bug = lambda actions: None if done.desk.now.now_s < 16.0 else Bug()
    with pytest.raises(Bug):
        done.run()
    done.run(*ticks(17, 20, then=NEXT))
    assert done.monitoring.diagnosed == [16.0, 17.0]


def test_a_review_that_is_due_needs_no_symptom() -> None:
    done = Recovery(ticks(1, 20, FINE), Watching(10.0, shows=lambda at_s: ())).run()
    assert done.when(LeftAsIs) == [10.0] and done.trace.of(Noticed) == (Noticed(()),)


def test_after_it_has_come_to_its_end_it_is_not_thought_about_again() -> None:
    done = Recovery(ticks(1, 10, DOOMED)).run()
    done.run(*ticks(11, 20, DOOMED))
    assert done.monitoring.diagnosed == [10.0]


# --- what the graph was asked -----------------------------------------------------------------------------------


class Asking(Watching):
    """Monitoring that asks the graph while it thinks, and when it is told what was done."""

    def __init__(self, *notice_s: float, answer: Callable[[float], Diagnosis] = diagnosis) -> None:
        super().__init__(*notice_s, answer=answer)
        self.graph = Graph()

    def diagnose(self, departed: bool = False) -> Diagnosis:
        self.graph.asked.append(question("faults"))
        return super().diagnose(departed)

    def follow(self, outcome: Outcome) -> None:
        self.graph.asked.append(question("afterwards"))


def question(name: str) -> Retrieved:
    return Retrieved(name, "SELECT", (), "", "", "")


def test_what_was_asked_of_the_graph_is_recorded_before_what_came_of_it_and_also_at_the_end() -> None:
    asking = Asking(10.0)
    done = Recovery(ticks(1, 12, DOOMED), asking, graph=asking.graph).run()
    assert done.kinds[:3] == ["noticed", "retrieved", "diagnosed"] and done.kinds[-2:] == ["released", "retrieved"]


def test_what_was_asked_of_the_graph_is_recorded_where_nothing_came_of_it() -> None:
    asking = Asking(10.0, answer=nothing)
    done = Recovery(ticks(1, 10, DOOMED), asking, graph=asking.graph).run()
    assert done.kinds == ["noticed", "retrieved"]


# --- the diagnosis ----------------------------------------------------------------------------------------------


def test_where_nothing_is_wrong_nothing_is_done() -> None:
    done = Recovery(ticks(1, 20, DOOMED), watching(10.0, answer=nothing)).run()
    assert done.kinds == ["noticed"] and done.desk.sent == [] and done.monitoring.outcomes == []


def test_a_diagnosis_is_recorded_at_the_time_that_it_is_about() -> None:
    done = Recovery(ticks(1, 20, DOOMED), watching(10.0, answer=lambda at_s: diagnosis(at_s - 2.0))).run()
    assert done.when(Diagnosed) == [8.0] and done.when(Noticed) == [10.0]


def test_a_diagnosis_that_takes_too_long_leaves_nothing_known() -> None:
    let_go = threading.Event()

    def slow(at_s: float) -> Diagnosis:
        let_go.wait(10.0)
        return diagnosis(at_s)

    done = Recovery(ticks(1, 10, DOOMED), watching(10.0, answer=slow), bounds=Bounds(Budget(diagnosis_s=0.01)))
    try:
        done.run()
    finally:
        let_go.set()
    assert done.alarms == [("recovery:diagnosis", "the diagnosis took longer than 0.01 s; nothing counts as known")]
    assert done.armed == [Arm(())] and done.kinds == ["noticed"] and done.handed_over == []


class Late:
    """A diagnosis that comes when the test lets it, and is at once from then on."""

    def __init__(self) -> None:
        self._let_go = threading.Event()

    def __call__(self, at_s: float) -> Diagnosis:
        self._let_go.wait(10.0)
        return diagnosis(at_s)

    def comes(self) -> None:
        self._let_go.set()
        for thread in threading.enumerate():
            if thread.name.startswith("beside-"):
                thread.join(5.0)


def overdue(*noticed_s: float) -> tuple[Recovery, Late]:
    """A line about whose diagnosis of 10 s nothing is known at 12 s."""
    late = Late()
    done = Recovery(
        ticks(1, 10, DOOMED), watching(10.0, *noticed_s, answer=late), bounds=Bounds(Budget(diagnosis_s=0.5))
    )
    done.run(*ticks(11, 12, DOOMED))
    assert done.monitoring.seen[-1] == 10.0, "monitoring is never called twice at a time"
    return done, late


def test_a_diagnosis_that_comes_too_late_is_acted_upon_when_it_comes() -> None:
    """Monitoring takes what it saw for explained, so nobody would ask again."""
    done, late = overdue()
    late.comes()
    done.run(*ticks(13, 20, DOOMED))
    assert done.monitoring.diagnosed == [10.0] and done.released == [13.0] and done.when(Diagnosed) == [10.0]
    assert done.monitoring.seen == [float(k) for k in range(1, 21)]


def test_a_diagnosis_that_comes_too_late_is_out_of_date_where_something_new_is_seen() -> None:
    done, late = overdue(12.0)
    late.comes()
    done.run(*ticks(13, 20, DOOMED))
    assert done.monitoring.diagnosed == [10.0, 13.0] and done.released == [13.0]


@pytest.mark.parametrize("when", ["before the fallback", "while it stands", "after its reset"])
def test_a_diagnosis_that_comes_too_late_is_out_of_date_after_a_fallback(when: str) -> None:
    done, late = overdue()
    if when == "before the fallback":
        late.comes()
    done.run(*latched(13, 14))
    if when == "while it stands":
        late.comes()
    done.run(*latched(15, 16))
    if when == "after its reset":
        done.run(tick(17.0, DOOMED))
        late.comes()
    done.run(*ticks(18, 30, DOOMED))
    assert done.monitoring.diagnosed == [10.0] and done.released == []


# --- leave alone, release, hand over -----------------------------------------------------------------------------


def test_a_fault_that_does_no_harm_is_left_alone_and_the_least_margin_is_said() -> None:
    done = Recovery(ticks(1, 20, FINE)).run()
    (left,) = done.trace.of(LeftAsIs)
    (outcome,) = done.monitoring.outcomes
    assert isinstance(outcome, LeftAlone) and outcome.at_s == 10.0
    assert left.state == "running" and left.min_margin == outcome.min_margin == pytest.approx(312.9 - 310.1)
    assert done.released == [] and done.action.asked == [] and done.kinds[-1] == "left-as-is"


def test_what_is_released_is_followed_by_monitoring_and_nothing_stays_armed_by_time() -> None:
    done = Recovery(ticks(1, 20, DOOMED)).run()
    assert done.monitoring.outcomes == [Released(GOOD, 10.0)] and done.released == [10.0]
    urgent, calm = done.armed
    assert urgent.act_by_s is not None and calm == Arm(urgent.strategies) and set(calm.strategies) == {"drain", "vent"}


def test_what_nobody_can_mend_is_handed_over_and_stays_armed_by_time() -> None:
    done = Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(BAD), thinking=1).run()
    assert done.handed_over == ["scripted: no proposal was approved in 1 attempts"]
    assert len(done.armed) == 1 and done.armed[0].act_by_s is not None
    assert done.monitoring.outcomes == [], "it is told when the fallback has acted"


def test_what_is_asked_of_a_proposer() -> None:
    done = Recovery(ticks(1, 20, DOOMED, then=NEXT), bounds=Bounds(Budget(latency_s=1.5)), thinking=1).run()
    situation, path, _ = done.action.asked[0]
    assert situation.diagnosis == diagnosis(10.0) and situation.state == "running" and path.target == "reduced"
    assert situation.rest is not None and [t.name for t in situation.rest.transitions] == ["cools"]
    assert {f.criterion for f in situation.idle} >= {"LIM-HOT", "ACC-CALM"} and min(
        f.margin for f in situation.idle
    ) < 0
    assert situation.deadline_s == pytest.approx(1.0), "of 1.5 s one has passed, and a second is always left"
    assert situation.snapshot == situation.recent[-1] and situation.under_way == ()


def test_the_commands_that_are_under_way_are_said_to_a_proposer() -> None:
    ramp = (Command("L.sp", 9.0, 0.1),)
    moving = tuple(replace(o, rest=ActionSet(ramp, "running")) for o in ticks(1, 20, DOOMED))
    assert Recovery(moving).run().action.asked[0][0].under_way == ramp


@pytest.mark.parametrize("reason", ["the key was not accepted", ""])
def test_the_reason_of_a_hand_over_is_the_proposer_s_or_that_time_is_up(reason: str) -> None:
    done = Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(NoAdmissiblePlan(reason))).run()
    assert done.handed_over == [reason or "no approved proposal within 30.0 s"]


def test_who_proposes_nothing_in_time_hands_over() -> None:
    slow = ScriptedAction(GOOD, delay_s=5.0)
    done = Recovery(ticks(1, 20, DOOMED), action=slow, bounds=Bounds(Budget(latency_s=0.02))).run()
    assert done.handed_over == ["no approved proposal within 0.0 s"]


def test_time_counts_from_the_look_at_the_plant() -> None:
    """Three rollouts, without action and of each fallback, take longer than there is: no answer is waited for."""
    quick = ScriptedAction(GOOD, delay_s=0.01)
    done = Recovery(ticks(1, 20, DOOMED), action=quick, bounds=Bounds(Budget(latency_s=0.05)))
    done.twin.bug = lambda actions: time.sleep(0.02)
    assert done.run().released == [] and done.handed_over[0].startswith("no approved proposal within")


def test_a_request_that_is_withdrawn_hands_over() -> None:
    done = Recovery(ticks(1, 20, DOOMED))
    done.desk.answer = RequestStatus.WITHDRAWN
    done.run()
    assert len(done.handed_over) == 1 and "was withdrawn" in done.handed_over[0]


def hanging(let_go: threading.Event) -> Callable[[ActionSet], None]:
    """A twin that does not come back before it is let go."""

    def wait(actions: ActionSet) -> None:
        let_go.wait(5.0)

    return wait


def test_a_twin_that_does_not_answer_hands_over() -> None:
    let_go = threading.Event()
    done = Recovery(ticks(1, 20, DOOMED), bounds=Bounds(Budget(arming_s=0.01)), thinking=1)
    done.twin.bug = hanging(let_go)
    try:
        done.run()
    finally:
        let_go.set()
    assert done.handed_over == ["the prediction took longer than 0.01 s"]
    assert [at_s for at_s, _ in done.sent(FallBack)] == [12.0], "what was thought passes first"


def test_the_time_of_a_hand_over_is_when_the_fallback_is_asked_for() -> None:
    done = Recovery(ticks(1, 20, DOOMED), thinking=1)

    async def recover() -> object:
        await done.supervisor.supervise()
        done.desk.more(ticks(21, 30, DOOMED))
        return await done.supervisor.recover(diagnosis(20.0))

    done.twin.result = lambda actions: RolloutResult.BROKE_DOWN
    outcome = done.wait_for(recover())
    assert isinstance(outcome, HandedOver) and outcome.at_s == done.desk.now.now_s > 20.0


# --- once recovered ----------------------------------------------------------------------------------------------


def recovered(hot: float, action: ScriptedAction) -> Recovery:
    """A line that was recovered at 10 s, runs at half feed and holds ``hot`` [K]; noticed again at 30 s."""
    first, later = ticks(1, 10, DOOMED), ticks(11, 40, hot, "reduced", feed=HALF)
    return Recovery((*first, *later), watching(10.0, 30.0), action, limits=SOFT).run()


def test_a_recovered_plant_that_misses_a_wish_by_little_is_left_alone() -> None:
    done = recovered(306.4, ScriptedAction(GOOD, feed(OFF, "reduced")))
    assert done.released == [10.0] and done.when(LeftAsIs) == [30.0] and len(done.action.asked) == 1
    assert done.trace.of(LeftAsIs)[0].min_margin == pytest.approx(-0.4, abs=0.11)


def test_a_recovered_plant_that_misses_a_wish_by_much_is_improved_or_left_alone() -> None:
    helped = recovered(309.0, ScriptedAction(GOOD, NoAdmissiblePlan("nothing better")))
    assert helped.when(LeftAsIs) == [30.0] and helped.handed_over == [] and len(helped.action.asked) == 2


def test_a_plant_that_was_never_recovered_is_not_left_alone_where_a_wish_is_missed() -> None:
    done = Recovery(ticks(1, 20, FINE), action=ScriptedAction(NoAdmissiblePlan("nothing")), limits=SOFT).run()
    assert done.handed_over == ["nothing"] and done.when(LeftAsIs) == []


def test_a_recovered_plant_that_runs_into_a_limit_is_handed_over() -> None:
    done = recovered(312.95, ScriptedAction(GOOD, NoAdmissiblePlan("nothing")))
    assert done.handed_over == ["nothing"] and done.when(LeftAsIs) == []


# --- improvement ------------------------------------------------------------------------------------------------

MORE = feed(0.02, "reduced")
CALM_20 = Bounds(patience=Patience(calm_s=20.0))


def reviewed(at_s: float, improves: bool = True) -> Recovery:
    """A line that was recovered at 10 s, stands well at half feed, and is noticed again at ``at_s``."""
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, "reduced", feed=HALF))
    action = ScriptedAction(GOOD, MORE)
    return Recovery(seen, watching(10.0, at_s), action, bounds=CALM_20, improves=improves).run()


@pytest.mark.parametrize(("at_s", "improved"), [(29.0, False), (30.0, True), (31.0, True)])
def test_a_plant_that_stands_well_is_improved_once_the_release_has_settled(at_s: float, improved: bool) -> None:
    done = reviewed(at_s)
    assert done.released == ([10.0, at_s] if improved else [10.0])
    assert done.when(LeftAsIs) == ([] if improved else [at_s])


def test_a_plant_that_stands_well_is_improved_by_those_whose_business_that_is() -> None:
    done = reviewed(40.0, improves=False)
    assert done.released == [10.0] and done.when(LeftAsIs) == [40.0] and len(done.action.asked) == 1


def test_a_release_begins_the_calm_time_anew() -> None:
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, "reduced", feed=HALF))
    done = Recovery(seen, watching(10.0, 35.0, 50.0, 55.0), ScriptedAction(GOOD, MORE, feed(0.018, "reduced")),
                    bounds=CALM_20, improves=True)  # fmt: skip
    done.run()
    assert done.released == [10.0, 35.0, 55.0] and done.when(LeftAsIs) == [50.0]


def test_nothing_is_improved_before_the_first_release() -> None:
    seen = ticks(1, 60, FINE, "reduced", feed=HALF)
    done = Recovery(seen, watching(40.0), ScriptedAction(MORE), bounds=CALM_20, improves=True)
    done.run()
    assert done.released == [] and done.when(LeftAsIs) == [40.0]


# --- fallback and reset -----------------------------------------------------------------------------------------


def latched(first: int, last: int) -> tuple[Observation, ...]:
    return ticks(first, last, DOOMED, latched="'T <= 313' is violated")


def test_monitoring_is_told_once_of_a_fallback_and_once_of_its_reset() -> None:
    seen = (*ticks(1, 10), *latched(11, 20), *ticks(21, 30), *latched(31, 35), *ticks(36, 40))
    done = Recovery(seen, watching()).run()
    assert done.monitoring.outcomes == [
        HandedOver("'T <= 313' is violated", 11.0), LeftAlone(21.0, 0.0),
        HandedOver("'T <= 313' is violated", 31.0), LeftAlone(36.0, 0.0),
    ]  # fmt: skip
    assert done.monitoring.seen == [float(k) for k in range(1, 41)], "watching goes on"


def test_while_a_fallback_acts_nobody_thinks_and_what_was_noticed_then_is_forgotten() -> None:
    seen = (*ticks(1, 10, DOOMED), *latched(11, 20), *ticks(21, 40, DOOMED))
    done = Recovery(seen, watching(15.0, 30.0)).run()
    assert done.monitoring.diagnosed == [30.0] and done.released == [30.0]


def test_what_a_fallback_overtook_is_not_thought_about_after_its_reset() -> None:
    seen = (*ticks(1, 10, DOOMED), *latched(11, 20), *ticks(21, 40, DOOMED))
    done = Recovery(seen, thinking=1, overtaking_s=11.0).run()
    assert done.desk.thoughts == 1 and done.released == []


# --- a batch that is over ---------------------------------------------------------------------------------------


def over(hot: float, *noticed_s: float, shows: Callable[[float], tuple[str, ...]]) -> Recovery:
    """A line that stands still for good at ``hot`` [K] and has heat of its own."""
    seen = ticks(1, 60, hot, "still", feed=HALF)
    return Recovery(
        seen, Watching(*noticed_s, shows=shows), limits=SOFT, action=ScriptedAction(RuntimeError("never asked"))
    ).run()


def test_a_batch_that_is_over_and_safe_is_reviewed_once_for_the_same_symptoms() -> None:
    done = over(308.0, 10.0, 20.0, 30.0, 40.0, shows=lambda at_s: ("A", "B") if at_s < 35.0 else ("B",))
    assert done.when(LeftAsIs) == [10.0] and done.desk.thoughts == 1
    assert done.trace.of(LeftAsIs)[0].min_margin == pytest.approx(-2.1, abs=0.2)


def test_a_batch_that_is_over_is_reviewed_again_for_a_new_symptom() -> None:
    done = over(308.0, 10.0, 20.0, 30.0, shows=lambda at_s: ("A",) if at_s < 15.0 else ("A", "B"))
    assert done.when(LeftAsIs) == [10.0, 20.0]


def test_a_batch_that_is_over_and_will_violate_a_limit_is_handed_over_without_asking_anybody() -> None:
    done = over(312.95, 10.0, shows=lambda at_s: ("A",))
    assert done.handed_over == ["the batch is over, and what follows violates a limit"] and done.action.asked == []


def test_a_batch_that_is_over_stands_in_a_plant_without_hard_limits_as_well() -> None:
    """Nothing protects it, and nothing need: all that is wished for holds."""
    seen = (*ticks(1, 10, 310.0), *ticks(11, 60, FINE, "still", feed=OFF))
    only = Limits((), (criterion("ACC-SOFT", "always (T <= 315)"),))
    done = Recovery(seen, watching(10.0, 40.0), bounds=CALM_20, limits=only).run()
    assert done.released == [10.0] and done.when(LeftAsIs) == [40.0] and done.handed_over == []


def test_a_batch_that_is_not_over_is_reviewed_as_often_as_it_is_noticed() -> None:
    done = Recovery(ticks(1, 40, FINE), watching(10.0, 20.0)).run()
    assert done.when(LeftAsIs) == [10.0, 20.0]


# --- departures -------------------------------------------------------------------------------------------------

SLACK = Bounds(patience=Patience(slack_s=5.0, repeat_s=10.0))


def late(hot: float = FINE, last: int = 20, **changed: Any) -> Recovery:
    """A line that should have gone on by 10 s, and about which nobody notices anything."""
    made = {"monitoring": watching(answer=nothing), "bounds": SLACK, "band": StepBand(8.0, 10.0), **changed}
    return Recovery(ticks(1, last, hot, then=NEXT), **made)


def test_a_step_that_is_late_is_looked_at_although_no_fault_is_found() -> None:
    done = late().run()
    assert done.monitoring.departures == [True] and done.when(Departed) == [16.0]
    assert done.kinds == ["noticed", "departed", "fallback-armed", "left-as-is"]
    assert done.monitoring.outcomes == [], "nothing was done, and there is nothing to follow"
    departed = done.trace.of(Departed)[0]
    assert (departed.state, departed.transition) == ("running", "cools")


def test_a_departure_that_is_answered_is_followed_by_monitoring() -> None:
    done = late(DOOMED).run()
    assert done.released == [16.0] and done.monitoring.outcomes == [Released(GOOD, 16.0)]


def test_a_release_because_of_a_departure_is_a_recovery() -> None:
    """After it a wish that is missed by little is put up with."""
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    watcher = watching(20.0, answer=at_first(nothing, then=diagnosis))
    done = late(DOOMED, last=16, action=quits, limits=SOFT, monitoring=watcher)
    done.run(*ticks(17, 24, 306.4, "reduced", feed=HALF))
    assert done.released == [16.0] and done.when(LeftAsIs) == [20.0] and done.handed_over == []


def test_a_batch_that_departs_without_a_fault_is_not_improved() -> None:
    """All is well, the release at 10 s has settled, and more could be made: no fault, no reason to touch it."""
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, feed=HALF, then=NEXT))
    watcher = watching(10.0, answer=at_first(diagnosis, then=nothing))
    bounds = Bounds(patience=Patience(calm_s=20.0, slack_s=5.0, repeat_s=100.0))
    done = Recovery(
        seen, watcher, ScriptedAction(GOOD, MORE), bounds=bounds, improves=True, band=StepBand(30.0, 40.0)
    ).run()
    assert done.released == [10.0] and done.when(Departed) == done.when(LeftAsIs) == [46.0]


def test_a_departure_with_a_fault_is_followed_by_monitoring_also_where_it_is_left_alone() -> None:
    done = late(monitoring=watching()).run()
    (outcome,) = done.monitoring.outcomes
    assert isinstance(outcome, LeftAlone) and done.kinds[2] == "diagnosed"


def test_the_nominal_route_is_predicted_once_and_from_the_fifth_snapshot_on() -> None:
    healthy = Diagnosis(5.0, (), ()), ActionSet((), "running", NEXT)
    for last, expected in ((4, []), (5, [healthy]), (14, [healthy])):
        assert late(last=last).run().simulation.tried == expected, f"after {last} s"


def test_a_route_that_changes_is_predicted_anew() -> None:
    other = (replace(NEXT[0], commands=(Command("F.sp", OFF, 0.005),)),)
    done = late(last=8).run(*ticks(9, 12, then=other))
    assert [actions.then for _, actions in done.simulation.tried] == [NEXT, other]


def test_the_nominal_route_is_predicted_from_every_snapshot_that_there_is() -> None:
    done = late(last=5)
    seen: list[float] = []
    observe = done.twin.observe
    done.twin.observe = lambda snapshot: (seen.append(snapshot.at_s), observe(snapshot))[1]  # type: ignore[method-assign]
    done.run()
    assert seen == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_where_the_prediction_is_late_a_person_is_told_and_no_step_is_expected() -> None:
    let_go = threading.Event()
    done = late(last=5, bounds=replace(SLACK, budget=Budget(arming_s=0.01)))
    done.twin.bug = hanging(let_go)
    try:
        done.run()
    finally:
        let_go.set()
    text = "the prediction took longer than 0.01 s; no step is expected at any time"
    assert done.alarms == [("recovery:prediction", text)] and done.kinds == []


# --- every step -------------------------------------------------------------------------------------------------

EVERY = Bounds(patience=Patience(repeat_s=20.0), every_step=True)


def stepwise(*observations: Observation, **changed: Any) -> Recovery:
    """A line about whose every state proposers are asked, and nothing is wrong."""
    return Recovery(observations, **{"monitoring": watching(answer=nothing), "bounds": EVERY, **changed})


def test_every_state_is_asked_about_once_the_twin_can_see() -> None:
    done = stepwise(*ticks(1, 8, then=NEXT), *ticks(9, 15, state="reduced", feed=HALF)).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == [5.0, 9.0] and done.released == [5.0, 9.0]
    assert done.kinds.count("noticed") == 2 and done.kinds.count("diagnosed") == 0
    assert done.monitoring.outcomes == [], "a step as usual is nothing to follow"


def test_nothing_is_asked_where_not_every_step_is_asked_for() -> None:
    assert Recovery(ticks(1, 30), watching(answer=nothing)).run().action.asked == []


def test_a_state_in_which_nothing_waits_is_asked_about_again_after_a_while() -> None:
    done = stepwise(*ticks(1, 50), action=ScriptedAction(NoAdmissiblePlan("nothing now"))).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == [5.0, 25.0, 45.0]
    assert done.when(LeftAsIs) == [5.0, 25.0, 45.0]


def test_a_state_in_which_the_next_step_waits_is_asked_about_once() -> None:
    assert len(stepwise(*ticks(1, 50, then=NEXT)).run().action.asked) == 1


def test_a_complete_batch_is_not_asked_about() -> None:
    done = stepwise(*ticks(1, 30, state="still", feed=HALF)).run()
    assert done.action.asked == [] and done.desk.thoughts == 0


@pytest.mark.parametrize(("noticed_s", "asked_s"), [(3.0, [3.0, 5.0]), (5.0, [5.0]), (8.0, [5.0, 8.0])])
def test_a_fault_and_a_step_at_the_same_time_are_one_question(noticed_s: float, asked_s: list[float]) -> None:
    done = stepwise(*ticks(1, 22, DOOMED, then=NEXT), monitoring=watching(noticed_s)).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == asked_s


def test_a_step_as_usual_is_no_recovery() -> None:
    """After one, a wish that is missed by little is not put up with, and calm time does not run."""
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    seen = (*ticks(1, 8), *ticks(9, 30, 306.5, "reduced", feed=HALF))
    done = stepwise(*seen, action=quits, limits=SOFT, heating=0.05).run()
    assert done.released == [5.0] and done.handed_over[:1] == ["nothing"]


def test_a_release_for_a_fault_is_a_recovery_where_every_step_is_asked_for_too() -> None:
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    seen = (*ticks(1, 8, DOOMED), *ticks(9, 28, 306.4, "reduced", feed=HALF))
    done = stepwise(*seen, action=quits, limits=SOFT, monitoring=watching()).run()
    assert done.released == [5.0] and done.handed_over == [] and done.when(LeftAsIs) == [9.0]
