"""Narrowed: a size is said with no less certainty than readings give, whatever it was tried with first."""

from __future__ import annotations

import functools

from homeostat.twin.carried import Carrier
from homeostat.twin.isolation.estimate import Estimate, Estimation
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.prior import Prior
from tests.twin.followed import disturbed, follow, reactor

ONSET_S = 1450.0
GAIN = 0.08
"""What the pump gives at full speed [L/s]; it loses a fifth of it."""


@functools.cache
def estimation() -> Estimation:
    """What is estimated a minute after a pump has lost a fifth of what it gives."""
    plant = reactor()
    twin = follow(disturbed(4, int(ONSET_S) + 60, f"K_P1 * 0.8 from {ONSET_S:.0f}"), 4)
    window = twin._history.window(400)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    evidence = Evidence(plant.model, Carrier(plant.model, plant.description), window, twin._posterior, accuracy)
    prior = Prior(plant.description.faults, window, evidence.variables, {})
    modes = [m for m in plant.description.generated if m.component == "P1"]
    return Estimation(evidence, modes, prior, ())


def narrowed(sd: float) -> Estimate:
    """The pump's loss, said with a standard deviation of ``sd`` [L/s]."""
    best = next(e for e in estimation().estimates(ONSET_S + 10.0) if e.state.fault == "unknown_P1_K_P1")
    (found,) = estimation()._narrowed([Estimate(best.state, sd, best.score)])
    return found


def test_a_size_that_readings_tell_is_not_said_to_be_any() -> None:
    best, wide = narrowed(1e-6), narrowed(0.25 * 0.2 * GAIN)
    assert best.state.severity < -0.1 * GAIN
    assert wide.state == best.state and wide.sd < 0.5 * 0.25 * 0.2 * GAIN, "much less than it was tried with"


def test_nothing_is_said_with_more_certainty_than_it_was() -> None:
    assert narrowed(1e-6).sd == 1e-6


def test_two_ways_to_the_same_size_say_the_same_of_it() -> None:
    one, other = narrowed(0.3 * 0.2 * GAIN).sd, narrowed(0.15 * 0.2 * GAIN).sd
    assert 0.4 <= one / other <= 2.5
