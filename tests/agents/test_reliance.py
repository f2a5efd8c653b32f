"""What nobody has seen move is not counted on: by the search, by no proposer, and past no release check.

A pressure that is raised to 240 bar overshoots: the relief, which has never opened, catches it below 250 bar.
"""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import pytest

from homeostat.agents.checks import judge
from homeostat.agents.reliance import UNSEEN, Bench, Relied, Relying, keeping, relied_on, unseen
from homeostat.agents.roles import Approved
from homeostat.domain.advice import Advice
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise, Rollout, RolloutResult
from homeostat.guard.requests.seal import Sealer
from homeostat.recovery.release_check import ReleaseCheck
from homeostat.twin.resting import resting
from homeostat.twin.twin import Interruption, Twin
from tests.agents.resting_skid import (
    DIAGNOSIS,
    LIMIT,
    NOW_S,
    ONSET_S,
    RELIEF,
    WEAK,
    adjust,
    raised,
    search,
    simulation,
    situation,
    skid,
    twin,
)  # fmt: skip

ALONE = ActionSet((), "normal")
HIGH = raised(p1_sp=240.0)


def adjusted() -> State:
    return skid().description.machine.state("adjusted")


def asked(actions: ActionSet, *beside: ActionSet, ended: Interruption | None = None) -> Relying:
    return Relying(actions, (adjusted(),), beside or (ALONE,), ended)


def relied(on: Twin, what: Relying, diagnosis: Diagnosis = DIAGNOSIS) -> Relied:
    d = skid().description
    bench = Bench.of(on, diagnosis.hypotheses, d.limits, d.scales)
    return relied_on(what, on.roll_out(what.actions, diagnosis.hypotheses, what.ended), bench)


def test_a_relief_that_never_opened_is_at_rest_and_nothing_else_is() -> None:
    (found,) = twin(WEAK).resting
    assert (found.actuator, found.manual, found.command, found.rest) == (RELIEF, "V3.man", "V3.cmd", 0.0)


def test_one_that_opened_once_has_been_seen_however_long_ago() -> None:
    """Its position and its command have to have moved: an outlier of an instrument shows nothing."""
    d, variables = skid().description, skid().description.variables
    reached = {variables[tag]: (0.0, 0.0) for tag in ("V3.cmd", "V3.pos")}
    assert [x.actuator for x in resting(d, reached)] == [RELIEF]
    for tag in ("V3.cmd", "V3.pos"):
        assert [x.actuator for x in resting(d, reached | {variables[tag]: (0.0, 0.3)})] == [RELIEF]
    both = {variables[tag]: (0.0, 0.3) for tag in ("V3.cmd", "V3.pos")}
    assert resting(d, both) == () and resting(d, {}) == ()
    assert resting(d, {variables["V3.cmd"]: (math.nan, math.nan)}) == ()
    (open_,) = resting(d, {variables["V3.cmd"]: (1.0, 1.0)})
    assert open_.rest == 1.0, "a spill valve that is always open rests as well"
    assert resting(d, {variables["V3.cmd"]: (0.5, 0.5)}) == (), "half open is no end"


def test_what_is_approved_only_with_the_relief_is_refused_and_says_so() -> None:
    d, on = skid().description, twin(WEAK)
    rollout = on.roll_out(HIGH, DIAGNOSIS.hypotheses)
    assert isinstance(judge(HIGH, rollout, d.limits, adjusted(), d.tags_by_name), Approve)
    found = relied(on, asked(HIGH))
    assert found.members.all() and found.findings[0].criterion == UNSEEN
    assert found.findings[0].message.startswith("counts on V3 moving, which nobody has seen: else")
    assert [f.criterion for f in found.findings[1:]] == ["LIM-P-HIGH"], "a search asks for what is missing of it"


def test_what_keeps_the_limit_without_it_is_not() -> None:
    found = relied(twin(WEAK), asked(raised(p1_sp=220.0)))
    assert not found.findings and not found.members.any()


def test_what_is_commanded_of_the_relief_by_hand_counts_on_it_as_well() -> None:
    """The pump at full speed, and the relief opened for it: where it does not open, the pressure has no end."""
    both = raised(P2_man=1.0, V3_man=1.0)
    assert relied(twin(WEAK), asked(both)).findings


def test_opening_it_by_hand_is_admitted_where_it_is_all_that_is_done() -> None:
    """The pump runs away: with the relief where it is the limit is violated with it and without it."""
    stuck = FaultState("P2_stuck_open", 1.0, NOW_S + 60.0)
    diagnosis = Diagnosis(float(NOW_S), (), (Hypothesis((stuck,), 1.0),))
    on, drained = twin(), raised(V3_man=1.0)
    kept = on.roll_out(drained, diagnosis.hypotheses).trajectory.signals["p1"].max()
    held = on.roll_out(keeping(drained, on.resting), diagnosis.hypotheses).trajectory.signals["p1"].max()
    assert kept < LIMIT < held
    assert not relied(on, asked(drained), diagnosis).findings


def test_falling_back_that_counts_on_it_as_much_is_no_reason_either() -> None:
    assert not relied(twin(WEAK), asked(HIGH, ALONE, raised(p1_sp=244.0))).findings
    assert relied(twin(WEAK), asked(HIGH, ALONE, raised(p1_sp=210.0))).findings


def test_what_ends_before_it_is_needed_is_not_refused() -> None:
    back = Interruption(5.0, raised(p1_sp=200.0))
    assert not relied(twin(WEAK), asked(HIGH, ended=back)).findings
    assert relied(twin(WEAK), asked(raised(p1_sp=200.0), ended=Interruption(60.0, raised(P2_man=1.0)))).findings


def test_what_a_state_commands_by_design_is_ordinary_operation() -> None:
    """As the valves of a batch, each of which is closed until its step comes."""
    elements = twin(WEAK).resting
    designed = replace(adjusted(), setpoints=(SetpointRange("V3.man", 0.0, 1.0, 1.0),))
    assert unseen(elements, (adjusted(),)) == elements and unseen(elements, (adjusted(), designed)) == ()


@pytest.mark.parametrize("others", [False, True])
def test_where_the_twin_breaks_down_with_it_held_it_is_refused_unless_others_do_as_well(others: bool) -> None:
    on, d = twin(WEAK), skid().description
    bench = Bench.of(on, DIAGNOSIS.hypotheses, d.limits, d.scales)

    def roll_out(actions: ActionSet, ended: Interruption | None) -> Rollout:
        rollout = on.roll_out(actions, DIAGNOSIS.hypotheses)
        broke = replace(rollout, weights=(), result=RolloutResult.BROKE_DOWN)
        return broke if others or actions.target == "adjusted" else rollout

    found = relied_on(asked(HIGH), on.roll_out(HIGH, DIAGNOSIS.hypotheses), replace(bench, roll_out=roll_out))
    assert bool(found.findings) is not others


def test_the_search_finds_what_does_not_count_on_it() -> None:
    on = twin(WEAK)
    found = asyncio.run(search(on).act(situation(), adjust(), Advice()))
    command = found.command("p1.sp")
    assert command is not None and command.value is not None and command.value > 205.0, "it is worth raising"
    alone = on.roll_out(keeping(found, on.resting), DIAGNOSIS.hypotheses)
    assert alone.trajectory.signals["p1"].max() <= LIMIT
    told = asked(found), on.roll_out(found, DIAGNOSIS.hypotheses)
    assert asyncio.run(simulation(on).relied_on(DIAGNOSIS, *told)) == ()


def test_no_release_check_lets_it_pass_whoever_proposed_it() -> None:
    d, on = skid().description, twin(WEAK)
    check = ReleaseCheck(on, d.limits, d.tags_by_name, Sealer("check", b"key").seal)

    def checked(actions: ActionSet) -> Approve | Revise:
        found = Approved(actions, adjust(), Approve(actions.digest, ()), "language", Cost((), 1.0), instead=(ALONE,))
        last = situation().snapshot
        return check.check((replace(last, at_s=last.at_s + 1.0),), found, DIAGNOSIS).verdict

    refused = checked(HIGH)
    assert isinstance(refused, Revise) and refused.violated[0].criterion == UNSEEN
    passed = checked(raised(p1_sp=215.0))
    assert isinstance(passed, Approve) and passed.certificate is not None
    assert ONSET_S < NOW_S
