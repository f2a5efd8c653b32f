"""Waits, holds and tests in the one list: what both parts cost, what forbids, what time is left, and who is asked when.

From 305 K the line runs through its limit of 313 K in 80 s if nothing is done; half feed holds the temperature.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.agents.roles import Hold, NoAdmissiblePlan, Probe, Proposer, Situation, Wait
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Attempted, Compared, Probed, ReleasedActions, Waited
from homeostat.domain.observation import NoAction
from homeostat.domain.plant.limits import LimitKind, Limits, Owner
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.verdict import REPEATED
from homeostat.guard.requests.permissives import refusal
from homeostat.record.run_record import RunRecord
from homeostat.record.story.story import Story
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.judging import TEST, WAIT
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedReprompting
from tests.recovery.desk import DEAR, DOOMED, FREE, MILD, Recovery, ticks, watching
from tests.recovery.line import COOLING, COOLS, GOOD, feed
from tests.recovery.rivals import GOOD_EUR, HELD, by, proposer
from tests.recovery.test_probing import ScriptedProbing
from tests.safety.world import CALM, HOT, criterion, rule
from tests.twin.followed import reactor

REDUCE = RecoveryPath(COOLING, (next(t for t in COOLING.transitions if t.name == "reduce"),))
QUICK = Bounds(intervention=InterventionBounds(answer_s=5.0, probe_s=5.0))


def line(*others: Proposer, hot: float = DOOMED, last: int = 20, **more: object) -> Recovery:
    """A line that must not be left alone, on which the first proposer finds GOOD."""
    made: dict[str, object] = {"bounds": QUICK, "action": ScriptedAction(GOOD), **more}
    return Recovery(ticks(1, last, hot), others=others, **made)  # type: ignore[arg-type]


def waiting(seconds: float) -> Proposer:
    return proposer("patient", ScriptedAction(GOOD), Wait(seconds), "reduce")


def chosen(done: Recovery, at: int = 0) -> tuple[AlternativeKind, str]:
    """Kind and proposer of what was chosen from the list."""
    event = done.trace.of(Compared)[at]
    (one,) = [a for a in event.alternatives if a.digest == event.chosen]
    return one.kind, one.proposer


# --- waits -------------------------------------------------------------------------------------------------------


def test_a_wait_that_costs_less_is_what_happens_and_nothing_is_written() -> None:
    done = line(waiting(20.0)).run()
    assert chosen(done) == (AlternativeKind.WAIT, "patient") and done.released == []
    (wait,) = done.trace.of(Waited)
    assert (wait.proposer, wait.seconds, wait.follows, wait.nuisance) == ("patient", 20.0, "running > reduced", ())
    assert not done.sent(NoAction), "the armed fallback and the time to act by stay"
    assert done.armed[-1].act_by_s is not None and done.handed_over == []


def test_what_a_wait_costs_is_what_both_parts_cost() -> None:
    done = line(waiting(20.0)).run()
    one = next(a for a in done.trace.of(Compared)[0].alternatives if a.kind is AlternativeKind.WAIT)
    assert one.seconds == 20.0
    # 80 s at half feed lose 1.20 EUR, 80 s in the state cost 0.024 EUR, and the release then 0.27 EUR.
    assert one.cost.total == pytest.approx(0.8 * 1.5 + 0.8 * 0.03 + 0.27)
    assert one.cost.total < GOOD_EUR


def test_the_plant_is_looked_at_again_when_the_wait_is_over_and_not_before() -> None:
    done = line(waiting(20.0), last=45).run()
    assert done.when(Waited) == [10.0] and done.monitoring.diagnosed == [10.0, 30.0]
    assert done.released == [30.0] and by(done) == [("scripted", GOOD.digest)]


def test_news_end_a_wait() -> None:
    done = line(waiting(20.0), last=45, monitoring=watching(10.0, 15.0)).run()
    assert done.when(Waited) == [10.0] and done.released == [15.0]


@pytest.mark.parametrize(("seconds", "name"), [(70.0, WAIT), (99.0, WAIT), (500.0, WAIT)])
def test_a_wait_for_which_physics_leaves_no_time_is_refused(seconds: float, name: str) -> None:
    done = line(waiting(seconds)).run()
    refused = next(a for a in done.trace.of(Attempted) if a.what is AlternativeKind.WAIT)
    assert not refused.approved and refused.findings[0].criterion == name and refused.seconds == seconds
    assert by(done) == [("scripted", GOOD.digest)] and not done.trace.of(Waited)


def test_a_wait_with_which_anything_that_forbids_is_violated_is_refused() -> None:
    """306 K are passed after 10 s, and nothing that follows brings it back."""
    done = line(waiting(20.0), limits=MILD).run()
    refused = next(a for a in done.trace.of(Attempted) if a.what is AlternativeKind.WAIT)
    assert "LIM-MILD" in {f.criterion for f in refused.findings if not f.satisfied}
    assert by(done) == [("scripted", GOOD.digest)]


def test_it_is_waited_so_often_and_no_more() -> None:
    bounds = Bounds(intervention=InterventionBounds(answer_s=5.0, waits=1))
    one = proposer("patient", ScriptedAction(GOOD), Wait(20.0))
    done = line(one, last=45, bounds=bounds).run()
    assert done.when(Waited) == [10.0] and done.released == [30.0]


def test_without_any_proposal_the_fallback_is_what_follows() -> None:
    patient = proposer("patient", ScriptedAction(GOOD), Wait(20.0))
    done = line(patient, action=ScriptedAction(feed(0.03, "reduced"))).run()
    assert [w.follows for w in done.trace.of(Waited)] == ["drain"]


# --- nuisances ---------------------------------------------------------------------------------------------------

NUISANCE = rule("PRM-WARM", LimitKind.PERMISSIVE, "T >= 303")
WISH = criterion("ACC-SOFT", "T <= 306")


def cold(
    hot: float = 300.0, heating: float = 0.1, last: int = 20, permissive: object = NUISANCE, first: ActionSet = GOOD,
    others: tuple[Proposer, ...] = (),
) -> Recovery:  # fmt: skip
    """A line on which half feed is refused until it is warm, and missing a wish is dear."""
    limits = Limits((HOT, permissive), (CALM, WISH))  # type: ignore[arg-type]
    return Recovery(
        ticks(1, last, hot), action=ScriptedAction(first), limits=limits, rows=(*DEAR, *FREE), improves=True,
        bounds=QUICK, heating=heating, others=others,
    )  # fmt: skip


def test_what_only_a_permissive_refuses_that_clears_is_waited_for_and_named() -> None:
    done = cold().run()
    (wait,) = done.trace.of(Waited)
    assert (wait.proposer, wait.seconds, wait.nuisance) == ("search", 60.0, ("PRM-WARM",))
    assert chosen(done) == (AlternativeKind.WAIT, "search") and done.released == []
    story = Story(reactor().description)
    (line,) = story.tell(wait, 10.0)
    assert line.label == "waits" and "PRM-WARM" in line.text and "60 s by search" in line.text
    record = RunRecord()
    record(wait, 10.0)
    assert record.waits == [(10.0, wait)]


def test_what_does_not_clear_is_not_waited_for() -> None:
    waits = cold(permissive=rule("PRM-WARM", LimitKind.PERMISSIVE, "T >= 312")).run().trace.of(Waited)
    assert not [w for w in waits if w.nuisance]


def barred(done: Recovery) -> list[tuple[str, str, str]]:
    """What permissives alone refuse: who proposed it, its digest, and why not."""
    lines = done.trace.of(Compared)[0].alternatives
    return [(a.proposer, a.digest, a.refused) for a in lines if a.refused.startswith("nothing but")]


@pytest.mark.parametrize("formula", ["T >= 303", "T >= 312"], ids=["clears", "does not clear"])
def test_a_permissive_that_alone_keeps_a_cheaper_proposal_back_is_named_in_the_list(formula: str) -> None:
    done = cold(permissive=rule("PRM-WARM", LimitKind.PERMISSIVE, formula)).run()
    ((who, digest, why),) = barred(done)
    assert (who, digest) == ("scripted", GOOD.digest) and why.startswith("nothing but PRM-WARM refuses it: ")
    (compared,) = done.trace.of(Compared)
    (one,) = [a for a in compared.alternatives if a.refused == why]
    if compared.chosen:  # else the fallback is to act, and nobody counts
        assert one.certificate is not None and one.certificate.violations == 0
    assert compared.chosen != digest and not [r for r in done.trace.of(ReleasedActions) if r.digest == digest]


def test_a_permissive_is_named_although_something_dearer_is_released() -> None:
    second = proposer("second", ScriptedAction(feed(0.01, "reduced")))
    done = cold(permissive=rule("PRM-FEW", LimitKind.PERMISSIVE, "T >= 312 or F.sp <= 0.011"), others=(second,)).run()
    assert [name for name, _ in by(done)] == ["second"] and [who for who, *_ in barred(done)] == ["scripted"]


def test_what_would_cost_more_than_what_may_be_done_anyway_is_no_matter_of_a_permissive() -> None:
    much, second = rule("PRM-MUCH", LimitKind.PERMISSIVE, "T >= 312 or F.sp >= 0.0149"), ScriptedAction(GOOD)
    done = cold(permissive=much, first=feed(0.005, "reduced"), others=(proposer("second", second),)).run()
    assert [name for name, _ in by(done)] == ["second"] and barred(done) == []


def test_what_a_limit_refuses_as_well_is_no_nuisance() -> None:
    hot = rule("PRM-WARM", LimitKind.PERMISSIVE, "T >= 320")
    done = line(limits=Limits((HOT, hot), (CALM,)), action=ScriptedAction(feed(0.04, "reduced"))).run()
    assert barred(done) == []


def test_a_guard_that_clears_is_a_nuisance_as_well() -> None:
    """Without feed the line cools by 6 K in 60 s, to 289 K: the way that opens at 290 K is open by then."""
    nothing = ScriptedAction(NoAdmissiblePlan("nothing"))
    done = Recovery(ticks(1, 20, 295.0, feed=0.0), action=nothing, improves=True, bounds=QUICK).run()
    (wait,) = done.trace.of(Waited)
    assert (wait.seconds, wait.nuisance, wait.follows) == (60.0, ("when_cold",), "running > reduced")


# --- holds -------------------------------------------------------------------------------------------------------


def holding(seconds: float) -> Proposer:
    return proposer("brief", ScriptedAction(GOOD), Hold(REDUCE, seconds), "reduce")


def test_what_is_held_for_a_while_is_released_and_looked_at_again() -> None:
    done = line(holding(20.0), hot=303.0, last=45, action=ScriptedAction(HELD)).run()
    assert chosen(done) == (AlternativeKind.HOLD, "brief")
    first = done.trace.of(ReleasedActions)[0]
    assert (first.proposer, first.for_s) == ("brief", 20.0) and done.released[0] == 10.0
    assert done.monitoring.diagnosed[:2] == [10.0, 30.0]


def test_a_hold_after_which_the_design_violates_a_limit_is_refused() -> None:
    done = line(holding(10.0)).run()
    refused = next(a for a in done.trace.of(Attempted) if a.what is AlternativeKind.HOLD)
    assert not refused.approved and refused.seconds == 10.0
    assert by(done) == [("scripted", GOOD.digest)]


def test_a_route_with_later_steps_is_not_held_and_nobody_thinks_about_its_commands_in_vain() -> None:
    awaited = RecoveryPath(COOLING, (COOLS,))
    action, advised = ScriptedAction(GOOD), list[Attempt]()

    class Noting(ScriptedReprompting):
        async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
            advised.append(attempt)
            return await super().advise(situation, attempt, before)

    line(proposer("brief", action, Hold(awaited, 20.0), "reduce", reprompting=Noting())).run()
    (finding,) = advised[0].verdict.findings
    assert finding.owner is Owner.PLANNING and "propose it for good" in finding.message
    assert [path for _, path, _ in action.asked] == [REDUCE], "planning was asked again before any commands were"


# --- tests -------------------------------------------------------------------------------------------------------

OFFERED = Probe(feed(0.02, "reduced"), REDUCE, ("warm", "dirty"), 4.0, 0.15, 0.14)
"""Not worth enough for the prober to begin it by itself."""
OTHER = replace(OFFERED, actions=feed(0.021, "reduced"))


def curious(probe: Probe) -> Recovery:
    one = proposer("curious", ScriptedAction(HELD), probe, "reduce")
    made = line(one, probing=ScriptedProbing((OFFERED,)), action=ScriptedAction(GOOD))
    made.probing.twin = made.twin  # type: ignore[union-attr]
    return made


def test_a_test_that_is_on_offer_is_made_and_counted_as_the_proposer_s_own() -> None:
    done = curious(OFFERED).run()
    assert chosen(done) == (AlternativeKind.TEST, "curious")
    (probe,) = done.trace.of(Probed)
    assert (probe.proposer, probe.apart) == ("curious", ("warm", "dirty"))
    assert by(done)[0] == ("curious", OFFERED.actions.digest)


def test_why_a_test_is_refused_stands_in_the_list_and_its_proposer_is_told() -> None:
    advised: list[Attempt] = []

    class Noting(ScriptedReprompting):
        async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
            advised.append(attempt)
            return await super().advise(situation, attempt, before)

    one = proposer("curious", ScriptedAction(HELD), OFFERED, OFFERED, "reduce", reprompting=Noting())
    done = line(one, probing=ScriptedProbing((OFFERED,)), action=ScriptedAction(GOOD))
    done.probing.twin = done.twin  # type: ignore[union-attr]
    no = refusal("CHK-SERVICE", "'F.sp' is out of service; a person must bring it back")

    async def once(request: Request, within_s: float) -> Answer:
        refused = request.proposer == "curious"
        status = RequestStatus.REFUSED if refused else RequestStatus.CONFIRMED
        return Answer(request.id, status, done.desk.now.now_s, no if refused else None)

    done.desk.ask = once  # type: ignore[method-assign]
    done.run()
    listed = [a.refused for e in done.trace.of(Compared) for a in e.alternatives if a.kind is AlternativeKind.TEST]
    assert listed[0] == "" and no.message in listed, "not that no reason was given"
    told, again = advised[:2]
    assert told.kind is AlternativeKind.TEST and told.verdict.findings == (no,)
    assert again.verdict.findings[0].criterion == REPEATED, "it is no other test because it is asked for again"
    assert len(done.trace.of(Probed)) == 1


def test_a_test_that_is_not_on_offer_is_refused() -> None:
    done = curious(OTHER).run()
    refused = next(a for a in done.trace.of(Attempted) if a.what is AlternativeKind.TEST)
    assert not refused.approved and refused.findings[0].criterion == TEST
    assert by(done) == [("scripted", GOOD.digest)] and not done.trace.of(Probed)
