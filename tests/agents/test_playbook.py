"""What is near is found, the nearest first; what does not fit the plant, or failed, is not proposed."""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import Mapping
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.agents.playbook.book import STARTS
from homeostat.agents.playbook.distance import FAR, Measure, Point, distance
from homeostat.agents.playbook.proposer import remembering
from homeostat.agents.roles import Action, NoAdmissiblePlan, Planning, Situation
from homeostat.agents.search.candidates import SearchSpace
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.recovery import LaterStep
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.tag import Tag
from homeostat.domain.playbook import Aftermath, Ending, Occasion, Setpoint
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise
from tests.agents.entries import ANSWER, COMMANDS, book, entry, moved, occasion, situation, stuck
from tests.contracts.action import ActionContract
from tests.contracts.planning import PlanningContract
from tests.twin.followed import reactor

LEAKS = Hypothesis((FaultState("leak", 0.005, 0.0),), 1.0)
MEASURE = Measure(reactor().description)


def between(one: Occasion, other: Occasion) -> float:
    return distance(MEASURE.point(one), MEASURE.point(other))


# --- distance ----------------------------------------------------------------------------------------------------


def test_the_distance_is_what_its_page_says_by_hand() -> None:
    assert between(occasion(stuck(0.7)), occasion(stuck(0.6))) == pytest.approx(0.1 / (0.95 / 4))
    doubtful = occasion(stuck(0.7, 0.7), replace(LEAKS, probability=0.3))
    assert between(occasion(stuck(0.7)), doubtful) == pytest.approx(0.3)
    assert between(occasion(), occasion(F1_sp=1 / 30 - 0.0104444)) == pytest.approx(1 / 3, rel=1e-3)
    assert between(occasion(), occasion(V2_man=0.3)) == 1.0, "automatic is 1 from any value"


def test_several_sizes_of_one_fault_count_by_their_mean() -> None:
    spread = occasion(stuck(0.6, 0.25), stuck(0.7, 0.5), stuck(0.8, 0.25))
    assert between(spread, occasion(stuck(0.7))) == pytest.approx(0.0)


def test_when_a_fault_began_does_not_count() -> None:
    assert between(occasion(stuck(0.7, onset_s=3.0)), occasion(stuck(0.7, onset_s=5000.0))) == 0.0


@pytest.mark.parametrize("other", [occasion(state="reduced_load"), occasion(LEAKS), occasion(Hypothesis((), 1.0))])
def test_another_state_and_another_likeliest_fault_are_not_comparable(other: Occasion) -> None:
    assert between(occasion(), other) == math.inf


NAMES = ("cool_stuck_closed", "leak", "temp_bias")
SIZES = st.floats(0.05, 1.0)
SETS = st.sets(st.sampled_from(NAMES)).map(sorted)


@st.composite
def occasions(draw: st.DrawFn) -> Occasion:
    faults = draw(st.lists(SETS, min_size=1, max_size=4))
    made = tuple(
        Hypothesis(tuple(FaultState(n, draw(SIZES), 0.0) for n in names), draw(st.floats(0.01, 1.0)))
        for names in faults
    )
    stands = {tag: draw(st.one_of(st.none(), st.floats(0.0, 320.0))) for tag in ("F1.sp", "L1.sp", "T1.sp", "V2.man")}
    return Occasion("normal", "closed-loop", made, tuple(Setpoint(*each) for each in stands.items()))


@given(occasions(), occasions(), occasions())
@settings(max_examples=300, deadline=None)
def test_the_distance_is_a_metric_on_occasions_of_a_kind(a: Occasion, b: Occasion, c: Occasion) -> None:
    points = [MEASURE.point(each) for each in (a, b, c)]
    kind = points[0].kind
    alike: list[Point] = [replace(p, kind=kind, sizes=p.sizes if p.kind == kind else points[0].sizes) for p in points]
    for one in alike:
        assert distance(one, one) == 0.0
    for one, other in itertools.permutations(alike, 2):
        assert distance(one, other) == distance(other, one) >= 0.0
    for one, other, third in itertools.permutations(alike, 3):
        assert distance(one, third) <= distance(one, other) + distance(other, third) + 1e-9


@given(occasions(), st.permutations(range(4)))
@settings(deadline=None)
def test_the_order_of_hypotheses_does_not_count(one: Occasion, order: list[int]) -> None:
    some = [one.hypotheses[k] for k in order if k < len(one.hypotheses)]
    assert between(one, replace(one, hypotheses=tuple(some))) == pytest.approx(0.0, abs=1e-9)


# --- what is near ------------------------------------------------------------------------------------------------


def test_what_failed_here_is_not_proposed_because_it_helped_elsewhere() -> None:
    """The same commands: whoever has another entry of them has nothing else to say."""
    failed = Aftermath(Ending.FELL_BACK, 30.0, None)
    bad, good = entry(stuck(0.7), aftermath=failed, source="bad"), entry(stuck(0.6), source="good")
    assert book(bad, good).near(situation(stuck(0.7))) == []
    assert [known.entry.source for _, known in book(bad, good).near(situation(stuck(0.6)))] == ["good"]
    other = entry(stuck(0.6), answer=moved(0.019), source="other")
    assert [known.entry.source for _, known in book(bad, other).near(situation(stuck(0.7)))] == ["other"]


def test_the_nearest_comes_first_and_what_is_far_does_not_come() -> None:
    sizes = (0.5, 0.72, 0.4, 0.6)
    found = book(*(entry(stuck(size), source=f"{size}") for size in sizes)).near(situation())
    assert [known.entry.source for _, known in found] == ["0.72", "0.6", "0.5"]
    assert [d for d, _ in found] == sorted(d for d, _ in found) and found[-1][0] <= FAR


def test_of_equals_the_latest_comes_first() -> None:
    found = book(entry(source="before"), entry(source="after")).near(situation())
    assert [known.entry.source for _, known in found] == ["after", "before"]


@pytest.mark.parametrize(
    "useless",
    [
        entry(answer=None, reason="no answer"),
        entry(aftermath=Aftermath(Ending.FELL_BACK, 30.0, -1.0)),
    ],
    ids=["unanswered", "failed"],
)
def test_what_has_no_answer_or_failed_is_not_near_and_no_trouble(useless: object) -> None:
    made = book(useless)  # type: ignore[arg-type]
    assert (made.near(situation()), len(made), made.troubles) == ([], 0, ())


STEP = LaterStep("t_of_another_plant", "true", "normal", ())
MISFITS = {
    "state": (entry(occasion=replace(occasion(), state="cruising")), "no state 'cruising'"),
    "fault": (entry(Hypothesis((FaultState("rust", 1.0, 0.0),), 1.0)), "no fault 'rust'"),
    "setpoint": (entry(occasion=replace(occasion(), setpoints=(Setpoint("T9.sp", 1.0),))), "'T9.sp'"),
    "tag": (entry(answer=replace(ANSWER, commands=(replace(COMMANDS[0], tag="T9.sp"),))), "no tag 'T9.sp'"),
    "transition": (entry(answer=replace(ANSWER, then=(STEP,))), "no transition 't_of_another_plant'"),
    "path": (entry(answer=replace(ANSWER, path=("normal", "starting"), target="starting")), "no decision"),
    "nowhere": (entry(answer=replace(ANSWER, path=("normal",), target="normal")), "at least one transition"),
    "empty path": (entry(answer=replace(ANSWER, path=(), target="normal")), "at least one transition"),
    "target": (entry(answer=replace(ANSWER, target="holding")), "do not take the path"),
    "twice": (entry(answer=replace(ANSWER, commands=(*COMMANDS, COMMANDS[0]))), "more than once"),
    "elsewhere": (entry(occasion=replace(occasion(), state="holding")), "do not take the path"),
    "impossible": (entry(stuck(0.5, 0.0)), "none of its hypotheses"),
    "no hypothesis": (entry(occasion=replace(occasion(), hypotheses=())), "none of its hypotheses"),
}


@pytest.mark.parametrize(("misfit", "why"), MISFITS.values(), ids=MISFITS)
def test_what_the_plant_has_no_words_for_is_told_and_left_out(misfit: object, why: str) -> None:
    made = book(misfit, entry())  # type: ignore[arg-type]
    assert len(made) == 1
    (told,) = made.troubles
    assert told.startswith("the entry from 'a test' does not fit the plant: ") and why in told


def test_huge_numbers_are_far_away() -> None:
    assert book(entry(stuck(1e308))).near(situation()) == []


@pytest.mark.parametrize(
    "unheard",
    [
        Hypothesis((FaultState("rust", 1.0, 0.0),), 1.0),
        Hypothesis((FaultState("leak", math.nan, 0.0),), 1.0),
        Hypothesis((FaultState("leak", 0.01, 0.0),), math.nan),
        Hypothesis((FaultState("leak", 0.01, 0.0),), 0.0),
    ],
)
def test_a_situation_without_words_is_near_nothing_and_breaks_nobody(unheard: Hypothesis) -> None:
    made = book(entry(), entry(LEAKS))
    assert made.near(situation(unheard)) == [] and made.starts(situation(unheard), "reduced_load") == []


def test_a_search_does_not_begin_where_the_state_forbids_it() -> None:
    d = reactor().description
    space = SearchSpace(d.machine.state("reduced_load"), d.tags_by_name)
    points = {rate: space.point(ActionSet(moved(rate).commands, "reduced_load")) for rate in (0.02, 0.5)}
    assert [rate for rate, point in points.items() if point is not None and space.admits(point)] == [0.02]
    automatic = (replace(COMMANDS[0], value=None), *COMMANDS[1:])
    left = space.point(ActionSet(automatic, "reduced_load"))
    assert left is not None and not space.admits(left), "a setpoint has no automatic"
    assert space.point(ActionSet(COMMANDS[1:], "reduced_load")) is None


def test_a_thousand_entries_are_looked_up_within_fifty_milliseconds() -> None:
    made = book(*(entry(stuck(0.6 + k * 1e-4), source=f"{k}") for k in range(1000)))
    took = []
    for _ in range(5):
        begin = time.thread_time()  # its own: others that compute beside it say nothing about it
        made.near(situation())
        took.append(time.thread_time() - begin)
    assert min(took) < 0.05


def test_a_search_begins_with_the_nearest_that_lead_to_its_state() -> None:
    hold = replace(ANSWER, path=("normal", "holding"), target="holding")
    made = book(*(entry(stuck(0.7 + k * 1e-3), answer=moved(0.02 + k * 1e-4)) for k in range(20)), entry(answer=hold))
    starts = made.starts(situation(), "reduced_load")
    assert len(starts) == STARTS and starts[0].command("F1.sp").value == 0.02  # type: ignore[union-attr]
    assert made.starts(situation(), "compensated") == []


# --- the proposer ------------------------------------------------------------------------------------------------


NOTHING_TRIED = Advice()


def proposed(made: object, here: Situation, advice: Advice = NOTHING_TRIED) -> tuple[RecoveryPath, ActionSet]:
    one = remembering(made)  # type: ignore[arg-type]

    async def both() -> tuple[RecoveryPath, ActionSet]:
        path = await one.planning.plan(here, advice)
        actions = await one.action.act(here, path, advice)  # type: ignore[arg-type]
        return path, actions  # type: ignore[return-value]

    return asyncio.run(both())


def test_what_was_released_is_proposed_as_it_was() -> None:
    path, actions = proposed(book(entry()), situation())
    assert path.states == ANSWER.path and actions == ActionSet(ANSWER.commands, "reduced_load")


def test_after_a_refusal_the_next_one_is_proposed_and_then_nothing() -> None:
    made, here = book(entry(), entry(stuck(0.72), answer=moved(0.018))), situation()
    attempts: tuple[Attempt, ...] = ()
    for expected in (0.0205, 0.018):
        path, actions = proposed(made, here, Advice(attempts=attempts))
        assert actions.command("F1.sp").value == expected  # type: ignore[union-attr]
        attempts += (Attempt(1, path, actions, Revise(())),)
    with pytest.raises(NoAdmissiblePlan, match="no other entry is near"):
        proposed(made, here, Advice(attempts=attempts))


def test_what_is_not_open_now_is_not_proposed() -> None:
    here = situation()
    full = replace(here, snapshot=replace(here.snapshot, values={**here.snapshot.values, "L1": 11.5}))
    with pytest.raises(NoAdmissiblePlan, match="no entry is near"):
        proposed(book(entry()), full)
    hold = replace(ANSWER, path=("normal", "holding"), target="holding")
    assert proposed(book(entry(), entry(stuck(0.75), answer=hold)), full)[0].target == "holding"


def test_where_nothing_is_near_nothing_is_proposed() -> None:
    with pytest.raises(NoAdmissiblePlan, match="no entry is near: within a distance of 1"):
        proposed(book(entry()), situation(stuck(0.3)))
    with pytest.raises(NoAdmissiblePlan):
        proposed(book(), situation())


class TestPlanning(PlanningContract):
    @pytest.fixture
    def planning(self) -> Planning:
        return remembering(book(entry())).planning

    @pytest.fixture
    def situation(self) -> Situation:
        return situation()

    @pytest.fixture
    def machine(self) -> StateMachine:
        return reactor().description.machine


class TestAction(ActionContract):
    @pytest.fixture
    def action(self) -> Action:
        return remembering(book(entry())).action

    @pytest.fixture
    def situation(self) -> Situation:
        return situation()

    @pytest.fixture
    def path(self) -> RecoveryPath:
        return book(entry()).near(situation())[0][1].path

    @pytest.fixture
    def tags(self) -> Mapping[str, Tag]:
        return reactor().description.tags_by_name
