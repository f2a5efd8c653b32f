"""How far a replay goes back: not to before something ended that nobody assumes any more."""

from __future__ import annotations

import math

import numpy as np

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.process.types import Vec
from homeostat.twin.carried import Carrier
from homeostat.twin.looking_back import LEAST, looked_back_s
from homeostat.twin.twin import Twin
from tests.twin.followed import reactor
from tests.twin.isolation.test_ends import ONSET_S, REPAIRED_S, mended

NOTHING = [Hypothesis((), 1.0)]


def test_it_goes_back_as_far_as_the_settings_say_but_for_what_ended_since() -> None:
    """By hand: what ended 9 s ago leaves 9 s, what ended just now as few readings as may be."""
    plant = reactor()
    carrier, settings = Carrier(plant.model, plant.description), plant.twin
    stuck = [Hypothesis((FaultState("T1_frozen", 1.0, 900.0),), 1.0)]
    for hypotheses, over_s, told_s in (
        (NOTHING, -math.inf, settings.synchronise_s),
        (NOTHING, 991.0, 9.0),
        (NOTHING, 1000.0, LEAST * 1.0),
        (stuck, 991.0, max(settings.synchronise_s, 100.0 + settings.settle_rows + 1)),
    ):
        assert looked_back_s(hypotheses, carrier, settings, 1000.0, over_s, 1.0) == told_s


def test_a_plant_whose_valve_came_free_stands_where_it_is_read() -> None:
    """Replayed from before without the fault the feed was shut by its controller all the time, and it was elsewhere."""
    twin = mended("inlet_stuck_open", 0.85, 3, REPAIRED_S + 12.0)
    read = float(np.mean([twin._history.window(8).readings["T1"]]))
    twin.believe((FaultState("inlet_stuck_open", 0.85, ONSET_S),))
    before = _temperatures(twin)
    twin.believe((), REPAIRED_S + 3.0)
    after = _temperatures(twin)
    assert np.all(np.abs(after - read) < 1.0)
    assert np.mean(np.abs(before - read)) > 2.0 * np.mean(np.abs(after - read))


def _temperatures(twin: Twin) -> Vec:
    temperature = list(twin._model.states).index("T")
    return np.asarray(twin.ensemble(NOTHING, 12).states[:, temperature])
