"""Gently: the way back takes as long as keeps controlled variables near their setpoints, and no longer."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.agents.search.gently import RAMPS_S, Rest, excess, gentlest, leads_back, ramped, settles
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from tests.agents.stuck_valve import DIAGNOSIS, QUICK, now, search
from tests.twin.followed import reactor

PLANT = reactor().description
BACK = RecoveryPath(PLANT.machine, (next(t for t in PLANT.machine.transitions if t.name == "t_return_reduced"),))
HEALTHY = replace(now(), state="reduced_load", diagnosis=Diagnosis(1460.0, (), ()))
ORDERS = ActionSet(
    (Command("T1.sp", 310.0, 0.5), Command("XV1.cmd", 1.0, None), Command("V2.man", None, None)), "normal"
)
QUIET = {tag: np.zeros((2, 4)) for loop in PLANT.loops for tag in (loop.process_variable, loop.setpoint)}


def test_only_a_plant_in_which_nothing_is_wrong_goes_back() -> None:
    assert leads_back(PLANT, HEALTHY, BACK)
    assert not leads_back(PLANT, replace(HEALTHY, diagnosis=DIAGNOSIS), BACK)
    assert not leads_back(PLANT, replace(HEALTHY, state="normal"), BACK)


def test_a_setpoint_takes_the_time_that_it_is_given() -> None:
    slow = ramped(ORDERS, {"T1.sp": 304.0, "XV1.cmd": 1.0}, 600.0)
    assert slow.commands == (Command("T1.sp", 310.0, 0.01), *ORDERS.commands[1:])


@pytest.mark.parametrize("present", [310.0, math.nan])
@pytest.mark.parametrize("seconds", [0.0, 600.0])
def test_what_is_there_or_unknown_is_commanded_as_it_is(present: float, seconds: float) -> None:
    assert ramped(ORDERS, {"T1.sp": present}, seconds) == ORDERS


def test_nothing_changes_faster_than_its_tag_may() -> None:
    assert ramped(ORDERS, {"T1.sp": 300.0}, 1.0) == ORDERS


def test_excess_begins_where_a_variable_is_further_off_than_half_its_scale() -> None:
    """Of two members one is 1.0 K off at its worst, which is 0.5 beyond half the scale of 1 K: 0.25 in the mean."""
    off = {**QUIET, "T1": np.array([[0.0, 0.9, -1.0, 0.0], [0.5, 0.0, 0.0, 0.0]])}
    assert excess(PLANT, off, 1) == pytest.approx([0.25])
    assert excess(PLANT, {tag: np.vstack([QUIET[tag], off[tag]]) for tag in off}, 2) == pytest.approx([0.0, 0.25])


@pytest.mark.parametrize(
    ("excesses", "admitted", "chosen"),
    [
        ([0.0, 0.0, 0.0], [True] * 3, 0),
        ([2.0, 0.5, 0.0], [True] * 3, 2),
        ([2.0, 0.05, 0.0], [True] * 3, 1),
        ([2.0, 0.5, 0.0], [True, True, False], 1),
        ([2.0, 0.5, 0.0], [False] * 3, 0),
    ],
)
def test_the_fastest_that_is_as_gentle_as_the_gentlest_is_taken(
    excesses: list[float], admitted: list[bool], chosen: int
) -> None:
    ways = [replace(ORDERS, target=str(k)) for k in range(3)]
    assert gentlest(ways, np.array(excesses), admitted) is ways[chosen]


def test_the_search_takes_the_design_of_the_ordinary_state() -> None:
    found = asyncio.run(search(QUICK).act(HEALTHY, BACK, Advice()))
    assert isinstance(found, ActionSet)
    assert found.target == "normal" and {c.tag: c.value for c in found.commands} == {
        r.tag: r.design for r in PLANT.machine.state("normal").setpoints
    }
    assert found.command("V2.man") == Command("V2.man", None, None)


def test_ramps_are_tried_from_the_fastest_on() -> None:
    assert list(RAMPS_S) == sorted(RAMPS_S) and RAMPS_S[0] == 0.0


def moving(off: float) -> dict[str, np.ndarray]:
    """A level that is ``off`` its setpoint by so many scales at first, and half a scale in the end."""
    tag = PLANT.loops[1].process_variable
    scale = PLANT.tag(tag).scale
    return {**QUIET, tag: scale * np.array([[off, off, 0.5, 0.5]] * 2)}


def test_what_comes_to_rest_by_itself_soon_is_waited_for() -> None:
    assert settles(PLANT, moving(3.0), 2)
    assert not settles(PLANT, moving(0.5), 2), "it is at rest"
    assert not settles(PLANT, moving(3.0), 1), "it is not there so soon"
    assert not settles(PLANT, moving(3.0), 4), "nobody looks so far"
    assert settles(PLANT, moving(-3.0), 2), "on either side"


@pytest.mark.parametrize(
    ("course", "waits"),
    [
        ([0.0, 1.0, 1.6, 1.6], True),  # by hand it ends a little off
        ([0.0, 1.0, 3.0, 3.0], False),  # or far off
        ([0.0, 1.0, 1.5, 2.4], False),  # or goes on
        ([1.5, 1.5, 1.5, 1.5], False),  # it is off already, and does not come back
        ([0.0, 4.0, 0.2, 0.1], True),  # it leaves and comes back
        ([0.0, 0.0, math.nan, math.nan], False),
    ],
)
def test_what_is_near_may_drift_a_little_while_another_comes_to_rest(course: list[float], waits: bool) -> None:
    tag = PLANT.loops[0].process_variable
    scale = PLANT.tag(tag).scale
    assert settles(PLANT, {**moving(3.0), tag: scale * np.array([course] * 2)}, 2) is waits


def test_what_leaves_its_setpoint_and_comes_back_is_waited_for() -> None:
    tag = PLANT.loops[1].process_variable
    course = PLANT.tag(tag).scale * np.array([[0.0, 3.0, 0.2, 0.1]] * 2)
    assert settles(PLANT, {**QUIET, tag: course}, 2)


def test_a_plant_that_moves_by_itself_is_not_sent_back_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: rows > 0)
    with pytest.raises(NoAdmissiblePlan, match="comes to rest in 'reduced_load' first"):
        asyncio.run(search(QUICK).act(HEALTHY, BACK, Advice()))


def test_a_limit_in_danger_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A setpoint that made up for a transmitter is wrong once that reads right: what must be done is the way back."""
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: True)
    found = asyncio.run(search(QUICK).act(replace(HEALTHY, act_by_s=HEALTHY.snapshot.at_s + 60.0), BACK, Advice()))
    assert isinstance(found, ActionSet)
    assert found.target == "normal"


def test_rest_is_not_waited_for_for_ever() -> None:
    rest = Rest()
    assert all(rest.awaited(at_s, 600.0) for at_s in (1000.0, 1060.0, 1600.0))
    assert not rest.awaited(1660.0, 600.0) and not rest.awaited(1720.0, 600.0)
    assert rest.awaited(2400.0, 600.0), "another repair, later"
    assert not rest.awaited(math.nan, 600.0)


def test_a_twin_that_says_soon_each_time_does_not_keep_the_plant_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("homeostat.agents.search.returning.settles", lambda plant, signals, rows: True)
    subject, sent = search(QUICK), []
    for later_s in (0.0, 300.0, 600.0, 660.0):
        asked = replace(HEALTHY, snapshot=replace(HEALTHY.snapshot, at_s=HEALTHY.snapshot.at_s + later_s))
        try:
            said = asyncio.run(subject.act(asked, BACK, Advice()))
            sent.append(said.target if isinstance(said, ActionSet) else "refused")
        except NoAdmissiblePlan:
            sent.append("")
    assert sent == ["", "", "", "normal"]
