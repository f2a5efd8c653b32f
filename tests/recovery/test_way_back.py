"""The way back: what is over is said, and a plant that was moved goes back to ordinary operation; no other does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.events.recovery import FaultsEnded, NoActionTaken
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import Transition
from homeostat.domain.verdict import Finding
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from homeostat.stl.formula import parse
from tests.agents.scripted import NoGraph, ScriptedAction, diagnosis
from tests.agents.stuck_valve import now
from tests.recovery.desk import DOOMED, FINE, Recovery, at_first, nothing, ticks, watching
from tests.recovery.line import FULL, GOOD, HALF, MACHINE, feed
from tests.safety.world import TAGS
from tests.twin.followed import reactor

WAS = (FaultState("runaway", 1.0, 5.0),)
RESUME = Transition("resume", "still", "running", "fault_diagnosed", parse("true", TAGS))
LINE = replace(
    MACHINE,
    states=tuple(replace(s, recovery_target=True) if s.name == "running" else s for s in MACHINE.states),
    transitions=(*MACHINE.transitions, RESUME),
)
"""A line that may go back from standing still to running."""
BACK = feed(FULL)


def over(at_s: float) -> Diagnosis:
    return Diagnosis(at_s, (), (), WAS, at_s - 5.0)


def moved(
    *answers: ScriptedAction | Any, noticed: tuple[float, ...] = (30.0,), hot: float = FINE,
    then: Callable[[float], Diagnosis] = over, last: int = 100, **more: Any,
) -> Recovery:  # fmt: skip
    """A line that was recovered at 10 s and holds with half of its feed; what is said from 20 s on is ``then``."""
    first, later = ticks(1, 10, DOOMED), ticks(11, last, hot, "still", feed=HALF)
    watch = watching(10.0, *noticed, answer=at_first(diagnosis, then))
    return Recovery((*first, *later), watch, ScriptedAction(GOOD, *answers), machine=LINE, **more).run()


def test_what_is_over_is_said_and_the_way_back_is_taken() -> None:
    back = moved(BACK, last=35)
    assert back.when(FaultsEnded) == [30.0] and back.released == [10.0, 30.0]
    assert back.trace.of(FaultsEnded)[0] == FaultsEnded(WAS, 25.0)


def test_it_is_taken_even_where_staying_costs_nothing_more() -> None:
    """Nobody asks what it costs: with nothing wrong the plant belongs where it is ordinarily."""
    assert moved(feed(HALF), last=35).released == [10.0, 30.0]


def test_where_it_is_not_open_yet_it_is_asked_for_again() -> None:
    bounds = Bounds(intervention=InterventionBounds(back_s=20.0))
    later = moved(NoAdmissiblePlan("not yet"), BACK, last=55, bounds=bounds)
    assert later.released == [10.0, 50.0] and later.when(NoActionTaken) == [30.0]


def test_it_is_not_asked_for_where_a_fault_is_found_meanwhile() -> None:
    bounds = Bounds(intervention=InterventionBounds(back_s=20.0))

    def again(at_s: float) -> Diagnosis:
        return over(at_s) if at_s < 35.0 else diagnosis(at_s)

    found = moved(NoAdmissiblePlan("not yet"), NoAdmissiblePlan("nothing"), noticed=(30.0, 40.0), then=again,
                  last=90, bounds=bounds, improves=True)  # fmt: skip
    assert found.released == [10.0] and len(found.action.asked) <= 3


def test_without_the_word_that_it_is_over_nobody_goes_back() -> None:
    """While evidence is gathered nothing is said at all, which is no sign that anything has ended."""
    assert moved(BACK, then=nothing, last=60).released == [10.0]


def test_a_plant_that_nobody_moved_has_no_way_back() -> None:
    quiet = Recovery(ticks(1, 40, FINE), watching(30.0, answer=over), machine=LINE).run()
    assert quiet.released == [] and quiet.when(FaultsEnded) == [30.0]


def test_what_was_said_before_is_not_thought_through_again() -> None:
    same = moved(then=lambda at_s: replace(diagnosis(at_s), news=False), last=60)
    assert same.released == [10.0] and len(same.simulation.tried) == len(moved(noticed=(), last=60).simulation.tried)


# --- which paths -----------------------------------------------------------------------------------------------------

PLANT = reactor().description


def asked(state: str, hypotheses: tuple[Hypothesis, ...] = (), fine: bool = True) -> Situation:
    idle = (Finding("ACC", Owner.ACTION, 1.0 if fine else -1.0, "K", 0.0, 0, ""),)
    return replace(now(), state=state, diagnosis=Diagnosis(1460.0, (), hypotheses), idle=idle)


def ends(situation: Situation) -> set[str]:
    return {path.target for path in open_paths(PLANT, NoGraph(), situation, Advice())}  # type: ignore[arg-type]


def test_ordinary_states_are_those_that_nobody_decides_on() -> None:
    assert PLANT.machine.ordinary == {"starting", "normal"}


@pytest.mark.parametrize(
    ("state", "targets"),
    [
        ("compensated", {"normal"}),
        ("reduced_load", {"normal", "compensated"}),
        ("holding", {"normal", "compensated", "reduced_load"}),
    ],
)
def test_with_nothing_wrong_only_the_way_back_is_open(state: str, targets: set[str]) -> None:
    """From a stop it may take more than one release: what held the plant still cannot carry it at once."""
    assert ends(asked(state)) == targets


def test_with_nothing_wrong_a_plant_that_cannot_stay_may_go_anywhere() -> None:
    assert {"normal", "compensated", "holding"} <= ends(asked("reduced_load", fine=False))


def test_with_a_fault_every_way_is_open() -> None:
    stuck = (Hypothesis((FaultState("fouling", 0.5, 1450.0),), 1.0),)
    assert {"compensated", "holding"} < ends(asked("reduced_load", stuck))
