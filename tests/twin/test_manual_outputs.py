"""Manual outputs in sequences: a step takes an output off automatic, from where it stands, and gives it back."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.recovery import ActionSet, Command
from homeostat.twin.twin import Interruption, Twin
from tests.twin.followed import follow, readings

NOTHING = (Hypothesis((), 1.0),)
CLOSED = ActionSet((Command("V2.man", 0.0, 0.05),), "compensated")
AUTOMATIC = ActionSet((Command("V2.man", None, None),), "compensated")
LEFT = ActionSet((), "normal")


@pytest.fixture(scope="module")
def twin() -> Twin:
    return follow(readings(1, 700))


def valve(twin: Twin, first: ActionSet, then: ActionSet, after_s: float) -> np.ndarray:
    """Where the cooling valve stands in the first member, second by second."""
    found = twin.roll_out(first, NOTHING, Interruption(after_s, then))
    return np.asarray(found.trajectory.signals["V2.pos"][0])


def test_an_output_that_is_commanded_later_leaves_automatic_from_where_it_stood(twin: Twin) -> None:
    stands = valve(twin, LEFT, CLOSED, 20.0)
    before = stands[15:20].mean()
    assert before > 0.1 and stands[22] > before - 0.3
    assert (stands[60:] < 0.05).all()


def test_what_is_commanded_first_goes_as_a_schedule_has_it(twin: Twin) -> None:
    stands = valve(twin, CLOSED, LEFT, 50.0)
    at_once = np.asarray(twin.roll_out(CLOSED, NOTHING).trajectory.signals["V2.pos"][0])
    assert stands[:50] == pytest.approx(at_once[:50], abs=0.05)


def test_an_output_is_given_back_to_its_controller(twin: Twin) -> None:
    stands = valve(twin, CLOSED, AUTOMATIC, 30.0)
    assert stands[25:30].max() < 0.1 and stands[200:].mean() > 0.1
