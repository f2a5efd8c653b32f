"""The best answer by hindsight: every state that may be recovered to, each with all that it leaves open."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.evaluate.reference.best_answer import best_answer, grids
from homeostat.evaluate.reference.best_constant import best_constant
from homeostat.evaluate.scenario import departing, scenario
from homeostat.plants.plant import Plant, load_plant
from tests.twin.followed import reactor

STUCK = scenario(reactor(), "cool_stuck_closed", 1, 1450.0, None, 2000.0)
AT_S = 1455.0


def with_states(**setpoints: tuple[SetpointRange, ...]) -> Plant:
    """The reactor with only these recovery targets, each with its own setpoints."""
    plant = reactor()
    machine = plant.description.machine
    named = [replace(machine.states[0], name=n, recovery_target=True, setpoints=s) for n, s in setpoints.items()]
    others = [replace(s, recovery_target=False) for s in machine.states if s.name not in setpoints]
    changed = replace(plant.description.machine, states=(*named, *others))
    return replace(plant, description=replace(plant.description, machine=changed))


def test_a_state_of_which_another_one_lets_everything_is_not_tried_again() -> None:
    tried = grids(reactor(), 3)
    assert len(tried) == 2, "part load lets all that is compensated or normal; holding has a closed feed"
    holding, load = tried
    assert load["XV1.cmd"] == (1.0,) and len(load["F1.sp"]) == 3 and load["V2.man"] == (None, 0.0, 0.5, 1.0)
    assert holding["XV1.cmd"] == (0.0,) and holding["F1.sp"] == (0.0,)


def test_what_is_closed_elsewhere_or_reaches_further_is_a_state_of_its_own() -> None:
    wide, narrow = SetpointRange("T1.sp", 298.0, 312.0, 310.0), SetpointRange("T1.sp", 300.0, 310.0, 305.0)
    automatic, manual = SetpointRange("V2.man", 0.0, 0.0, None), SetpointRange("V2.man", 0.0, 1.0, 0.5)
    assert len(grids(with_states(compensated=(wide,), holding=(narrow,)), 3)) == 1
    assert len(grids(with_states(compensated=(narrow,), holding=(replace(narrow, high=315.0),)), 3)) == 1
    beside = replace(narrow, low=290.0, high=305.0)
    assert len(grids(with_states(compensated=(narrow,), holding=(beside,)), 3)) == 2
    assert len(grids(with_states(compensated=(manual,), holding=(automatic,)), 3)) == 2, "none of it is on automatic"
    assert len(grids(with_states(compensated=(replace(manual, design=None),), holding=(automatic,)), 3)) == 1
    assert len(grids(with_states(compensated=(wide, manual), holding=(narrow,)), 3)) == 2, "other things are commanded"


def test_the_answer_is_no_dearer_than_the_best_of_any_state_and_finer_is_no_dearer() -> None:
    plant = reactor()
    each = [best_constant(plant, STUCK, AT_S, grid) for grid in grids(plant, 3)]
    rough, finer = best_answer(plant, STUCK, AT_S, 3, ()), best_answer(plant, STUCK, AT_S, 3, (3,))
    assert rough.cost == min(found.cost for found in each if found.setpoints is not None)
    assert finer.cost <= rough.cost
    counted = sum(found.admissible for found in each), sum(found.points for found in each)
    assert (rough.admissible, rough.points) == (finer.admissible, finer.points) == counted
    assert 0 < rough.admissible < rough.points


@pytest.mark.slow
def test_an_answer_after_which_there_is_no_plant_any_more_is_none() -> None:
    """Without D the pressure of the Tennessee Eastman plant trips within half an hour, whatever is commanded."""
    plant = load_plant("tennessee_eastman")
    case = scenario(plant, "V1_stuck_closed", 1, plant.onset_s, end_s=plant.onset_s + 8 * 3600.0)
    found = best_answer(plant, departing(plant, case, mismatch="plant"), plant.onset_s + 480.0, 2)
    assert found.setpoints is None and found.admissible == 0 and math.isnan(found.cost)
    assert found.points == len(grids(plant, 2)) * 3**4, "two ends and the design of four setpoints"
