"""Recovery at a desk whose ticks are known: when it thinks, what it does, what it records, whom it tells."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import pytest

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Diagnosed, NoActionTaken, Noticed, Retrieved
from homeostat.domain.observation import Arm, FallBack, NoAction, Observation, Settled
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Released, Resolution, RolloutResult
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.deadline import SHORTEST_S
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, diagnosis
from tests.recovery.desk import (
    AT_ONCE,
    DOOMED,
    FINE,
    NEXT,
    Graph,
    Recovery,
    Watching,
    at_first,
    hanging,
    latched,
    late,
    nothing,
    tick,
    ticks,
    watching,
)
from tests.recovery.line import BAD, GOOD

# --- when it thinks ----------------------------------------------------------------------------------------------


def test_a_plant_about_which_nothing_is_noticed_is_watched_and_nothing_else() -> None:
    done = Recovery(ticks(1, 30, DOOMED), watching()).run()
    assert done.desk.sent == [] and done.kinds == [] and done.desk.thoughts == 0
    assert done.monitoring.outcomes == [] and len(done.monitoring.seen) == 30


def test_what_is_noticed_is_thought_about_once() -> None:
    done = Recovery(ticks(1, 30, DOOMED)).run()
    assert done.monitoring.diagnosed == [10.0] and done.desk.thoughts == 1
    assert done.kinds == [
        "noticed", "diagnosed", "foreseen", "fallback-armed", "attempted", "compared", "foreseen", "released",
    ]  # fmt: skip
    assert done.trace.of(Noticed)[0].symptoms == ("S-HOT",)
    assert done.monitoring.deviations == [False]


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


def test_a_deviation_that_recovery_failed_at_is_looked_at_again_when_it_is_begun_again() -> None:
    done = late(last=16)
    done.twin.bug = lambda actions: None if done.desk.now.now_s < 16.0 else Bug()
    with pytest.raises(Bug):
        done.run()
    done.run(*ticks(17, 20, then=NEXT))
    assert done.monitoring.diagnosed == [16.0, 17.0]


def test_a_review_that_is_due_needs_no_symptom() -> None:
    done = Recovery(ticks(1, 20, FINE), Watching(10.0, shows=lambda at_s: ())).run()
    assert done.when(NoActionTaken) == [10.0] and done.trace.of(Noticed) == (Noticed(()),)


def test_after_it_has_come_to_its_end_it_is_not_thought_about_again() -> None:
    done = Recovery(ticks(1, 10, DOOMED)).run()
    done.run(*ticks(11, 20, DOOMED))
    assert done.monitoring.diagnosed == [10.0]


# --- what the graph was asked ------------------------------------------------------------------------------------


class Asking(Watching):
    """Monitoring that asks the graph while it thinks, and when it is told what was done."""

    def __init__(self, *notice_s: float, answer: Callable[[float], Diagnosis] = diagnosis) -> None:
        super().__init__(*notice_s, answer=answer)
        self.graph = Graph()

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        self.graph.asked.append(question("faults"))
        return super().diagnose(deviates)

    def follow(self, outcome: Resolution) -> None:
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
    assert done.kinds == ["noticed", "retrieved", "concluded"]


# --- the diagnosis -----------------------------------------------------------------------------------------------


def test_where_nothing_is_wrong_nothing_is_done() -> None:
    done = Recovery(ticks(1, 20, DOOMED), watching(10.0, answer=nothing)).run()
    assert done.kinds == ["noticed", "concluded"] and done.desk.sent == [] and done.monitoring.outcomes == []


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
    assert done.armed == [Arm(())] and done.kinds == ["noticed", "concluded"] and done.handed_over == []
    assert done.sent(NoAction) == [], "a time to act by that stands goes on"


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
    assert [name for name, _ in done.alarms] == ["recovery:diagnosis"] and not done.sent(Settled)
    late.comes()
    done.run(*ticks(13, 20, DOOMED))
    over = [m.name for _, m in done.sent(Settled)]
    assert over.count("recovery:diagnosis") == 1, "with the next that is in time"
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
    (left,) = done.trace.of(NoActionTaken)
    (outcome,) = done.monitoring.outcomes
    assert isinstance(outcome, NoActionNeeded) and outcome.at_s == 10.0
    assert left.state == "running" and left.min_margin == outcome.min_margin == pytest.approx(312.9 - 310.1)
    nearest = min(left.findings, key=lambda f: f.margin)
    assert (nearest.margin, nearest.unit, left.members) == (left.min_margin, "K", 2), "and whose it is"
    assert done.released == [] and done.action.asked == [] and done.kinds[-1] == "no-action"


def test_what_is_released_is_followed_by_monitoring_and_nothing_stays_armed_by_time() -> None:
    done = Recovery(ticks(1, 20, DOOMED)).run()
    assert done.monitoring.outcomes == [Released(GOOD, 10.0)] and done.released == [10.0]
    (urgent,) = done.armed
    assert urgent.act_by_s is not None and set(urgent.strategies) == {"drain", "vent"}
    assert done.sent(NoAction) == [], "the guard ends the time when it has read what was released"


def test_what_nobody_can_mend_is_handed_over_and_stays_armed_by_time() -> None:
    done = Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(BAD), thinking=1, bounds=AT_ONCE).run()
    assert done.handed_over == ["scripted: no proposal was approved in 1 attempts"]
    assert len(done.armed) == 1 and done.armed[0].act_by_s is not None
    assert done.monitoring.outcomes == [], "it is told when the fallback has acted"


def standing(first: int, last: int, hot: float, by_s: float) -> tuple[Observation, ...]:
    """Ticks at which a time to act by stands in the guard."""
    return tuple(replace(seen, act_by_s=by_s) for seen in ticks(first, last, hot))


def test_a_plant_that_is_left_alone_ends_a_time_that_an_earlier_thought_has_named() -> None:
    done = Recovery(standing(1, 20, FINE, 40.0), Watching(10.0)).run()
    assert len(done.sent(NoAction)) == 1 and done.armed[-1].act_by_s is None and done.kinds[-1] == "no-action"
    assert Recovery(ticks(1, 20, FINE), Watching(10.0)).run().sent(NoAction) == [], "there is nothing to end"


def test_where_a_time_stands_a_plant_that_seems_healthy_is_rolled_out_before_it_is_left_alone() -> None:
    calm = Recovery(standing(1, 20, FINE, 40.0), watching(10.0, answer=nothing)).run()
    assert len(calm.sent(NoAction)) == 1 and calm.when(NoActionTaken) == [10.0]
    doomed = Recovery(standing(1, 20, DOOMED, 40.0), watching(10.0, answer=nothing)).run()
    assert doomed.sent(NoAction) == [] and doomed.released == [10.0]


def test_a_time_that_stands_bounds_the_thinking() -> None:
    done = Recovery(standing(1, 20, DOOMED, 17.0), thinking=0).run()
    assert done.action.asked[0][0].deadline_s == 7.0
    passed = Recovery(standing(1, 20, DOOMED, 10.0), thinking=0).run()
    assert passed.action.asked[0][0].deadline_s == SHORTEST_S


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


def test_a_time_to_act_by_that_the_guard_holds_no_more_is_no_reason_to_recover_again() -> None:
    """What was released ended it; the second symptom is none of a fault."""
    done = Recovery(ticks(1, 40, DOOMED), Watching(10.0, 30.0, answer=at_first(diagnosis, nothing))).run()
    assert [m.act_by_s is not None for _, m in done.sent(Arm)] == [True]
    assert len(done.released) == 1 and done.sent(NoAction) == []


@pytest.mark.parametrize("reason", ["the key was not accepted", ""])
def test_the_reason_of_a_hand_over_is_the_proposer_s_or_that_time_is_up(reason: str) -> None:
    done = Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(NoAdmissiblePlan(reason)), bounds=AT_ONCE).run()
    assert done.handed_over == [reason or "no approved proposal within 30.0 s"]


def test_who_proposes_nothing_in_time_hands_over() -> None:
    slow = ScriptedAction(GOOD, delay_s=5.0)
    bounds = Bounds(Budget(latency_s=0.02), InterventionBounds(waits=0))
    done = Recovery(ticks(1, 20, DOOMED), action=slow, bounds=bounds).run()
    assert done.handed_over == ["no approved proposal within 0.0 s"]


def test_time_counts_from_the_look_at_the_plant() -> None:
    """Three rollouts, without action and of each fallback, take longer than there is: no answer is waited for."""
    quick = ScriptedAction(GOOD, delay_s=0.01)
    done = Recovery(ticks(1, 20, DOOMED), action=quick, bounds=Bounds(Budget(latency_s=0.05)))
    done.twin.bug = lambda actions: time.sleep(0.02)
    assert done.run().released == [] and done.handed_over[0].startswith("no approved proposal within")


def test_what_is_only_advised_leaves_the_plant_alone_and_ends_the_time_to_act_by() -> None:
    done = Recovery(ticks(1, 20, DOOMED))
    done.desk.answer = RequestStatus.ADVISED
    done.run()
    assert [type(outcome) for outcome in done.monitoring.outcomes] == [NoActionNeeded]
    assert done.armed[0].act_by_s is not None and len(done.sent(NoAction)) == 1 and done.handed_over == []


def test_a_request_that_is_withdrawn_hands_over() -> None:
    done = Recovery(ticks(1, 20, DOOMED))
    done.desk.answer = RequestStatus.WITHDRAWN
    done.run()
    assert len(done.handed_over) == 1 and "was withdrawn" in done.handed_over[0]


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
        await done.loop.supervise()
        done.desk.more(ticks(21, 30, DOOMED))
        return await done.loop.recover(diagnosis(20.0), deviates=False)

    done.twin.result = lambda actions: RolloutResult.BROKE_DOWN
    outcome = done.wait_for(recover())
    assert isinstance(outcome, FallbackNeeded) and outcome.at_s == done.desk.now.now_s > 20.0


# --- fallback and reset ------------------------------------------------------------------------------------------


def test_monitoring_is_told_once_of_a_fallback_and_once_of_its_reset() -> None:
    seen = (*ticks(1, 10), *latched(11, 20), *ticks(21, 30), *latched(31, 35), *ticks(36, 40))
    done = Recovery(seen, watching()).run()
    assert done.monitoring.outcomes == [
        FallbackNeeded("'T <= 313' is violated", 11.0), NoActionNeeded(21.0, 0.0),
        FallbackNeeded("'T <= 313' is violated", 31.0), NoActionNeeded(36.0, 0.0),
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
