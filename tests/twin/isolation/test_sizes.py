"""Sizes: an interval holds what explains the readings nearly as well, and is as wide as the model is wrong."""

from __future__ import annotations

import functools
import math

import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.carried import Carrier
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.sizes import SizeError, stated
from tests.twin.followed import follow, reactor, readings

ONSET_S, END_S = 1450.0, 1500
EXACT = SizeError(0.0, 0.0)


@functools.cache
def evidence(*faults: FaultState) -> Evidence:
    """A window of a reactor that has ``faults``."""
    plant = reactor()
    twin = follow(readings(4, END_S, faults), 4)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    carrier = Carrier(plant.model, plant.description)
    return Evidence(plant.model, carrier, twin._history.window(400), twin._posterior, accuracy)


def between(seen: Evidence, said: FaultState, error: SizeError = EXACT, divisor: float = 1.0) -> tuple[float, float]:
    (found,) = stated([Hypothesis((said,), 1.0)], {}, seen, error, divisor)
    assert found.between is not None and found.faults == (said,)
    return found.between


KNOWN = [
    FaultState("temp_bias", 4.0, ONSET_S),
    FaultState("pump_degrade", 0.4, ONSET_S),
    FaultState("leak", 0.008, ONSET_S),
]


@pytest.mark.parametrize("true", KNOWN, ids=lambda f: f.fault)
def test_the_edges_explain_the_readings_worse_by_two_standard_deviations(true: FaultState) -> None:
    seen = evidence(true)
    low, high = between(seen, true)
    assert low < true.severity < high
    at = seen.likelihoods([(FaultState(true.fault, size, ONSET_S),) for size in (low, true.severity, high)])
    assert at[1] - at[0] >= 1.0 and at[1] - at[2] >= 1.0, "an edge with the onset of the best size is no better"


def test_what_counts_for_less_leaves_a_wider_interval() -> None:
    true = KNOWN[0]
    narrow, wide = between(evidence(true), true), between(evidence(true), true, divisor=4.0)
    assert wide[0] < narrow[0] and wide[1] > narrow[1]


def test_a_size_that_readings_do_not_depend_on_may_be_any() -> None:
    """What begins with the last reading has shown nothing yet."""
    allowed = reactor().description.fault("fouling").severity_range
    assert between(evidence(), FaultState("fouling", 0.5, END_S - 1.0)) == (allowed.low, allowed.high)


def test_no_interval_goes_beyond_the_sizes_that_a_fault_can_have() -> None:
    true = FaultState("pump_degrade", 0.4, ONSET_S)
    allowed = reactor().description.fault("pump_degrade").severity_range
    assert between(evidence(true), true, SizeError(2.0, 2.0)) == (allowed.low, allowed.high)


@pytest.mark.parametrize(("relative", "least"), [(0.1, 0.0), (0.0, 0.05), (0.1, 0.05)])
def test_the_error_of_the_model_adds_to_that_of_the_readings(relative: float, least: float) -> None:
    """Two standard deviations of either are added as squares: 3 and 4 make 5."""
    error = 2.0 * math.hypot(relative * 10.0, least * 20.0)
    low, high = SizeError(relative, least).widened(9.0, 10.0, 12.0, 20.0)
    assert (10.0 - low, high - 10.0) == pytest.approx((math.hypot(1.0, error), math.hypot(2.0, error)))


def test_what_has_no_size_and_what_is_several_faults_has_no_interval() -> None:
    frozen = Hypothesis((FaultState("T1_frozen", 1.0, ONSET_S),), 0.5)
    two = Hypothesis((KNOWN[0], KNOWN[1]), 0.5)
    assert [h.between for h in stated([frozen, two, Hypothesis((), 0.1)], {}, evidence(), EXACT, 1.0)] == [None] * 3
