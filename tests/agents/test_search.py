"""The deterministic proposer: the least risky open path, and the best commands that it finds."""

from __future__ import annotations

import asyncio
import functools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.checks import command_findings, judge
from homeostat.agents.hypotheses import MOST, PLAUSIBLE, plausible, plausible_faults
from homeostat.agents.roles import Approved, NoAdmissiblePlan, Situation
from homeostat.agents.search.candidates import Point, SearchSpace
from homeostat.agents.search.cost import heading
from homeostat.agents.search.planning import SearchPlanning
from homeostat.agents.search.reprompting import CURABLE, TRIES, MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.domain.advice import Advice
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Approve, Revise
from homeostat.guard.requests.seal import Sealer, genuine
from homeostat.recovery.release_check import Checked, ReleaseCheck
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, QUICK, grounding, now, search, stuck
from tests.contracts.reprompting import advise, finding
from tests.twin.followed import follow, reactor

# --- planning ---------------------------------------------------------------------------------------------------


def situation(fault: str | None, state: str = "normal", probability: float = 0.9, **values: float) -> Situation:
    faults = (FaultState(fault, reactor().description.fault(fault).severity_nominal, 1450.0),) if fault else ()
    snapshot = replace(now().snapshot, values=dict(now().snapshot.values) | values)
    rest = (Hypothesis((), 1.0 - probability),) if faults else ()
    return replace(
        now(), snapshot=snapshot, state=state, diagnosis=Diagnosis(0.0, (), (Hypothesis(faults, probability), *rest))
    )


def planned(at: Situation) -> list[str]:
    """The targets that are proposed one after the other, each refused."""
    planning, refused, targets = SearchPlanning(reactor().description, grounding()), Advice(), []
    for _ in range(20):
        try:
            path = asyncio.run(planning.plan(at, refused))
        except NoAdmissiblePlan:
            return targets
        targets.append(path.target)
        refused = Advice(refused_paths=(*refused.refused_paths, path.commanded))
    raise AssertionError("planning never ends")


def risk(target: str) -> int:
    return reactor().description.machine.state(target).risk


@pytest.mark.parametrize("fault", [None, "fouling", "pump_degrade", "cool_stuck_closed", "inlet_stuck_open"])
def test_targets_come_once_each_and_the_least_risky_first(fault: str | None) -> None:
    targets = planned(situation(fault))
    assert targets and len(set(targets)) == len(targets)
    assert [risk(t) for t in targets] == sorted(risk(t) for t in targets)


@pytest.mark.parametrize("fault", [f.name for f in reactor().description.faults])
def test_no_state_is_proposed_that_needs_what_the_fault_disables(fault: str) -> None:
    disabled = reactor().description.fault(fault).disables
    for target in planned(situation(fault)):
        assert disabled not in reactor().description.machine.state(target).requires
    if disabled is None:
        assert planned(situation(fault)) == planned(situation(None))


PROBABILITIES = [(0.9, True), (PLAUSIBLE, True), (PLAUSIBLE - 1e-9, False), (0.001, False)]


@pytest.mark.parametrize(("probability", "counts"), PROBABILITIES)
def test_a_fault_that_is_hardly_believed_takes_nothing_away(probability: float, counts: bool) -> None:
    believed = situation("cool_stuck_closed", probability=probability)
    assert plausible_faults(believed.diagnosis) == (("cool_stuck_closed",) if counts else ())
    assert ("compensated" in planned(believed)) is not counts


def test_a_guard_that_does_not_hold_closes_its_paths() -> None:
    assert planned(situation("fouling", T1=400.0)) == []
    assert set(planned(situation("fouling", L1=11.5))) == {"holding"}


def test_where_nothing_is_left_the_reason_names_what_was_refused() -> None:
    planning = SearchPlanning(reactor().description, grounding())
    everything = Advice(refused_paths=tuple((t,) for t in ("compensated", "reduced_load", "holding")))
    with pytest.raises(NoAdmissiblePlan, match=r"'normal'.*fouling.*compensated, holding, reduced_load"):
        asyncio.run(planning.plan(situation("fouling"), everything))


# --- search -----------------------------------------------------------------------------------------------------


def reduce() -> RecoveryPath:
    machine = reactor().description.machine
    return RecoveryPath(machine, (next(t for t in machine.transitions if t.name == "t_reduce"),))


NOTHING = Cost((), 1.0)
"""What the release check has no eye for."""


@functools.cache
def found() -> ActionSet:
    return asyncio.run(search().act(now(), reduce(), Advice()))


def test_the_search_finds_what_validation_approves() -> None:
    """A valve stuck at 30 %: less feed is needed, and most of the production can be kept."""
    d = reactor().description
    twin = follow(stuck()[:NOW_S])
    rollout = asyncio.run(TwinSimulation(twin, d.tags_by_name, d.limits).roll_out(DIAGNOSIS, found()))
    verdict = judge(found(), rollout, d.limits, d.machine.state("reduced_load"), d.tags_by_name)
    assert isinstance(verdict, Approve), [f.message for f in verdict.violated]
    feed = found().command("F1.sp")
    assert feed is not None and feed.value is not None and 0.018 <= feed.value < 0.0333


def test_the_same_question_has_the_same_answer() -> None:
    one, two = (asyncio.run(search(QUICK).act(now(), reduce(), Advice())) for _ in range(2))
    assert one == two and one.digest == two.digest


@functools.cache
def careful() -> ActionSet:
    """What is found where 1.5 K more are asked for."""
    wanted = Advice(keep_path=reduce(), tries=1, required=(("ACC-T-HIGH", 1.5), ("LIM-T-HIGH", 1.5)))
    return asyncio.run(search().act(now(), reduce(), wanted))


def test_more_margin_costs_production() -> None:
    before, after = (a.command("F1.sp") for a in (found(), careful()))
    assert before is not None and after is not None and before.value is not None and after.value is not None
    assert after.value < before.value


def test_the_release_check_repeats_what_validation_said() -> None:
    d = reactor().description
    twin = follow(stuck()[:NOW_S])
    check = ReleaseCheck(twin, d.limits, d.tags_by_name, Sealer("check", b"key").seal)

    def checked(actions: ActionSet) -> Checked:
        approval = Approve(actions.digest, ())
        return check.check(stuck()[NOW_S:], Approved(actions, reduce(), approval, "search", NOTHING), DIAGNOSIS)

    passed = checked(careful())
    assert isinstance(passed.verdict, Approve) and passed.request is not None
    assert passed.request.actions == careful() and genuine(passed.request, b"key")
    refused = checked(ActionSet((), "reduced_load"))
    assert isinstance(refused.verdict, Revise) and refused.request is None, "without action it gets too hot"


# --- candidates -------------------------------------------------------------------------------------------------

SPACE = SearchSpace(reactor().description.machine.state("reduced_load"), reactor().description.tags_by_name)
FRACTIONS = st.floats(0.0, 1.0)


@st.composite
def points(draw: st.DrawFn) -> Point:
    return tuple(
        None if r.design is None and draw(st.booleans()) else r.low + draw(FRACTIONS) * (r.high - r.low)
        for r in SPACE.ranges
    )


def inside(point: Point, ranges: tuple[SetpointRange, ...]) -> bool:
    return all(v is None or r.low <= v <= r.high for r, v in zip(ranges, point, strict=True)) and all(
        v is not None or r.design is None for r, v in zip(ranges, point, strict=True)
    )


@given(points(), st.floats(1e-4, 0.5))
def test_every_candidate_is_admissible(point: Point, fraction: float) -> None:
    for candidate in (point, *SPACE.around(point, fraction)):
        assert inside(candidate, SPACE.ranges)
        assert command_findings(SPACE.actions(candidate), SPACE.state, SPACE.tags) == ()


@given(points())
def test_the_first_candidates_are_admissible_and_contain_the_design_and_the_present(point: Point) -> None:
    first = SPACE.first(point)
    assert {SPACE.design, point} <= set(first) and len(set(first)) == len(first)
    assert all(inside(p, SPACE.ranges) for p in first)


@given(points(), st.floats(-1.0, 2.0))
def test_a_manual_output_is_tried_where_its_controller_has_it_now(point: Point, now: float) -> None:
    column = [r.tag for r in SPACE.ranges].index("V2.man")
    first = SPACE.first(point, commanded={"V2.man": now})
    assert all(inside(p, SPACE.ranges) for p in first)
    for base in (SPACE.design, point):
        assert (*base[:column], min(max(now, 0.0), 1.0), *base[column + 1 :]) in first
    assert SPACE.first(point, commanded={"V2.man": math.nan, "V1.cmd": 0.3}) == SPACE.first(point)


@given(points(), points())
def test_a_gap_is_a_distance(one: Point, other: Point) -> None:
    assert SPACE.gap(one, one) == 0.0 and SPACE.gap(one, other) == pytest.approx(SPACE.gap(other, one))
    assert SPACE.gap(one, other) >= 0.0 and SPACE.distance(SPACE.design) == 0.0


@given(st.dictionaries(st.sampled_from([r.tag for r in SPACE.ranges]), st.floats(-1e6, 1e6) | st.just(math.nan)))
def test_the_present_point_is_brought_into_the_ranges(values: dict[str, float]) -> None:
    point = SPACE.present(values)
    assert inside(point, SPACE.ranges)
    for r, v in zip(SPACE.ranges, point, strict=True):
        if r.low <= values.get(r.tag, math.nan) <= r.high:
            assert v == values[r.tag]


# --- where a rollout is heading ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("course", "share"),
    [
        ([1.0] * 60, 0.0), (np.linspace(1.0, 0.0, 61)[1:], 1.0), (np.linspace(0.0, 1.0, 60), 0.0),
        (np.linspace(2.0, 1.0, 61)[1:], 0.0), (np.linspace(1.5, 0.5, 61)[1:], 0.5), ([math.inf] * 60, 0.0),
        ([math.nan] * 60, 0.0), (np.linspace(1.0, -1.0, 60), 1.0), ([3.0], 0.0), ([3.0, 1.0], 0.5),
        ([*np.linspace(5.0, 1.0, 30), *[1.0] * 30], 0.0),
    ],
)  # fmt: skip
def test_what_heads_for_a_limit_is_there_so_much_sooner_than_after_as_long_again(
    course: Sequence[float], share: float
) -> None:
    """A margin of 1.5 that has come to 0.5 is gone after half as long again; one that stands is never gone."""
    found = heading(np.array([course, [1.0] * len(course)]))
    assert found == pytest.approx([share, 0.0], abs=0.1)


# --- reprompting and hypotheses ---------------------------------------------------------------------------------

REPROMPTING = MarginReprompting({"K": 2.0})


def test_a_small_violation_keeps_the_path_and_asks_for_more() -> None:
    verdict = Revise((finding(-0.1), finding(5.0, name="FINE")))
    advice = advise(REPROMPTING, reduce(), verdict, Advice())
    assert advice.keep_path == reduce() and advice.tries == 1 and advice.refused_paths == ()
    ((name, wanted),) = advice.required
    assert name == "ACC-T-HIGH" and wanted > 0.1
    again = advise(REPROMPTING, reduce(), verdict, advice)
    assert again.tries == 2 and dict(again.required)["ACC-T-HIGH"] > wanted, "each time it asks for more"


def test_a_path_is_given_up_after_some_tries() -> None:
    advice, tries = Advice(), 0
    while advice.keep_path is not None or tries == 0:
        advice = advise(REPROMPTING, reduce(), Revise((finding(-1e-9),)), advice)
        tries += 1
    assert tries == TRIES and advice.refused_paths == (reduce().commanded,) and advice.required == ()


EDGE = -CURABLE * 2.0


@pytest.mark.parametrize(("margin", "kept"), [(EDGE, True), (math.nextafter(EDGE, -9.0), False), (-math.inf, False)])
def test_a_large_violation_asks_for_another_path(margin: float, kept: bool) -> None:
    advice = advise(REPROMPTING, reduce(), Revise((finding(margin),)), Advice())
    assert (advice.keep_path is not None) is kept
    assert advice.refused_paths == (() if kept else (reduce().commanded,))


def test_what_only_planning_can_cure_asks_for_another_path() -> None:
    advice = advise(REPROMPTING, reduce(), Revise((finding(-1e-6, Owner.PLANNING),)), Advice())
    assert advice.keep_path is None and advice.refused_paths == (reduce().commanded,)


def test_an_approval_needs_no_advice() -> None:
    assert advise(REPROMPTING, reduce(), Approve("x", ()), Advice(tries=2)) == Advice()


@given(st.lists(st.floats(0.0, 0.1) | st.floats(0.0, 1.0), max_size=30))
def test_what_is_plausible_is_tried_and_never_nothing(weights: list[float]) -> None:
    hypotheses = tuple(Hypothesis((FaultState(f"f{k}", 1.0, 0.0),), w) for k, w in enumerate(weights))
    kept = plausible(Diagnosis(0.0, (), hypotheses))
    assert 1 <= len(kept) <= MOST
    if any(w >= PLAUSIBLE for w in weights):
        assert all(h.probability >= PLAUSIBLE for h in kept)
        assert kept[0].probability == max(weights), "the most probable one is always among them"
        left = sorted((w for w in weights if w >= PLAUSIBLE), reverse=True)[: len(kept)]
        assert [h.probability for h in kept] == left
    elif weights:
        assert [h.probability for h in kept] == [max(weights)], "one fault at least, and not health"
    else:
        assert kept == (Hypothesis((), 1.0),)


@pytest.mark.parametrize("size", [8, 12, 40])
def test_a_state_of_many_setpoints_is_searched_like_one_of_few(size: int) -> None:
    """Nothing limits how much a state admits: points reach everywhere, and are few enough to be tried."""
    state, tag = SPACE.state, SPACE.tags["T1.sp"]
    ranges = tuple(SetpointRange(f"X{k}.sp", 0.0, 1.0, 0.5) for k in range(size))
    wide = SearchSpace(replace(state, setpoints=ranges), {r.tag: replace(tag, name=r.tag) for r in ranges})
    first, near = wide.first(wide.design), wide.around(wide.design, 0.1)
    assert all(inside(p, ranges) for p in (*first, *near)) and wide.design in near
    scattered = [p for p in first if all(v != 0.5 for v in p)]
    assert len(scattered) >= 20
    for k in range(size):
        low, *_, high = sorted(p[k] for p in scattered if p[k] is not None)
        assert low < 0.2 and high > 0.8, f"dimension {k} is looked at from {low:.2f} to {high:.2f} alone"
    assert len(near) <= 1 + 2 * size * size and len(set(near)) == len(near)


# --- the last decision -------------------------------------------------------------------------------------------


def test_a_search_begins_with_what_the_last_decision_found() -> None:
    """A point between those that are tried anyway: whoever has found it tries it again on the plant as it is now."""
    one, other = search(QUICK), search(QUICK)
    at = now()
    way = asyncio.run(SearchPlanning(reactor().description, grounding()).plan(at, Advice()))
    for action in (one, other):
        asyncio.run(action.act(at, way, Advice()))
        action._twin.observe(stuck()[NOW_S])
    assert one._last == other._last and way.target in one._last
    first, *rest = one._last[way.target].commands
    assert first.tag == "F1.sp" and first.value is not None
    between = replace(one._last[way.target], commands=(replace(first, value=first.value + 1.23e-4), *rest))
    one._last[way.target] = between
    after = replace(at, snapshot=stuck()[NOW_S], recent=stuck()[: NOW_S + 1])
    for action in (one, other):
        asyncio.run(action.act(after, way, Advice()))
    held = next(c for c in one._last[way.target].commands if c.tag == "V2.man")  # the valve is held elsewhere by now
    settled = replace(between, commands=tuple(held if c.tag == held.tag else c for c in between.commands))
    assert one.margins(settled) and not other.margins(settled)


def test_what_the_last_decision_found_is_a_bound_of_what_its_path_costs() -> None:
    action, at = search(QUICK), now()
    way = asyncio.run(SearchPlanning(reactor().description, grounding()).plan(at, Advice()))
    (cold,) = asyncio.run(action.bounds(at, [way]))
    asyncio.run(action.act(at, way, Advice()))
    (warm,) = asyncio.run(action.bounds(at, [way]))
    assert warm <= cold
