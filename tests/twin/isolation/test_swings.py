"""What swings: found with its size and period, believed over its turns, and no reading is corrected by it."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.settings.adopted import why_not
from homeostat.record.story.wording import named
from homeostat.twin.forecast import forecast
from homeostat.twin.twin import Twin
from tests.twin.followed import disturbed, follow, reactor

ONSET_S = 1450
TABLES = tuple(fault.name for fault in reactor().description.faults)
LEVEL = f"L1 reads + 0.5 from {ONSET_S} every 200"


@functools.cache
def followed(lag_s: int, disturbance: str = LEVEL, mismatch: str = "none") -> Twin:
    return follow(disturbed(3, ONSET_S + lag_s, disturbance, mismatch=mismatch), 3)


def best(twin: Twin) -> Hypothesis:
    return twin.explain(TABLES, (), since_s=ONSET_S + 10.0)[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbance", "name", "size", "period_s"),
    [
        (LEVEL, "L1_swings", 0.5, 200.0),
        (f"T1 reads + 3 from {ONSET_S} every 300", "T1_swings", 3.0, 300.0),
        pytest.param(
            f"Cv_V1 * 0.85 from {ONSET_S} every 120", "unknown_V1_Cv_V1_swinging", None, 120.0, marks=pytest.mark.wide
        ),
        pytest.param(
            f"K_P1 * 0.8 from {ONSET_S} every 200", "unknown_P1_K_P1_swinging", None, 200.0, marks=pytest.mark.wide
        ),
    ],
)
@pytest.mark.parametrize("mismatch", ["none", pytest.param("plant", marks=pytest.mark.wide)])
def test_it_is_named_with_its_size_and_period(
    disturbance: str, name: str, size: float | None, period_s: float, mismatch: str
) -> None:
    found = followed(450, disturbance, mismatch).explain(TABLES, (), since_s=ONSET_S + 10.0)
    state = found[0].faults[0]
    assert found[0].name == name and sum(h.probability for h in found if h.name == name) >= 0.5
    assert state.period_s == pytest.approx(period_s, rel=0.05)
    turns = (state.onset_s - ONSET_S) / state.period_s
    assert abs(turns - round(2.0 * turns) / 2.0) <= 0.1, "it passes nothing when the true one does"
    if size is not None:
        assert abs(state.severity) == pytest.approx(size, rel=0.15)


@pytest.mark.parametrize("lag_s", [60, 300])
def test_what_lasts_is_not_said_to_swing(lag_s: int) -> None:
    found = followed(lag_s, f"L1 reads + 0.5 from {ONSET_S}").explain(TABLES, (), since_s=ONSET_S + 10.0)
    assert sum(h.probability for h in found if any(f.period_s for f in h.faults)) < 0.1


def test_it_is_not_over_each_time_it_passes_nothing_and_is_when_it_is() -> None:
    swings = FaultState("L1_swings", 0.49, ONSET_S + 3.0, 198.0)
    for lag_s in (390, 400, 410, 500):
        for period_s in (180.0, 198.0, 215.0):
            assert followed(lag_s).ended([(replace(swings, period_s=period_s),)]) is None, (lag_s, period_s)
    over = followed(760, f"L1 reads + 0.5 from {ONSET_S} to {ONSET_S + 400} every 200").ended([(swings,)])
    assert over is not None and over.since_s >= ONSET_S + 390.0


@pytest.mark.parametrize("name", ["L1_swings", "T1_swings", "V1.pos_swings"])
def test_no_reading_is_corrected_by_it(name: str) -> None:
    """A moment later it is another error: a limit that was watched by it would be violated by nothing, or missed."""
    nothing, swinging = Hypothesis((), 0.5), Hypothesis((FaultState(name, 0.5, ONSET_S - 30.0, 200.0),), 0.5)
    usual, errors = followed(60, f"L1 reads + 0 from {ONSET_S}").instrument_errors((nothing, swinging))
    assert errors == pytest.approx(usual, abs=1e-6)


def test_it_goes_on_in_a_forecast() -> None:
    """Rolled out the level rises and falls with the turns of what the vessel gains, about what it would be without."""
    usual = Hypothesis((), 0.5)
    swinging = Hypothesis((FaultState("unknown_mass_R1_swinging", 0.01, ONSET_S + 60.0, 300.0),), 0.5)
    e = followed(60, f"L1 reads + 0 from {ONSET_S}").ensemble((usual, swinging), draws=1)
    schedule = np.tile(reactor().start, (1, 900, 1))
    level = forecast(reactor().model, e, schedule, 5, sensor_noise=False).values["V"]
    change = (level[1] - level[0]).reshape(3, 60)
    assert change.max() > 0.03 and change.min() < -0.03
    assert change[1] == pytest.approx(change[2], abs=0.05), "one turn is like the next"


def test_a_table_cannot_adopt_it_and_its_period_is_told() -> None:
    plant: PlantDescription = reactor().description
    swinging = [m for m in plant.generated if m.effect is not None and m.effect.swings]
    compared = {f"{s.tag.name}_swings" for s in plant.signals if s.variable in reactor().twin.errors and s.component}
    assert compared & {m.name for m in swinging} and not any(not why_not(m) for m in swinging)
    assert named((FaultState("L1_swings", 0.5, 10.0, 200.0),), plant) == "L1_swings 0.5 L every 200 s"
