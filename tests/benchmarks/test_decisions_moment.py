"""The best choice on the knowledge of a moment: what is chosen, what it costs on the true plant, what the page says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.decisions import moment
from benchmarks.decisions.decided import Problem
from benchmarks.decisions.measure import FAR, Decision
from benchmarks.decisions.moment import best_informed, cheapest
from benchmarks.decisions.page import against_constants
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.recovery import ActionSet
from homeostat.evaluate.reference.unsupervised import fault_free
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.plants.plant import load_plant
from tests.benchmarks.test_decisions_optimisers import stuck_valve


def test_a_grid_has_every_combination_and_both_of_two_positions() -> None:
    decided = stuck_valve()
    problem = Problem(decided)
    grid, tags = problem.grid(5), decided.plant.description.tags_by_name
    axes = [sorted(set(column.tolist())) for column in grid.T]
    assert len(grid) == len(np.unique(grid, axis=0)) == np.prod([len(axis) for axis in axes])
    chosen = [problem.actions(point) for point in grid]
    for command in chosen[0].commands:
        values = {c.value for actions in chosen for c in actions.commands if c.tag == command.tag}
        assert len(values) in ((1, 2) if tags[command.tag].two_position else (1, 5))
    assert max(len(axis) for axis in axes) == 5


def test_around_a_point_is_itself_and_nothing_outside_the_cube() -> None:
    problem = Problem(stuck_valve())
    around = problem.around(problem.grid(5)[0], 0.125)
    assert (around >= 0.0).all() and (around <= 1.0).all()
    assert (np.abs(around - problem.grid(5)[0]) <= 0.125).all() and len(around) > 1


def test_where_leaving_alone_violates_a_limit_the_choice_is_as_good_as_that_of_the_search() -> None:
    decided = stuck_valve()
    least, actions = cheapest(decided)
    problem = Problem(decided)
    assert actions is not None and problem.alone() > 1.0, "a stuck cooling valve ends too hot"
    assert least <= problem.searched()[0] + 0.02


def test_where_nothing_is_wrong_the_plant_is_left_alone() -> None:
    decided = stuck_valve()
    diagnosis = replace(decided.situation.diagnosis, hypotheses=(Hypothesis((), 1.0),))
    healthy = replace(decided, situation=replace(decided.situation, diagnosis=diagnosis))
    least, actions = cheapest(healthy)
    assert actions is None and least < 0.02


def test_what_was_chosen_is_priced_on_the_true_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a decision there is no choice, and whoever leaves the plant alone pays for no release."""
    plant = load_plant("cstr")
    chosen = scenario_of(plant, [Fault("cool_stuck_closed", 0.6, 400.0)], 1, 700.0)
    healthy = fault_free(plant, chosen).truth
    monkeypatch.setattr(moment, "first_decision", lambda *_: None)
    assert best_informed(plant, chosen, healthy, 410.0) is None
    monkeypatch.setattr(moment, "first_decision", lambda *_: stuck_valve())
    monkeypatch.setattr(moment, "cheapest", lambda _: (0.0, None))
    alone = best_informed(plant, chosen, healthy, 410.0)
    monkeypatch.setattr(moment, "cheapest", lambda d: (0.0, ActionSet((), d.situation.state)))
    acted = best_informed(plant, chosen, healthy, 410.0)
    assert alone is not None and acted is not None
    assert alone.states == () and acted.states == ("normal",) and acted.cost > alone.cost


def test_a_run_that_is_far_off_is_listed_beside_what_could_be_known() -> None:
    far = Decision("leak", 0.01, 2000.0, 7, "recovered", 2010.0, 1, 30.0, 30.0 - FAR - 1.0, None, 0.0, {}, 28.5)
    near = replace(far, seed=8, best=29.0, informed=None)
    text = against_constants([near, far], 2)
    assert "| leak | 0.010 | 7 | recovered | 30.0 | 21.0 | 28.5 | violates a limit |" in text
    assert "| 8 | recovered |" not in text
    assert "knowledge of the moment" not in against_constants([near], 1)
