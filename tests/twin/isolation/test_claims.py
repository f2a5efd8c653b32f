"""Claims: whoever takes the place of what was known since an hour ago must explain what was read then."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.carried import Carrier
from homeostat.twin.history import Window
from homeostat.twin.isolation.claims import FEWEST, MOST_NATS, Claims, Past, forgotten
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.twin import Twin
from tests.twin.followed import disturbed, follow, reactor

ONSET_S, NOW_S = 1450.0, 3000
FOULED = FaultState("fouling", 0.6, ONSET_S)
HOT = FaultState("temp_bias", 5.0, ONSET_S)


@functools.cache
def seen() -> Twin:
    """Half an hour with a jacket that gives off less and less."""
    return follow(disturbed(3, NOW_S, f"UA * 0.7 from {ONSET_S:.0f} over 600"), 3)


def claims(past: Past, *said: FaultState) -> Claims:
    """Charges beside what was ``said``, by the last ten minutes."""
    twin, plant = seen(), reactor()
    window = twin._history.window(600)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    evidence = Evidence(plant.model, Carrier(plant.model, plant.description), window, twin._posterior, accuracy)
    return Claims(said[:1], [(f,) for f in said], evidence, window.at_s(1), past)


def around(at_s: float, after_s: float = 600.0) -> Window | None:
    return seen()._history.around(at_s, 120.0, after_s)


def test_what_the_readings_of_then_refute_is_charged() -> None:
    """A thermometer that begins to read 5 K high is seen at once, and nothing of it was."""
    assert claims(around, FOULED).of((HOT,)) == MOST_NATS


def test_what_explains_them_as_well_is_not() -> None:
    jacket = FaultState("unknown_heat_R1_UA_growing", -0.3, ONSET_S)
    assert claims(around, FOULED).of((jacket,)) == 0.0


@pytest.mark.parametrize(
    "faults",
    [(), (FOULED,), (FaultState("fouling", 0.3, ONSET_S),), (FaultState("temp_bias", 5.0, NOW_S - 200.0),)],
)
def test_what_was_said_or_began_since_claims_nothing(faults: tuple[FaultState, ...]) -> None:
    assert claims(around, FOULED).of(faults) == 0.0
    assert claims(around, FOULED, HOT).of((HOT,)) == 0.0


@pytest.mark.parametrize("past", [forgotten, lambda at_s: around(at_s, FEWEST - 2.0)])
def test_where_hardly_anything_is_held_of_then_nobody_can_say(past: Past) -> None:
    assert claims(past, FOULED).of((HOT,)) == 0.0


def test_a_size_is_charged_as_the_first_that_was_asked() -> None:
    asked = claims(around, FOULED)
    small = FaultState("temp_bias", 1.0, ONSET_S)
    assert asked.of((HOT,)) == asked.of((small,)) == MOST_NATS
    assert asked.of((FaultState("temp_bias", 5.0, ONSET_S + 60.0),)) == MOST_NATS, "another beginning is another claim"


def test_what_is_beside_what_was_known_is_charged_by_its_own_beginning() -> None:
    later = FaultState("temp_bias", 5.0, ONSET_S + 500.0)
    assert claims(around, FOULED).of((FOULED, later)) > 5.0


def test_what_breaks_the_model_is_charged_as_much_as_anything() -> None:
    impossible = FaultState("unknown_heat_R1_UA", 1e9, ONSET_S)
    assert claims(around, FOULED).of((impossible,)) == MOST_NATS


def test_a_thermometer_does_not_take_the_place_of_a_jacket() -> None:
    """All that speaks against it now is what a model errs by; what was read then speaks clearly."""
    known = (FOULED,)
    said = tuple(Hypothesis((f,), p) for f, p in ((FOULED, 0.98), (FaultState("fouling", 0.5, ONSET_S), 0.02)))
    found = seen().explain(("fouling", "temp_bias"), known, since_s=ONSET_S, before=said, news=True)
    assert sum(h.probability for h in found if h.name == "temp_bias") < 0.05


def test_readings_around_a_time_are_those_that_were_read() -> None:
    history = seen()._history
    found, whole = history.around(ONSET_S, 100.0, 200.0), history.whole
    assert found is not None and (found.start_s, found.end_s) == (ONSET_S - 100.0, ONSET_S + 200.0)
    first = whole.row(found.start_s)
    assert all(
        np.array_equal(r, whole.readings[v][first : first + 301], equal_nan=True) for v, r in found.readings.items()
    )
    early = history.around(50.0, 100.0, 200.0)
    assert early is not None and early.start_s == whole.start_s, "as far as it is held"
    assert history.around(whole.start_s + 5.0, 100.0, 200.0) is None, "too little before it to begin with"
    late = history.around(NOW_S - 10.0, 100.0, 200.0)
    assert late is not None and late.end_s == whole.end_s
