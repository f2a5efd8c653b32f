"""Growth: what grows is forecast to go on for as long again as it has, and no further than the tables let it."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.process.moves import Move
from homeostat.twin.carried import GROWS_ON, Carrier
from homeostat.twin.history import Window
from tests.twin.followed import reactor

AT_S = 1470.0


def carried(fault: str, severity: float, onset_s: float) -> Move:
    """What the twin does for ``fault`` at :data:`AT_S`."""
    plant = reactor()
    window = Window(AT_S - 4.0, {}, np.zeros((5, len(plant.model.inputs))))
    ((move,),) = Carrier(plant.model, plant.description).carry([(FaultState(fault, severity, onset_s),)], window).moves
    return move


@pytest.mark.parametrize("age_s", [30.0, 100.0])
def test_what_grows_goes_on_for_as_long_again(age_s: float) -> None:
    move = carried("T1_drifts_down", 0.001, AT_S - age_s)
    assert move.grows and move.grown_s == pytest.approx((1.0 + GROWS_ON) * age_s)


def test_but_no_further_than_the_lasting_error_that_the_tables_have() -> None:
    lasting = reactor().description.fault_mode("L1_reads_high").severity_range.high
    move = carried("L1_drifts_up", 0.05, AT_S - 60.0)
    assert lasting / 0.05 < 2.0 * 60.0, "it would come further in as long again"
    assert move.grown_s == pytest.approx(max(lasting / 0.05, 60.0))


def test_what_has_come_further_already_is_as_far_as_it_is() -> None:
    assert carried("L1_drifts_up", 5.0, AT_S - 60.0).grown_s == 60.0


def test_what_has_just_begun_does_not_grow_and_what_lasts_has_no_end() -> None:
    assert carried("L1_drifts_up", 0.05, AT_S).grown_s == 0.0
    assert carried("L1_reads_high", 0.5, AT_S - 60.0).change(1e6) == pytest.approx(0.5)
