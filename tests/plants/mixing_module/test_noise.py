"""Noise of the module: as large as the tables say, independent between instruments and seconds, and no more."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.plants.mixing_module.layout import S
from homeostat.process.types import Table
from tests.plants.mixing_module.module import MODEL, NOMINAL, batch, inputs, parameters, run, start

POND = parameters(area=1e5, height_feed=10.0)
"""So wide that levels stay, and with them the flow; 10 m high so that a litre is not over the brim."""
STEPS = 2000
READINGS = [f"LT{i}" for i in (1, 2, 3, 4)] + [f"PT{i}" for i in (1, 2, 3, 4, 5, 6)] + ["FT", "ST1", "ST2"]
STEADY = run(batch(60, p=POND, x=start(POND, B201=0.2, B204=0.122), u=inputs(VO1=1.0, VI4=1.0, P1=0.9, P2=0.5))).state


def residuals(process: float, sensor: float) -> Table:
    """Readings less those without noise, shape (times, READINGS)."""
    u = inputs(VO1=1.0, VI4=1.0, P1=0.9, P2=0.5)
    noisy, quiet = (
        run(batch(STEPS, p=POND, x=STEADY, u=u, process=a, sensor=b)) for a, b in ((process, sensor), (0, 0))
    )
    return np.stack([noisy.of(n) - quiet.of(n) for n in READINGS], axis=1)


@pytest.fixture(scope="module")
def noise() -> Table:
    return residuals(0.0, 1.0)


def test_every_reading_has_the_noise_of_its_table(noise: Table) -> None:
    """The flow meter's is 1 % of its reading of 0.13 L/s and of 0.02 L/s more."""
    flow = run(batch(1, p=POND, x=STEADY, u=inputs(VO1=1.0, VI4=1.0, P1=0.9, P2=0.5))).of("FT")[0]
    sd = {
        "LT": NOMINAL["sd_LT"],
        "PT": NOMINAL["sd_PT"],
        "ST": NOMINAL["sd_ST"],
        "FT": NOMINAL["rel_FT"] * (flow + 0.02),
    }
    for k, name in enumerate(READINGS):
        # 2000 draws: the standard deviation is known to 1.6 %, the mean to 2.2 % of it.
        assert noise[:, k].std() == pytest.approx(sd[name[:2]], rel=0.08), name
        assert abs(noise[:, k].mean()) < 0.1 * sd[name[:2]], name


def test_no_two_instruments_and_no_two_seconds_share_their_noise(noise: Table) -> None:
    between = np.corrcoef(noise.T) - np.eye(len(READINGS))
    assert np.abs(between).max() < 0.1
    for k, name in enumerate(READINGS):
        assert abs(np.corrcoef(noise[1:, k], noise[:-1, k])[0, 1]) < 0.1, name


def test_the_pumps_disturbance_moves_the_flow_and_the_supplys_the_fill() -> None:
    """Speed by 2 %: q goes as n where there is hardly a lift, so that the flow's is 2 % too. Supply by 3 %."""
    u = inputs(VO1=1.0, VI4=1.0, P1=0.9, VI2=1.0)
    x = start(POND, B201=0.2, B204=0.122, VO1=1.0, VI4=1.0, VI2=1.0, n=(0.9, 0.0))
    rough, calm = (run(batch(STEPS, p=POND, x=x, u=u, process=a)) for a in (1.0, 0.0))
    for name, sd in (("q_transfer", NOMINAL["sd_speed"]), ("q_in2", NOMINAL["sd_supply"])):
        share = rough.of(name) / calm.of(name) - 1.0
        assert share.std() == pytest.approx(sd, rel=0.1), name
        assert abs(np.corrcoef(share[1:], share[:-1])[0, 1]) < 0.1
    assert abs(np.corrcoef(rough.of("q_transfer"), rough.of("q_in2"))[0, 1]) < 0.1


def test_sensor_noise_changes_no_more_than_readings() -> None:
    line = inputs(VI1=0.5, VO1=1.0, VI4=1.0, P1=0.9)
    noisy, quiet = (run(batch(100, x=start(B201=0.1), u=line, sensor=s)) for s in (1.0, 0.0))
    differ = {n for i, n in enumerate(MODEL.states) if not np.array_equal(noisy.record[..., i], quiet.record[..., i])}
    assert set(READINGS) <= differ <= {*READINGS, "idle1", "idle2"}


def test_speed_readings_stay_within_their_range_and_a_standing_pump_never_turns_backwards() -> None:
    result = run(batch(500, sensor=1.0))
    assert result.of("ST1").min() == 0.0 and result.of("ST1").max() < 0.05
    assert not result.record[0, :, [S.N1, S.N2, S.q_transfer]].any()
