"""Standing: an actuator that stands still is named as that, since when it stands, and it goes on standing."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.forecast import forecast
from homeostat.twin.twin import Twin
from tests.twin.followed import disturbed, follow, reactor

ONSET_S = 1450
TABLES = tuple(fault.name for fault in reactor().description.faults)


@functools.cache
def followed(disturbance: str, lag_s: int, mismatch: str = "none") -> Twin:
    return follow(disturbed(3, ONSET_S + lag_s, disturbance, mismatch=mismatch), 3)


@pytest.mark.parametrize("mismatch", ["none", pytest.param("plant", marks=pytest.mark.wide)])
def test_a_pump_that_stands_still_is_no_level_that_drifts(mismatch: str) -> None:
    twin = followed(f"P1 stiction 0.5 from {ONSET_S}", 200, mismatch)
    found = twin.explain(TABLES, (), since_s=ONSET_S + 180.0)
    assert found[0].name == "P1_stuck" and sum(h.probability for h in found if h.name == "P1_stuck") >= 0.9
    assert found[0].faults[0].onset_s == pytest.approx(ONSET_S, abs=40.0) and found[0].between is None


def test_what_has_stood_since_before_the_readings_is_seen_as_well() -> None:
    twin = followed(f"P1 stiction 0.5 from {ONSET_S}", 800)
    found = twin.explain(TABLES, (), since_s=ONSET_S + 799.0, from_s=ONSET_S + 400.0)
    assert "P1_stuck" in {h.name for h in found if h.probability >= 0.3}


@pytest.mark.slow
@pytest.mark.parametrize("lag_s", [60, 400])
@pytest.mark.parametrize("disturbance", [f"L1 reads + 0 from {ONSET_S}", f"L1 reads - 0.5 from {ONSET_S}"])
def test_what_moves_is_not_said_to_stand(disturbance: str, lag_s: int) -> None:
    found = followed(disturbance, lag_s).explain(TABLES, (), since_s=ONSET_S + 10.0)
    assert standing_still(found) < 0.05


@pytest.mark.slow
def test_what_is_not_explained_is_not_blamed_on_a_pump_that_stands() -> None:
    """Over a weir that is lower flows what no cause of this plant is; the pump does what it is told."""
    twin = followed(f"V_brim - 1.5 from {ONSET_S}", 600, "plant")
    found = twin.explain(TABLES, (FaultState("leak", 0.0009, ONSET_S - 5.0),), since_s=ONSET_S + 5.0)
    assert sum(h.probability for h in found if any(f.fault == "P1_stuck" for f in h.faults)) < 0.05


@pytest.mark.slow
def test_a_valve_that_stands_is_accused_by_whatever_name() -> None:
    """The tables have a cooling valve that is stuck, and say how far it is shut: that name is used where it fits."""
    found = followed(f"V2 stiction 1 from {ONSET_S}", 400).explain(TABLES, (), since_s=ONSET_S + 60.0)
    assert found[0].name in {"cool_stuck_closed", "cool_stuck_open", "V2_stuck"}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 5, 6])
def test_a_pump_that_is_slow_is_not_said_to_stand_for_sure(seed: int) -> None:
    """Both stand at first; as it comes nevertheless, it is slow."""
    slow = f"P1 slow 40 from {ONSET_S}"
    early, late = (follow(disturbed(seed, ONSET_S + lag_s, slow), seed) for lag_s in (90, 400))
    assert standing_still(early.explain(TABLES, (), since_s=ONSET_S + 60.0)) < 0.9
    assert standing_still(late.explain(TABLES, (), since_s=ONSET_S + 60.0)) < 0.05


def standing_still(found: tuple[Hypothesis, ...]) -> float:
    return sum(h.probability for h in found if any(f.fault.endswith("_stuck") for f in h.faults))


def test_it_goes_on_standing_in_a_forecast() -> None:
    plant, stands = reactor(), Hypothesis((FaultState("P1_stuck", 1.0, ONSET_S + 20.0),), 0.5)
    e = followed(f"L1 reads + 0 from {ONSET_S}", 60).ensemble((Hypothesis((), 0.5), stands), draws=1)
    schedule = np.tile(plant.start, (1, 300, 1))
    schedule[:, :, plant.model.inputs.index("L1_sp")] = 8.0
    flow = forecast(plant.model, e, schedule, 5, sensor_noise=False).values["F2"]
    assert flow[0][0] > 1.5 * flow[1][0], "a pump that moves draws the level down"
    assert np.ptp(flow[1]) < 0.02 * flow[1].mean(), "one that stands gives what it gave"


def test_every_actuator_with_an_uncertain_lag_may_stand_still() -> None:
    plant = reactor().description
    stuck = {m.name: m for m in plant.generated if m.name.endswith("_stuck")}
    assert set(stuck) == {"V1_stuck", "V2_stuck", "P1_stuck", "XV1_stuck"}
    assert all(m.disables == m.component and not m.unknown for m in stuck.values())
