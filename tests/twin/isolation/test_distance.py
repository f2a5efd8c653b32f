"""Distance: far from where it was learned a model is wrong, and what it is wrong by is no fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.calibration import Posterior, Usual, prior
from homeostat.twin.carried import Carrier
from homeostat.twin.history import History, Window
from homeostat.twin.isolation.evidence import Accuracy, Evidence, observed_noise
from homeostat.twin.isolation.input_errors import distant_inputs
from homeostat.twin.isolation.isolation import DOUBT
from homeostat.twin.isolation.memory import remembered
from tests.twin.followed import disturbed, follow, reactor, readings

PLANT = reactor()
MODEL = PLANT.model
VARIABLES = tuple(PLANT.twin.errors)
POSTERIOR = prior(MODEL, PLANT.description.parameters)
SECONDS = 100


def window() -> Window:
    """The last readings of a healthy reactor."""
    history = History(PLANT.description.variables, MODEL.inputs)
    for snapshot in readings(5, 1500):
        history.append(snapshot)
    return history.window(SECONDS)


def usual(away: float = 0.0) -> Usual:
    """Where the reactor stands in :func:`window`, with a cooling valve that was ``away`` from there."""
    now = window()
    inputs = MODEL.replay_inputs(now.readings, now.inputs)[:15].mean(axis=0)
    inputs[MODEL.inputs.index("V2_man")] -= away
    return Usual(inputs, {v: float(now.readings[v].mean()) for v in VARIABLES})


def changes(away: float) -> np.ndarray:
    """How readings may differ because inputs stand elsewhere than they did, shape (inputs, seconds, variables)."""
    still = Carrier(MODEL, PLANT.description).carry([()], window())
    return distant_inputs(MODEL, window(), POSTERIOR.mean[None], still, VARIABLES, 0.1, usual(away).inputs)


def test_what_stands_where_it_was_learned_is_known() -> None:
    assert float(np.abs(changes(0.0)).max()) < 0.02, "but for noise"


def test_what_the_model_is_wrong_by_grows_with_the_distance() -> None:
    near, far = (np.abs(changes(away)[:, -1, VARIABLES.index("T1")]).max() for away in (0.1, 0.2))
    assert far == pytest.approx(2.0 * near, rel=0.1) and near > 0.01


def evidence(posterior: Posterior) -> Evidence:
    accuracy = Accuracy(PLANT.twin.errors, PLANT.twin.gain_error)
    return Evidence(MODEL, Carrier(MODEL, PLANT.description), window(), posterior, accuracy)


def test_a_constant_error_is_excused_far_away_and_not_where_the_model_was_learned() -> None:
    off = np.zeros((1, SECONDS - 1, len(VARIABLES)))
    off[:, :, VARIABLES.index("F3")] = 0.02
    here, there = (replace(POSTERIOR, root=1e-3 * POSTERIOR.root, usual=usual(away)) for away in (0.0, 0.2))
    there = replace(there, usual=replace(usual(0.2), readings={**usual().readings, "F3": usual().readings["F3"] - 0.1}))
    near, far = ((e := evidence(p)).losses(e.whiten(off))[0] for p in (here, there))
    assert far < 0.3 * near


@given(st.floats(0.01, 10.0), st.floats(-5.0, 5.0), st.floats(-100.0, 100.0))
def test_noise_is_seen_through_slopes_and_steps(sd: float, slope: float, step: float) -> None:
    course = slope * np.arange(400.0) + step * (np.arange(400) > 150)
    noise = np.random.default_rng(7).normal(0.0, 1.0, 400)
    assert observed_noise((course + sd * noise)[:, None])[0] == pytest.approx(sd, rel=0.15)


def test_few_readings_show_no_noise() -> None:
    assert observed_noise(np.ones((5, 2))).tolist() == [0.0, 0.0]


def test_that_nothing_was_wrong_is_remembered_as_likely_as_it_was() -> None:
    fault = (FaultState("temp_bias", 0.5, 100.0),)
    said = (Hypothesis(fault, 0.6), Hypothesis((), 0.3))
    found = {each.faults: each for each in remembered(fault, said, 500.0, 1.0)}
    assert found[()].nats == pytest.approx(np.log(0.5)) and found[()].old == ()
    assert set(remembered(fault, said[:1], 500.0, 1.0)[0].old) == set(fault), "and not at all where it was not said"
    assert len(remembered(fault, said[:1], 500.0, 1.0)) == 1


def test_what_is_remembered_comes_no_nearer_to_the_rest_where_nothing_is_seen() -> None:
    """What is said divides differences by a divisor; a look that sees nothing new says the same again."""
    faults = [(FaultState(name, 0.5, 100.0),) for name in ("temp_bias", "fouling", "leak")]
    said = tuple(Hypothesis(f, p) for f, p in zip(faults, (0.83, 0.12, 0.05), strict=True))
    for _ in range(7):
        nats = np.array([each.nats for each in remembered(faults[0], said, 500.0, DOUBT)])
        weights = np.exp(nats / DOUBT)
        said = tuple(replace(h, probability=float(w)) for h, w in zip(said, weights / weights.sum(), strict=True))
    assert [h.probability for h in said] == pytest.approx([0.83, 0.12, 0.05])


@pytest.mark.parametrize("said", ["T1.sp - 3 from 2000", "T_coolant + 5 from 2000"])
def test_a_reactor_that_is_operated_elsewhere_has_no_fault(said: str) -> None:
    """A quarter of an hour after it was moved the model is still wrong about it, and nothing is."""
    twin = follow(disturbed(392, 2900, said, mismatch="plant"), 392)
    found = twin.explain(["temp_bias", "fouling", "cool_stuck_closed"], (), since_s=2300.0)
    assert sum(h.probability for h in found if not h.faults) >= 0.8


def test_a_thermometer_that_lies_is_found_all_the_same() -> None:
    twin = follow(disturbed(391, 2700, "T1 reads + 2 from 2500", mismatch="plant"), 391)
    found = twin.explain(["temp_bias", "fouling"], (), since_s=2510.0)
    assert sum(h.probability for h in found if h.name == "temp_bias") >= 0.8
