"""Lags: what actuators and instruments do a little later than the model says is no sign of a fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.plants.plant import load_plant
from homeostat.process.batch import simulate
from homeostat.twin.calibration import prior
from homeostat.twin.carried import Carrier
from homeostat.twin.history import Window
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.input_errors import late_inputs
from homeostat.twin.replay import open_loop, starting_states

SECONDS = 60
PLANT = load_plant("mixing_module")
MODEL = PLANT.model
VARIABLES = tuple(PLANT.twin.errors)
POSTERIOR = prior(MODEL, PLANT.description.parameters)


def emptied(*late: tuple[str, int]) -> Window:
    """B201 is emptied from 10 s to 30 s by a model whose inputs are ``late`` [s]; commands are not."""
    start = MODEL.initial_state(POSTERIOR.mean)
    start[MODEL.states.index("V1")] = 2.8
    inputs = np.zeros((SECONDS, len(MODEL.inputs)))
    for name, value in (("cmd_VO1", 1.0), ("cmd_VI4", 1.0), ("cmd_P1", 0.9)):
        inputs[10:30, MODEL.inputs.index(name)] = value
    told = Window(0.0, {v: np.zeros(SECONDS) for v in MODEL.variables}, inputs, 1)
    done = inputs.copy()
    for name, by_s in late:
        done[by_s:, MODEL.inputs.index(name)] = inputs[:-by_s, MODEL.inputs.index(name)]
    still = Carrier(MODEL, PLANT.description).carry([()], told)
    batch = open_loop(MODEL, replace(told, inputs=done), start[None], POSTERIOR.mean[None], still)
    shown = simulate(MODEL.kernel, replace(batch, record=tuple(MODEL.shown.values()))).record[0]
    readings = dict(zip(MODEL.shown, np.vstack([shown[:1], shown]).T, strict=True))  # nothing moves in the first second
    return replace(told, readings=readings | dict(zip(MODEL.inputs, inputs.T, strict=True)))


def loss(window: Window, lag_s: float) -> float:
    """What nothing being wrong leaves of ``window``."""
    evidence = Evidence(
        MODEL, Carrier(MODEL, PLANT.description), window, POSTERIOR, Accuracy(PLANT.twin.errors, 0.01, lag_s)
    )
    return float(evidence.losses(evidence.residuals([()]))[0])


@pytest.mark.parametrize("late", [(("cmd_VO1", 1),), (("cmd_P1", 2),), (("cmd_VO1", 2), ("cmd_P1", 1))])
def test_what_is_a_little_late_is_explained_by_that(late: tuple[tuple[str, int], ...]) -> None:
    assert loss(emptied(*late), 1.0) < 0.2 * loss(emptied(*late), 0.0)


def test_a_valve_that_is_late_by_far_more_is_not() -> None:
    assert loss(emptied(("cmd_VO1", 10)), 1.0) > 300.0


def test_a_plant_in_time_has_nothing_to_explain() -> None:
    assert loss(emptied(), 1.0) < 1.0


def test_what_a_late_command_does_is_what_the_model_does_with_it() -> None:
    window = emptied()
    still = Carrier(MODEL, PLANT.description).carry([()], window)
    found = late_inputs(MODEL, window, POSTERIOR.mean[None], still, VARIABLES, 0.5)
    start = starting_states(MODEL, window, POSTERIOR.mean[None], still, VARIABLES)
    batch = replace(
        open_loop(MODEL, window, start, POSTERIOR.mean[None], still), record=tuple(MODEL.shown[v] for v in VARIABLES)
    )
    late = batch.inputs.copy()
    i = MODEL.inputs.index("cmd_VO1")
    late[0, 1:, i] = batch.inputs[0, :-1, i]
    change = simulate(MODEL.kernel, replace(batch, inputs=late)).record[0] - simulate(MODEL.kernel, batch).record[0]
    assert len(found) == 2 * 3 + 2 * len(VARIABLES)  # three commands moved, by one second and by two
    assert min(float(np.abs(each - 0.5 * change).max()) for each in found) < 1e-12
