"""Responses: what a linear pass predicts is what a replay with that disturbance shows."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.diagnosis import Effect, EffectKind, FaultState
from homeostat.twin.carried import Carrier, FaultSet
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.linear import SEEN, Turns
from homeostat.twin.isolation.responses import FIRST_ROW, Responses
from tests.twin.followed import disturbed, follow, reactor

END_S = 1700


@functools.cache
def evidence() -> Evidence:
    plant = reactor()
    twin = follow(disturbed(4, END_S), 4)
    carrier = Carrier(plant.model, plant.description)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    return Evidence(plant.model, carrier, twin._history.window(300), twin._posterior, accuracy)


@functools.cache
def responses(*beside: FaultState) -> Responses:
    return Responses(evidence(), beside)


def replayed(disturbance: FaultState, beside: FaultSet = ()) -> np.ndarray:
    """By how much the predicted readings change with ``disturbance``, in standard deviations."""
    with_it, without = evidence().residuals([(*beside, disturbance), beside])
    return without - with_it


SIZES = [
    ("unknown_heat_R1", 0.5), ("unknown_mass_R1", 0.001), ("unknown_heat_R1_UA", 5.0), ("unknown_P1_K_P1", 0.0005),
    ("F2_reads_high", 0.01), ("T1_reads_low", 0.3), ("T2_reads_high", 0.5),
]  # fmt: skip


@pytest.mark.parametrize(("name", "size"), SIZES)
@pytest.mark.parametrize("at", [5, 30])
def test_a_step_is_as_replayed(name: str, size: float, at: int) -> None:
    """Of a balance, what it gains steadily is a sum of kicks some seconds apart: right to a few percent."""
    effect = reactor().description.fault_mode(name).effect
    assert effect is not None
    rows = responses().rows[at : at + 1]
    unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
    linear = responses().steps(unit, rows)[0] * effect.per_unit * size
    true = replayed(FaultState(name, size, evidence().window.start_s + float(rows[0])))
    assert np.linalg.norm(linear - true) <= 0.05 * np.linalg.norm(true) + 1e-6


@pytest.mark.parametrize(("name", "size"), [("unknown_heat_R1_growing", 0.005), ("F2_drifts_up", 0.0002)])
def test_a_ramp_is_as_replayed(name: str, size: float) -> None:
    effect = reactor().description.fault_mode(name).effect
    assert effect is not None
    unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
    linear = (responses().ramps @ responses().steps(unit))[10] * effect.per_unit * size
    true = replayed(FaultState(name, size, evidence().window.start_s + float(responses().rows[10])))
    assert np.linalg.norm(linear - true) <= 0.1 * np.linalg.norm(true)


@pytest.mark.parametrize(
    ("name", "size"), [("unknown_heat_R1_swinging", 0.5), ("unknown_P1_K_P1_swinging", 0.0005), ("L1_swings", 0.1)]
)
@pytest.mark.parametrize("which", [0, -1])
def test_a_swing_is_as_replayed(name: str, size: float, which: int) -> None:
    """The sine of every turn that is tried is a mixture of steps; between two of them it is not followed."""
    effect = reactor().description.fault_mode(name).effect
    assert effect is not None
    unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
    turns = Turns.of(responses().rows, responses().every, evidence().shape[0])
    linear = turns.mixture[which, 0] @ responses().steps(unit) * size
    onset_s, period_s = evidence().window.start_s + float(turns.rows[which]), float(turns.ticks[which])
    true = replayed(FaultState(name, size, onset_s, period_s))
    assert np.linalg.norm(linear - true) <= 0.3 * np.linalg.norm(true)


def test_what_is_tried_has_turned_nearly_once() -> None:
    turns = Turns.of(responses().rows, responses().every, evidence().shape[0])
    assert len(turns.rows) > 100
    assert (evidence().shape[0] - turns.rows >= SEEN * turns.ticks).all()
    assert len(Turns.of(np.arange(3, 14), 1, 14).rows) == 0, "too little was read to have seen a turn"


def test_nothing_responds_before_the_onset() -> None:
    unit = Effect(EffectKind.PARAMETER, "UA")
    rows = np.array([100])
    change = responses().steps(unit, rows)[0].reshape(evidence().shape)
    assert not change[:100].any() and change[101:].any()


def test_responses_beside_a_fault_are_those_beside_it() -> None:
    """A pump that gives less answers a change of its characteristic as it would without, relative to its speed."""
    beside = (FaultState("temp_bias", 3.0, evidence().window.start_s + 50.0),)
    unit, rows = Effect(EffectKind.PARAMETER, "UA"), np.array([120])
    linear = responses(*beside).steps(unit, rows)[0] * 5.0
    true = replayed(FaultState("unknown_heat_R1_UA", 5.0, evidence().window.start_s + 120.0), beside)
    assert np.linalg.norm(linear - true) <= 0.05 * np.linalg.norm(true)


def test_onsets_lie_in_the_window() -> None:
    seconds = evidence().shape[0]
    for rows in (responses().rows, responses().newest):
        assert rows.min() >= FIRST_ROW and rows.max() < seconds
