"""Filters of transmitters: what isolation predicts comes through them, and what no site can bring explains nothing."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.plants.plant import Plant, load_plant
from homeostat.twin.carried import Carrier
from homeostat.twin.isolation.evidence import AT_ONCE, BOUND, Accuracy, Evidence, _filtered
from homeostat.twin.isolation.prior import Prior
from tests.twin.followed import disturbed, follow, reactor

END_S = 1700


@functools.cache
def evidence(damping_s: float) -> Evidence:
    plant = reactor()
    twin = follow(disturbed(4, END_S), 4)
    damping = {"T1": damping_s} if damping_s else {}
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error, damping=damping)
    window = twin._history.window(300)
    return Evidence(plant.model, Carrier(plant.model, plant.description), window, twin._posterior, accuracy)


def shown(damping_s: float, fault: FaultState) -> np.ndarray:
    """What the fault adds to the reading of T1 in each tick of the window, in K."""
    known = evidence(damping_s)
    without, with_it = known.residuals([(), (fault,)]).reshape(2, *known.shape)
    at = known.variables.index("T1")
    return (without - with_it)[:, at] / known._weight[:, at]


def test_a_step_of_a_reading_comes_as_the_filter_lets_it() -> None:
    """5 K through 3 s: 1.42 K after one second, 3.16 K after three, by hand."""
    began = 100
    fault = FaultState("temp_bias", 5.0, evidence(3.0).window.start_s + began)
    moved = shown(3.0, fault)
    assert np.abs(moved[: began - 1]).max() < 1e-9
    first = int(np.argmax(moved > 0.1))
    assert moved[first : first + 3] == pytest.approx([5.0 * (1.0 - math.exp(-k / 3.0)) for k in (1, 2, 3)], abs=0.02)
    assert moved[-1] == pytest.approx(5.0, abs=0.02)


def test_without_a_filter_it_comes_at_once() -> None:
    moved = shown(0.0, FaultState("temp_bias", 5.0, evidence(0.0).window.start_s + 100))
    assert set(np.round(moved, 6)) <= {0.0, 5.0}


def test_other_readings_are_as_they_were() -> None:
    fault = FaultState("leak", 0.005, evidence(0.0).window.start_s + 100)
    plain, filtered = (evidence(s).residuals([(fault,)])[0].reshape(evidence(s).shape) for s in (0.0, 3.0))
    others = [j for j, v in enumerate(evidence(0.0).variables) if v != "T1"]
    assert np.array_equal(plain[:, others], filtered[:, others])


def test_a_filter_of_what_is_not_compared_changes_nothing() -> None:
    known = evidence(0.0)
    accuracy = Accuracy(reactor().twin.errors, reactor().twin.gain_error, damping={"T2": 3.0})
    again = Evidence(known.model, known.carrier, known.window, known.posterior, accuracy)
    assert np.array_equal(again.residuals([()]), known.residuals([()]))


def test_what_is_handed_to_be_whitened_stays_as_it_is() -> None:
    change = np.ones((1, *evidence(3.0).shape))
    evidence(3.0).whiten(change)
    assert np.all(change == 1.0)


@functools.cache
def shipped() -> Plant:
    return load_plant("cstr")


def test_more_heat_than_anything_on_site_brings_has_no_probability() -> None:
    plant = shipped()
    mode = plant.description.fault_mode("unknown_heat_R1")
    assert mode.effect is not None and mode.effect.most == 20.0 and mode.severity_nominal == 5.0
    prior = Prior(plant.description.faults, evidence(0.0).window, ("T1",), {})
    cost = prior.cost_of_size(mode, np.array([-20.1, -19.9, 19.9, 20.1]), np.array([10, 10, 10, 10]))
    assert np.isinf(cost[[0, 3]]).all() and np.isfinite(cost[1:3]).all()


def test_a_balance_that_says_nothing_has_no_end() -> None:
    mode = shipped().description.fault_mode("unknown_mass_R1")
    assert mode.effect is not None and math.isinf(mode.effect.most)
    unbounded = replace(mode.effect, most=math.inf)
    assert unbounded == mode.effect


@pytest.mark.parametrize("ticks", [1, 2, 64, 65, 66, 129, 300])
@pytest.mark.parametrize("share", [0.02, 0.4, 0.999])
def test_readings_come_through_the_filter_as_tick_by_tick(ticks: int, share: float) -> None:
    given = np.random.default_rng(ticks).normal(size=(3, ticks))
    expected = given.copy()
    for tick in range(1, ticks):
        expected[:, tick] = expected[:, tick - 1] + share * (given[:, tick] - expected[:, tick - 1])
    kept = given.copy()
    assert np.allclose(_filtered(given, share), expected, rtol=0.0, atol=1e-12)
    assert np.array_equal(given, kept), "what came in is as it was"


@pytest.mark.parametrize("count", [1, AT_ONCE, 2 * AT_ONCE + 1])
def test_a_loss_is_what_is_freed_and_what_is_bounded_of_the_rest(count: int) -> None:
    """z = (I + D'D)^-1 D' r and |z|^2 + |min(max(r - D z, -12), 12)|^2, row by row."""
    known = evidence(0.0)
    residuals = np.random.default_rng(count).normal(scale=8.0, size=(count, known.directions.shape[0]))
    d = known.directions
    for row, loss, left in zip(residuals, known.losses(residuals), known.left(residuals), strict=True):
        z = np.linalg.solve(np.eye(d.shape[1]) + d.T @ d, d.T @ row)
        rest = row - d @ z
        assert left == pytest.approx(rest, abs=1e-6)
        assert loss == pytest.approx(float(z @ z + np.square(np.clip(rest, -BOUND, BOUND)).sum()), rel=1e-9)
