"""News: a review thinks where something is new, and leaves the plant as it is where proposers found nothing before."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.hypotheses import PLAUSIBLE
from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.events.recovery import FallbackArmed, NoActionTaken
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Arm, Observation
from homeostat.domain.verdict import NoActionNeeded, StepBand
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.look.news import COST, MARGIN, NEAR, SEVERITY, Look, is_news
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, diagnosis
from tests.recovery.desk import CALM_20, DOOMED, FINE, MORE, NEXT, SOFT, Recovery, Watching, tick, ticks
from tests.recovery.line import GOOD, HALF

# --- two looks ---------------------------------------------------------------------------------------------------


def believed(*faults: tuple[str, float, float], symptoms: tuple[str, ...] = ("S-A", "S-B")) -> Diagnosis:
    """Hypotheses as (set of faults joined by '+', probability, severity of each)."""
    hypotheses = tuple(
        Hypothesis(tuple(FaultState(name, severity, 0.0) for name in names.split("+")), probability)
        for names, probability, severity in faults
    )
    return Diagnosis(10.0, tuple(Symptom(rule, 0.0, 2.0, 1.0, 2.0) for rule in symptoms), hypotheses)


def costs(share: float) -> Cost:
    """Of a plant that makes 40 EUR in the time that was looked at."""
    return Cost((CostItem("production", 40.0 * share),), 40.0)


BEFORE = Look(
    at_s=100.0,
    state="reduced",
    mode=Mode.CLOSED_LOOP,
    diagnosis=believed(("leak", 0.9, 0.5), ("fouling", 0.1, 0.2)),
    margins={"LIM-HOT": 0.5, "ACC-CALM": -0.125, "ACC-FAR": 12.0},
    cost=costs(0.25),
    fine=True,
    harmless=True,
)


def changed(**what: Any) -> bool:
    """Whether a later look that differs by ``what`` is news."""
    return is_news(replace(BEFORE, at_s=700.0, **what), BEFORE)


def margin(name: str, value: float) -> bool:
    return changed(margins={**BEFORE.margins, name: value})


def test_the_same_again_is_no_news() -> None:
    assert not changed()


@pytest.mark.parametrize(
    "what",
    [{"state": "running"}, {"mode": Mode.ADVISE}, {"fine": False}, {"harmless": False}],
    ids=lambda w: next(iter(w)),
)
def test_another_state_mode_or_condition_is_news(what: dict[str, Any]) -> None:
    assert changed(**what)


def test_a_new_symptom_is_news_and_one_that_has_gone_is_none() -> None:
    faults = (("leak", 0.9, 0.5), ("fouling", 0.1, 0.2))
    assert changed(diagnosis=believed(*faults, symptoms=("S-A", "S-B", "S-C")))
    assert changed(diagnosis=believed(*faults, symptoms=("S-C",)))
    assert not changed(diagnosis=believed(*faults, symptoms=("S-B",)))
    assert not changed(diagnosis=believed(*faults, symptoms=()))


@pytest.mark.parametrize(
    ("faults", "news"),
    [
        ((("leak", 0.8, 0.5), ("fouling", 0.2, 0.2)), False),
        ((("leak", 0.5, 0.4), ("leak", 0.4, 0.625), ("fouling", 0.1, 0.2)), False),
        ((("leak", 0.95, 0.5), ("fouling", PLAUSIBLE, 0.2)), False),
        ((("leak", 0.95, 0.5), ("fouling", PLAUSIBLE - 0.001, 0.2)), True),
        ((("leak", 0.5, 0.5), ("leak", 0.4, 0.5), ("fouling", 0.015, 0.2), ("fouling", 0.015, 0.2)), False),
        ((("leak", 0.8, 0.5), ("fouling", 0.1, 0.2), ("block", 0.1, 0.2)), True),
        ((("leak", 0.9, 0.5), ("fouling", 0.1, 0.2), ("block", PLAUSIBLE - 0.001, 0.2)), False),
        ((("leak+block", 0.9, 0.5), ("fouling", 0.1, 0.2)), True),
        ((), True),
    ],
)
def test_other_faults_are_news_once_they_are_plausible(
    faults: tuple[tuple[str, float, float], ...], news: bool
) -> None:
    assert changed(diagnosis=believed(*faults)) is news


@pytest.mark.parametrize(("severity", "news"), [(0.549, False), (0.551, True), (0.451, False), (0.449, True)])
def test_a_severity_beyond_its_noise_is_news(severity: float, news: bool) -> None:
    assert SEVERITY == 0.1
    assert changed(diagnosis=believed(("leak", 0.9, severity), ("fouling", 0.1, 0.2))) is news


def test_each_fault_of_a_set_is_compared_with_itself() -> None:
    two = Diagnosis(10.0, (), (Hypothesis((FaultState("a", 0.5, 0.0), FaultState("b", 0.2, 0.0)), 1.0),))
    other = Diagnosis(10.0, (), (Hypothesis((FaultState("a", 0.5, 0.0), FaultState("b", 0.3, 0.0)), 1.0),))
    assert not is_news(replace(BEFORE, diagnosis=two), replace(BEFORE, diagnosis=two))
    assert is_news(replace(BEFORE, diagnosis=other), replace(BEFORE, diagnosis=two))


def test_a_margin_that_moves_in_either_direction_is_news() -> None:
    assert MARGIN == 0.3
    assert not margin("LIM-HOT", 0.79) and not margin("LIM-HOT", 0.21)
    assert margin("LIM-HOT", 0.81) and margin("LIM-HOT", 0.19)
    assert not margin("ACC-CALM", -0.42) and margin("ACC-CALM", -0.43)


def test_a_margin_that_is_far_away_is_no_news_before_it_comes_near() -> None:
    assert NEAR == 1.0
    assert not margin("ACC-FAR", 3.0) and not margin("ACC-FAR", 0.71) and margin("ACC-FAR", 0.69)


@pytest.mark.parametrize("margins", [{"LIM-HOT": 0.5}, {**BEFORE.margins, "ACC-NEW": 5.0}, {}])
def test_other_criteria_are_news(margins: dict[str, float]) -> None:
    assert changed(margins=margins)


@pytest.mark.parametrize(("share", "news"), [(0.2599, False), (0.2601, True), (0.2401, False), (0.2399, True)])
def test_a_cost_that_changes_is_news(share: float, news: bool) -> None:
    assert COST == 0.01
    assert changed(cost=costs(share)) is news


def test_what_a_cost_consists_of_is_no_news() -> None:
    other = Cost((CostItem("production", 4.0), CostItem("ACC-SOFT", 6.0)), 40.0)
    assert other.share == costs(0.25).share and not changed(cost=other)


@pytest.mark.parametrize("value", [math.nan, -math.inf])
def test_what_cannot_be_compared_is_news(value: float) -> None:
    assert margin("LIM-HOT", value)
    lost = replace(BEFORE, margins={**BEFORE.margins, "LIM-HOT": value})
    assert is_news(lost, lost), "undecided before and now: nobody knows whether it is the same"
    for unknown in (None, costs(math.nan), costs(math.inf)):
        blind = replace(BEFORE, cost=unknown)
        assert is_news(blind, blind) and changed(cost=unknown)


# --- reviews -----------------------------------------------------------------------------------------------------

NOTHING = NoAdmissiblePlan("nothing better")


def reviewed(
    *later: Observation,
    at_s: tuple[float, ...] = (40.0, 50.0, 60.0),
    answer: Callable[[float], Diagnosis] = diagnosis,
    action: ScriptedAction | None = None,
    **more: Any,
) -> Recovery:
    """A line that was recovered at 10 s, and is reviewed ``at_s``; the first review finds nothing better."""
    seen = (*ticks(1, 10, DOOMED), *(later or ticks(11, 70, FINE, "reduced", feed=HALF)))
    scripted = action or ScriptedAction(GOOD, NOTHING)
    watcher = Watching(10.0, *at_s, answer=answer)
    return Recovery(seen, watcher, scripted, **{"bounds": CALM_20, "improves": True, **more}).run()


def asked_s(done: Recovery) -> list[float]:
    """When proposers were asked [s]."""
    return [situation.snapshot.at_s for situation, _, _ in done.action.asked]


def test_a_review_without_news_leaves_the_plant_as_it_is_and_asks_nobody() -> None:
    done = reviewed()
    assert asked_s(done) == [10.0, 40.0] and done.when(NoActionTaken) == [40.0, 50.0, 60.0]
    assert [type(o) for o in done.monitoring.outcomes[1:]] == [NoActionNeeded] * 3, "the next review is scheduled"


def test_a_symptom_that_goes_and_comes_back_is_no_news() -> None:
    """The look of 40 s is what later ones are compared with, whatever was seen in between."""
    shown = diagnosis(0.0).symptoms
    done = reviewed(answer=lambda at_s: replace(diagnosis(at_s), symptoms=() if at_s == 50.0 else shown))
    assert asked_s(done) == [10.0, 40.0]


def test_a_review_without_news_still_predicts_and_arms() -> None:
    done = reviewed()
    assert done.when(FallbackArmed) == [10.0, 40.0, 50.0, 60.0] and len(done.sent(Arm)) == 4
    idle = [d.at_s for d, actions in done.simulation.tried if actions.target == "reduced" and actions.commands == ()]
    assert idle == [40.0, 50.0, 60.0]


def test_a_fault_that_grows_slowly_is_news_in_the_end() -> None:
    """By 4 % from one review to the next: noise each time, but not together."""
    times = tuple(40.0 + 5.0 * k for k in range(6))
    done = reviewed(at_s=times, answer=lambda at_s: diagnosis(at_s, severity=1.0 + 0.04 * max(at_s - 40.0, 0.0) / 5.0))
    assert asked_s(done) == [10.0, 40.0, 55.0]


def test_a_plant_that_warms_slowly_is_news_in_the_end() -> None:
    """Nine millikelvin per second use 0.3 scales of 2 K up in 67 s, counted from where nothing was found."""
    still = ticks(11, 39, 311.0, "reduced", feed=HALF)
    warming = [tick(float(s), 311.0 + 0.009 * (s - 40), "reduced", feed=HALF) for s in range(40, 141)]
    done = reviewed(*still, *warming, at_s=tuple(float(s) for s in range(40, 141, 10)))
    assert asked_s(done) == [10.0, 40.0, 110.0]


def test_after_a_release_the_next_review_thinks_whatever_was_in_vain_before() -> None:
    action = ScriptedAction(GOOD, NOTHING, MORE, NOTHING)
    done = reviewed(
        at_s=(40.0, 45.0, 47.0, 68.0, 69.0),
        answer=lambda at_s: diagnosis(at_s, severity=1.0 if at_s != 47.0 else 2.0),
        action=action,
    )
    assert done.released == [10.0, 47.0] and asked_s(done) == [10.0, 40.0, 47.0, 68.0]


def test_time_that_ran_out_says_nothing_about_what_could_be_found() -> None:
    done = reviewed(action=ScriptedAction(GOOD, TimeoutError("late")))
    assert asked_s(done) == [10.0, 40.0, 50.0, 60.0] and done.when(NoActionTaken) == [40.0, 50.0, 60.0]


def test_a_recovered_plant_that_misses_a_wish_is_not_asked_about_again_without_news() -> None:
    done = reviewed(*ticks(11, 70, 309.0, "reduced", feed=HALF), limits=SOFT)
    assert asked_s(done) == [10.0, 40.0] and done.when(NoActionTaken) == [40.0, 50.0, 60.0] and done.handed_over == []


def test_a_plant_that_runs_into_a_limit_is_thought_about_whatever_was_in_vain() -> None:
    hot = (*ticks(11, 45, FINE, "reduced", feed=HALF), *ticks(46, 70, 312.95, "reduced", feed=HALF))
    done = reviewed(*hot, at_s=(40.0, 50.0))
    assert asked_s(done) == [10.0, 40.0, 50.0] and done.handed_over == ["nothing better"]


def test_a_batch_that_deviates_is_thought_about_whatever_was_in_vain() -> None:
    bounds = Bounds(intervention=InterventionBounds(calm_s=20.0, slack_s=5.0, repeat_s=100.0))
    seen = (*ticks(11, 70, FINE, feed=HALF, then=NEXT),)
    done = reviewed(*seen, at_s=(40.0,), bounds=bounds, band=StepBand(45.0, 55.0))
    assert asked_s(done) == [10.0, 40.0, 61.0]
