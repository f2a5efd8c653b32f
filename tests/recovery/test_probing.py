"""Test moves and waits: released like everything else, ended for sure, never repeated in vain, never without time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import pytest

from homeostat.agents.roles import Probe, Situation
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.cost import KNOWING
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.events.recovery import Attempted, Compared, Diagnosed, Probed, ProbeEnded, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Arm
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import Rollout
from homeostat.links.clock import DeclaredClock
from homeostat.record.story.story import Story
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from homeostat.twin.twin import Interruption
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring
from tests.recovery.desk import PlanningByState, Recovery, latched, nothing, ticks, watching
from tests.recovery.line import COOLING, GOOD, LineTwin, Stage, feed, safe
from tests.twin.followed import reactor

NEAR, TOO_NEAR = 309.0, 311.5
"""Without action the limit of 313 K is violated in 40 s, in 15 s [K]."""
SHORT = Bounds(intervention=InterventionBounds(probes=2, probe_s=5.0, answer_s=5.0))
REDUCE = RecoveryPath(COOLING, (next(t for t in COOLING.transitions if t.name == "reduce"),))
LITTLE = Probe(feed(0.02, "reduced"), REDUCE, ("warm", "dirty"), 4.0, 0.3, 0.01)
"""Heats on at a third of the speed: never to the limit within the horizon."""
HEATING = Probe(feed(0.04, "reduced"), REDUCE, ("warm", "dirty"), 9.0, 0.5, 0.01)
"""Heats at 0.17 K/s: through the limit from 309 K if it goes on, not within 12 s."""
RUINOUS = Probe(feed(0.05, "reduced"), REDUCE, ("warm", "dirty"), 20.0, 0.9, 0.01)
WAIT = Probe(ActionSet((), "running"), None, ("warm", "dirty"), 1.0, 0.2, 0.001)


def unsure(at_s: float) -> Diagnosis:
    """Two explanations."""
    sets = (("warm", 0.6), ("dirty", 0.4))
    return Diagnosis(at_s, (), tuple(Hypothesis((FaultState(name, 1.0, 0.0),), p) for name, p in sets))


def sure(at_s: float) -> Diagnosis:
    return Diagnosis(at_s, (), (Hypothesis((FaultState("dirty", 1.0, 0.0),), 1.0),))


@dataclass
class ScriptedProbing:
    """Offers the same probes in each look."""

    offered: tuple[Probe, ...]
    twin: LineTwin = field(default_factory=LineTwin)
    asked: list[float] = field(default_factory=list)

    async def probes(self, situation: Situation, idle: ActionSet, seconds: float) -> tuple[Probe, ...]:
        self.asked.append(situation.snapshot.at_s)
        return self.offered

    async def try_out(self, probe: Probe, diagnosis: Diagnosis, ended: Interruption) -> Rollout:
        return self.twin.roll_out(probe.actions, diagnosis.hypotheses, ended)


def line(*offered: Probe, hot: float = NEAR, last: int = 30, until_s: float = 12.0, bounds: Bounds = SHORT) -> Recovery:
    """A line that is looked at from 10 s on, and about which it is known from ``until_s`` on what is wrong [s]."""
    monitoring = watching(10.0, answer=lambda at_s: unsure(at_s) if at_s < until_s else sure(at_s))
    made = Recovery(ticks(1, last, hot), monitoring, bounds=bounds, probing=ScriptedProbing(offered))
    made.probing.twin = made.twin  # type: ignore[union-attr]
    return made


def begun(done: Recovery) -> list[float]:
    return done.when(Probed)


def test_a_test_move_is_released_like_everything_else_and_then_looked_at() -> None:
    done = line(LITTLE).run()
    assert begun(done) == [10.0] and done.released[0] == 10.0
    assert done.kinds == [
        "noticed", "diagnosed", "foreseen", "fallback-armed", "attempted", "compared", "probed", "foreseen",
        "released",
        "noticed", "diagnosed", "probe-ended", "foreseen", "fallback-armed", "attempted", "compared", "foreseen",
        "released",
    ]  # fmt: skip
    assert done.when(ProbeEnded) == [15.0] and done.when(Diagnosed) == [10.0, 15.0]
    (end,) = done.trace.of(ProbeEnded)
    assert (end.apart, end.likeliest, end.told) == (("warm", "dirty"), "dirty", True)
    (probed,) = done.trace.of(Probed)
    assert probed.state == "reduced" and probed.seconds == 5.0 and probed.nats == 4.0


@pytest.mark.parametrize(("probe", "kind"), [(LITTLE, AlternativeKind.TEST), (WAIT, AlternativeKind.WAIT)])
def test_what_is_begun_stands_in_a_list_with_cost_worth_and_certificate(probe: Probe, kind: AlternativeKind) -> None:
    done = line(probe).run()
    compared = done.trace.of(Compared)[0]
    assert done.when(Compared)[0] == begun(done)[0] == 10.0 and compared.currency == "EUR"
    (one,) = [a for a in compared.alternatives if a.digest == compared.chosen]
    assert (one.kind, one.proposer, one.seconds, one.admitted) == (kind, "search", 5.0, True)
    assert {a.kind for a in compared.alternatives} == {kind, AlternativeKind.LEAVE, AlternativeKind.FALLBACK}
    assert all(a.certificate is not None for a in compared.alternatives)
    knowing = {item.name: item.amount for item in one.cost.items}[KNOWING]
    assert knowing == pytest.approx(-probe.value * 3.0), "over 100 s the line makes 3 EUR"
    tried = next(a for a in done.trace.of(Attempted) if a.what is kind)
    assert tried.approved and tried.cost == one.cost and tried.members > 0


def test_a_test_costs_what_is_not_made_and_two_releases_less_what_knowing_is_worth() -> None:
    """At two thirds of the feed 1 EUR of 3 is not made, and 5 s in the state cost 0.0015 EUR."""
    compared = line(LITTLE).run().trace.of(Compared)[0]
    (one,) = [a for a in compared.alternatives if a.kind is AlternativeKind.TEST]
    assert one.cost.total == pytest.approx(1.0 + 0.0015 + 2.0 * 0.27 - 0.9)


def test_a_wait_costs_what_leaving_the_plant_alone_costs_less_what_knowing_is_worth() -> None:
    compared = line(WAIT).run().trace.of(Compared)[0]
    costs = {a.kind: a.cost.total for a in compared.alternatives}
    assert costs[AlternativeKind.WAIT] == pytest.approx(costs[AlternativeKind.LEAVE] - 0.6)


def test_what_the_list_of_a_probe_says_is_told() -> None:
    told = list(Story(reactor().description).tell(line(LITTLE).run().trace.of(Compared)[0], 10.0))
    assert {alternative.label for alternative in told} == {"compared"}
    (test,) = (a.text for a in told if a.text.startswith("test reduced for 5 s by search"))
    assert "with 0.9 EUR taken off for knowing more, risk at most" in test


def test_a_list_is_told_also_where_the_guard_refuses_what_was_chosen_and_the_next_one_is_of_proposals_alone() -> None:
    done = line(LITTLE)
    done.desk.answer = RequestStatus.REFUSED
    first, *later = done.run().trace.of(Compared)
    assert first.chosen == LITTLE.actions.digest and later
    assert not [a for compared in later for a in compared.alternatives if a.kind is AlternativeKind.TEST]


def test_one_that_may_go_on_needs_nobody_to_end_it() -> None:
    done = line(LITTLE).run()
    assert all(len(arm.strategies) == 2 for arm in done.armed), "rankings, and nothing that a probe has armed"


def test_the_guard_is_told_to_end_one_that_must_not_go_on() -> None:
    done = line(HEATING).run()
    assert begun(done) == [10.0]
    ending = [(at_s, arm) for at_s, arm in done.sent(Arm) if len(arm.strategies) == 1]
    assert ending == [(10.0, Arm(("drain",), 20.0))]


def test_one_that_violates_a_limit_before_it_is_ended_is_never_released() -> None:
    done = line(RUINOUS, hot=311.0, bounds=replace(SHORT, intervention=InterventionBounds(probe_s=3.0, answer_s=3.0)))
    done.twin.heating = 0.12
    done.run()
    assert begun(done) == [] and not done.trace.of(ProbeEnded)
    assert done.released == [10.0] and done.kinds.count("attempted") == 1  # by whoever recovers


def test_what_is_safe_is_taken_after_what_is_not() -> None:
    done = line(RUINOUS, LITTLE, hot=310.3).run()
    assert [p.commands for p in done.trace.of(Probed)] == [LITTLE.actions.commands]


def test_nothing_is_tried_where_time_is_short() -> None:
    done = line(LITTLE, WAIT, hot=TOO_NEAR).run()
    assert begun(done) == [] and done.probing.asked == []  # type: ignore[union-attr]
    assert done.released == [10.0], "recovery goes on as ever"


def test_a_wait_writes_nothing_and_ends() -> None:
    done = line(WAIT).run()
    assert begun(done) == [10.0] and done.when(ProbeEnded) == [15.0]
    assert done.released == [15.0] and done.kinds.count("released") == 1
    (probed,) = done.trace.of(Probed)
    assert probed.state == "" and probed.commands == ()


@pytest.mark.parametrize("probe", [WAIT, LITTLE])
def test_what_one_has_shown_says_how_long_there_is_now(probe: Probe) -> None:
    """It was as safe as falling back until then, however it is answered; the time to act by is counted anew."""
    done = line(probe).run()
    assert [arm.anew for arm in done.armed if len(arm.strategies) == 2] == [False, True], "the rankings of two looks"


@pytest.mark.parametrize("probe", [WAIT, LITTLE])
def test_what_told_nothing_is_not_tried_again(probe: Probe) -> None:
    done = line(probe, until_s=1000.0).run()
    assert begun(done) == [10.0] and [e.told for e in done.trace.of(ProbeEnded)] == [False]
    assert done.released, "recovery goes on without knowing"


def test_there_are_only_so_many() -> None:
    others = [replace(LITTLE, actions=feed(0.02 + 0.001 * k, "reduced")) for k in range(5)]
    done = line(*others, until_s=1000.0, last=60)
    done.run()
    assert len(begun(done)) <= 2


def test_a_plant_that_is_well_again_may_be_tested_again() -> None:
    done = line(LITTLE, until_s=1000.0)
    done.run()
    assert done.loop._probes._begun
    done.loop._probes.end(Diagnosis(31.0, (), ()))
    assert not done.loop._probes._begun


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.ADVISE, Mode.APPROVE])
def test_nothing_is_tried_where_a_person_has_the_say(mode: Mode) -> None:
    done = line(LITTLE, WAIT)
    done.desk._ticks = tuple(replace(tick, mode=mode) for tick in done.desk._ticks)
    done.run()
    assert begun(done) == []


def test_one_that_the_guard_refuses_gives_way_to_recovery() -> None:
    done = line(LITTLE)
    done.desk.answer = RequestStatus.REFUSED
    done.run()
    assert "gave-up" in done.kinds and not done.trace.of(ProbeEnded)
    assert [e for e in done.kinds if e == "attempted"], "proposers were asked"


def test_a_fallback_ends_it_without_a_word() -> None:
    done = line(LITTLE, last=12)
    done.run(*latched(13, 30))
    assert begun(done) == [10.0] and not done.trace.of(ProbeEnded)


def test_equal_runs_are_equal() -> None:
    one, other = line(LITTLE, WAIT).run(), line(LITTLE, WAIT).run()
    assert one.trace.entries == other.trace.entries and one.released == other.released


def test_without_probing_nothing_is_tried() -> None:
    done = Recovery(ticks(1, 30, NEAR), watching(10.0, answer=unsure), bounds=SHORT).run()
    assert begun(done) == []


# --- with a guard ----------------------------------------------------------------------------------------------------


def guarded(probe: Probe, thought_s: float) -> Stage:
    """A line with a guard, on which each thought takes so long; it is looked at from 50 s on, at 305 K."""
    return Stage(
        ScriptedAction(GOOD),
        planning=PlanningByState(COOLING),
        machine=COOLING,
        monitoring=ScriptedMonitoring(50.0, answer=unsure),
        clock=DeclaredClock(thought_s),
        bounds=SHORT,
        end_s=150.0,
        probing=lambda twin: ScriptedProbing((probe,), twin),
    ).run()


def test_the_guard_ends_what_must_not_go_on_while_recovery_thinks() -> None:
    stage = guarded(HEATING, thought_s=25.0)
    assert len(stage.trace.of(Probed)) == len(stage.trace.of(ReleasedActions)) == 1
    assert safe(stage) and stage.guard.latched is not None
    probed_s = next(e.at_s for e in stage.trace.entries if isinstance(e.event, ReleasedActions))
    acted_s = next(e.at_s for e in stage.trace.entries if isinstance(e.event, FallbackActivated))
    assert probed_s + 10.0 <= acted_s <= probed_s + 13.0, "when the probe and the time for its answer are over"
    assert max(r.values["T"] for r in stage.plant.readings) < 313.0


def test_the_guard_leaves_what_recovery_answers_in_time() -> None:
    stage = guarded(HEATING, thought_s=1.0)
    assert stage.guard.latched is None and len(stage.trace.of(ProbeEnded)) == 1
    assert len(stage.trace.of(ReleasedActions)) == 2, "the test move, and what recovers the line"
    assert max(r.values["T"] for r in stage.plant.readings) < 313.0


@pytest.mark.parametrize(("answer", "likeliest"), [(sure, "dirty"), (nothing, "none")])
def test_a_test_is_not_forgotten_where_the_diagnosis_after_it_is_late(
    answer: Callable[[float], Diagnosis], likeliest: str
) -> None:
    """The plant stands where the test has brought it, which is nowhere to stay, be anything wrong or not."""
    go_on, ended = threading.Event(), threading.Event()

    def late(at_s: float) -> Diagnosis:
        if at_s < 12.0:
            return unsure(at_s)
        go_on.wait(20.0)
        ended.set()
        return answer(at_s)

    bounds = replace(SHORT, budget=Budget(diagnosis_s=0.2))
    done = Recovery(ticks(1, 20, NEAR), watching(10.0, answer=late), bounds=bounds, probing=ScriptedProbing((LITTLE,)))
    done.probing.twin = done.twin  # type: ignore[union-attr]
    assert begun(done.run()) == [10.0] and done.when(ProbeEnded) == [] and done.released == [10.0]
    assert [name for name, _ in done.alarms] == ["recovery:diagnosis"], (
        "one look in vain, and no other until it is there"
    )
    go_on.set()
    assert ended.wait(20.0)
    time.sleep(0.1)  # until the thread has said so
    done.run(*ticks(21, 30, NEAR))
    end = done.trace.of(ProbeEnded)[0]
    assert (end.likeliest, end.told) == (likeliest, True) and done.when(ProbeEnded)[0] == 21.0
    assert done.released[:2] == [10.0, 21.0]
