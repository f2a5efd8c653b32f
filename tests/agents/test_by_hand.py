"""By hand first: where nothing is wrong any more, and the way back would swing the plant, it is brought near it."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.search.action import SearchAction
from homeostat.agents.search.by_hand import by_hand, following, reaches, resting
from homeostat.agents.search.planning import SearchPlanning, open_paths
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Revise
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Fault, departing, repaired, scenario_of
from homeostat.links.simulated import SimulatedLink
from tests.agents.stuck_valve import QUICK, grounding
from tests.twin.followed import follow, reactor, readings

PLANT = reactor().description
NORMAL = PLANT.machine.state("normal")
REST = {"V2.man": 0.55}
WARM = {"T1": 305.0, "L1": 9.0}
DECIDED = {t.name: t for t in PLANT.machine.transitions}


def path(*names: str) -> RecoveryPath:
    return RecoveryPath(PLANT.machine, tuple(DECIDED[name] for name in names))


def test_an_output_stands_where_its_controller_comes_to() -> None:
    nowhere = {command: np.full((2, 3), np.nan) for command in PLANT.overridden.values()}
    signals = {**nowhere, "V2.cmd": np.array([[0.0, 0.5, 0.6], [0.0, 0.3, 0.4]])}
    assert resting(PLANT, signals, 2) == {"V2.man": pytest.approx(0.45)}
    assert resting(PLANT, nowhere, 2) == {}


def test_what_ordinary_operation_is_commanded_is_commanded_by_hand() -> None:
    (found,) = by_hand(PLANT, "compensated", WARM, NORMAL, REST)
    assert found.target == "compensated"
    values = {c.tag: c.value for c in found.commands}
    assert values == {r.tag: r.design for r in NORMAL.setpoints} | REST
    for c in found.commands:
        assert c.rate == PLANT.tag(c.tag).rate_limit


@pytest.mark.parametrize(
    ("here", "values", "states"),
    [
        ("compensated", WARM, ["compensated"]),
        ("reduced_load", WARM, ["compensated", "reduced_load"]),
        ("holding", WARM, ["reduced_load"]),  # which must not be fed while it holds
        ("reduced_load", {"T1": 313.0, "L1": 9.0}, ["reduced_load"]),  # the guard of the other is shut
        ("shutdown", WARM, []),
    ],
)
def test_no_state_of_more_risk_and_none_that_is_shut(here: str, values: dict[str, float], states: list[str]) -> None:
    assert [a.target for a in by_hand(PLANT, here, values, NORMAL, REST)] == states


@pytest.mark.parametrize("rest", [{}, {"V2.man": 1.2}])
def test_where_no_hand_may_hold_it_there_is_nothing(rest: dict[str, float]) -> None:
    assert by_hand(PLANT, "compensated", WARM, NORMAL, rest) == []


def test_a_state_is_reached_where_every_member_is_there_in_the_end() -> None:
    feed = {"F1.sp": np.array([[0.0, 0.033], [0.0, 0.031], [0.033, 0.033], [0.033, 0.02]])}
    assert reaches(NORMAL, feed, 1.0, 2).tolist() == [True, False]


# --- the search ------------------------------------------------------------------------------------------------------


@functools.cache
def mended(severity: float, fault: str = "inlet_stuck_open") -> tuple[Snapshot, ...]:
    """A reactor that nobody touches; a fault of it is mended after 300 s, 15 s before the last reading."""
    plant = reactor()
    told = scenario_of(plant, [Fault(fault, severity, 1450.0)], 3, 1765.0)
    link = SimulatedLink(open_process(plant, repaired(departing(plant, told, (), "none"), 1750.0)))
    return tuple(link.advance() for _ in range(1765))


def asked(seen: tuple[Snapshot, ...], state: str = "compensated", at_s: float = 0.0) -> Situation:
    last = replace(seen[-1], at_s=seen[-1].at_s + at_s)
    return Situation(last, Diagnosis(last.at_s, (), ()), state, seen)


def search(seen: tuple[Snapshot, ...]) -> SearchAction:
    plant = reactor()
    return SearchAction(follow(seen), PLANT, Pricing(plant.prices, PLANT.limits, PLANT.scales), QUICK)


def test_a_cold_reactor_whose_feed_is_back_is_warmed_by_hand_first() -> None:
    cold = mended(0.1)
    assert cold[-1].values["T1"] < 306.0
    subject, now = search(cold), asked(cold)
    assert isinstance(asyncio.run(subject.act(now, path("t_return"), Advice())), Revise)
    first = asyncio.run(subject.act(now, path("t_adjust_compensated"), Advice()))
    assert isinstance(first, ActionSet) and first.target == "compensated"
    order = first.command("V2.man")
    assert order is not None and order.value == pytest.approx(0.55, abs=0.05)


def test_a_reactor_that_is_where_it_belongs_goes_back_at_once() -> None:
    seen = mended(0.56)  # nearly where the valve stands anyhow: nothing has moved
    found = asyncio.run(search(seen).act(asked(seen), path("t_return"), Advice()))
    assert isinstance(found, ActionSet) and found.target == "normal"


def test_what_is_not_near_ordinary_operation_is_refused_while_something_comes_first() -> None:
    cold = mended(0.1)
    subject, now = search(cold), asked(cold)
    assert isinstance(asyncio.run(subject.act(now, path("t_return"), Advice())), Revise)
    assert isinstance(asyncio.run(subject.act(now, path("t_hold_compensated"), Advice())), Revise)
    later = replace(now, diagnosis=Diagnosis(now.snapshot.at_s + 60.0, (), ()))
    found = asyncio.run(subject.act(later, path("t_hold_compensated"), Advice()))
    assert isinstance(found, ActionSet), "it was said of another look"


def test_the_plant_does_not_stand_by_hand_for_ever() -> None:
    """A twin that sees the plant off each time would hold it by hand for good."""
    cold = mended(0.1)
    subject, sent = search(cold), []
    for later_s in (0.0, 300.0, 600.0, 660.0, 720.0):
        try:
            said = asyncio.run(subject.act(asked(cold, at_s=later_s), path("t_return"), Advice()))
            sent.append("refused" if isinstance(said, Revise) else said.target)
        except NoAdmissiblePlan:
            sent.append("waits")
    assert sent[:3] == ["refused"] * 3 and sent[-1] != "refused"


@functools.cache
def eased(feed: float, level: float = 8.5, end_s: int = 1520) -> tuple[Snapshot, ...]:
    """A healthy reactor that was sent to another ``level`` [L] with another ``feed`` [L/s] 70 s ago."""
    plant = reactor()
    link = SimulatedLink(open_process(plant, scenario_of(plant, [], 3, float(end_s))))
    seen = []
    for at_s in range(1, end_s + 1):
        if at_s == end_s - 70:
            link.operate("F1.sp", feed)
            link.operate("L1.sp", level)
        seen.append(link.advance())
    return tuple(seen)


def test_rest_is_waited_for_where_the_plant_belongs_and_nothing_is_saved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: True)
    seen = eased(1.0 / 30.0, 10.15)
    monkeypatch.setattr("homeostat.agents.search.returning.WORTH", -1.0)
    with pytest.raises(NoAdmissiblePlan, match="comes to rest in 'compensated' first"):
        asyncio.run(search(seen).act(asked(seen), path("t_return"), Advice()))


@pytest.mark.parametrize(("feed", "level"), [(1.0 / 60.0, 10.0), (1.0 / 30.0, 8.5)])
def test_rest_elsewhere_is_not_waited_for(monkeypatch: pytest.MonkeyPatch, feed: float, level: float) -> None:
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: True)
    seen = eased(feed, level)
    subject, now = search(seen), asked(seen, "reduced_load")
    assert isinstance(asyncio.run(subject.act(now, path("t_return_reduced"), Advice())), Revise)
    first = asyncio.run(subject.act(now, path("t_restore"), Advice()))
    assert isinstance(first, ActionSet) and first.target == "compensated"


def test_rest_elsewhere_is_waited_for_where_nothing_may_be_done_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: True)
    monkeypatch.setattr("homeostat.agents.search.returning.by_hand", lambda *args: [])
    seen = eased(1.0 / 60.0)
    with pytest.raises(NoAdmissiblePlan, match="comes to rest in 'reduced_load' first"):
        asyncio.run(search(seen).act(asked(seen, "reduced_load"), path("t_return_reduced"), Advice()))


@pytest.mark.parametrize("feed", [0.005, 0.01, 1.0 / 60.0])
def test_what_comes_first_keeps_every_limit(feed: float) -> None:
    seen = eased(feed)
    subject, now = search(seen), asked(seen, "reduced_load")
    assert isinstance(asyncio.run(subject.act(now, path("t_return_reduced"), Advice())), Revise)
    said = asyncio.run(subject.act(now, path("t_restore"), Advice()))
    assert isinstance(said, ActionSet)
    twin = follow(seen)
    signals, _ = twin.try_many(twin.ensemble((Hypothesis((), 1.0),), 6), twin.schedules([said], twin.horizon))
    assert signals["T1"].max() <= 313.0 and signals["L1"].max() <= 11.0


def test_setpoints_of_loops_that_stand_by_hand_follow_the_plant() -> None:
    """The temperature's does, and those of level and feed are as they were; on automatic none does."""
    (hand,) = by_hand(PLANT, "compensated", WARM, NORMAL, REST)
    first, slow = following(PLANT, hand, {"T1.sp": 300.0, "L1.sp": 8.0, "F1.sp": 0.02}, [0.0, 100.0])
    assert first == hand
    assert {c.tag: c.rate for c in slow.commands} == {c.tag: c.rate for c in hand.commands} | {"T1.sp": 0.1}
    free = replace(hand, commands=tuple(replace(c, value=None) if c.tag == "V2.man" else c for c in hand.commands))
    assert list(following(PLANT, free, {"T1.sp": 300.0}, [100.0])) == [free]


# --- the planner -----------------------------------------------------------------------------------------------------

AWAY = asked(readings(3, 1460), "reduced_load")


def after(verdict: Approve | Revise, *names: str) -> Advice:
    told = path(*names)
    attempt = Attempt(1, told, ActionSet((), told.target), verdict)
    return Advice(refused_paths=(told.commanded,), attempts=(attempt,))


async def cheap_elsewhere(situation: Situation, paths: Sequence[RecoveryPath]) -> Sequence[float]:
    return [0.5 if p.target == "normal" else 0.0 for p in paths]


def plan(advice: Advice) -> str:
    return asyncio.run(SearchPlanning(PLANT, grounding(), cheap_elsewhere).plan(AWAY, advice)).target


def test_the_way_back_comes_before_a_detour_that_costs_less() -> None:
    assert plan(Advice()) == "normal"


def test_once_it_is_approved_nothing_else_is_asked_for() -> None:
    with pytest.raises(NoAdmissiblePlan, match="way back is approved"):
        plan(after(Approve("", ()), "t_return_reduced"))


def test_once_it_is_refused_the_plant_may_be_adjusted_where_it_is() -> None:
    before, refused = (
        {p.states for p in open_paths(PLANT, grounding(), AWAY, advice)}
        for advice in (Advice(), after(Revise(()), "t_return_reduced"))
    )
    stays = ("reduced_load", "reduced_load")
    assert stays not in before and stays in refused
    assert plan(after(Revise(()), "t_return_reduced")) in {"compensated", "reduced_load"}
