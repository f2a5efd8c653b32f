"""What the instruments of the Mixing Module show (compiled)."""

import math

from homeostat.plants.mixing_module.layout import TANKS, F, P, S
from homeostat.process.compiled import compiled
from homeostat.process.equipment import clip
from homeostat.process.noise import normal
from homeostat.process.types import Vec

GRAVITY = 9.80665
"""Standard gravity [m/s^2]."""


@compiled
def level(x: Vec, p: Vec, tank: int) -> float:
    """Level above the tank's floor [m]: liquid over cross-section."""
    return float(x[S.V1 + tank] / p[P.area])


@compiled
def tank_height(p: Vec, tank: int) -> float:
    """Height of the tank's brim above its floor [m]."""
    return float(p[P.height_B204] if tank == TANKS - 1 else p[P.height_feed])


@compiled
def pressure(p: Vec, head: float) -> float:
    """Hydrostatic pressure [kPa] of a column of ``head`` [m], rho g h. Check: 1 m of water at 998 kg/m3, 9.787 kPa."""
    return float(p[P.density] * GRAVITY * head / 1000.0)


@compiled
def measure_tanks(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, seed: int, sensor: float) -> None:
    """Levels, hydrostatic pressures and switches; a stuck transmitter keeps its last reading."""
    k = math.floor(t + 0.5)
    for i in range(TANKS):
        true = x[S.L1 + i] = level(x, p, i)
        if not (sev[F.sensor_stuck_B201 + i] > 0.0 and t >= onset[F.sensor_stuck_B201 + i]):
            shown = true + p[P.bias_LT1 + i]
            if t >= onset[F.sensor_bias_B201 + i]:
                shown += sev[F.sensor_bias_B201 + i]
            if t >= onset[F.sensor_drift_B201 + i]:
                shown += sev[F.sensor_drift_B201 + i] * (t - onset[F.sensor_drift_B201 + i])
            if sensor > 0.0:
                shown += sensor * p[P.sd_LT] * normal(seed, k, i)
            x[S.LT1 + i] = shown
        x[S.P1 + i] = pressure(p, true)
        x[S.PT1 + i] = x[S.P1 + i] + p[P.bias_PT1 + i]
        if sensor > 0.0:
            x[S.PT1 + i] += sensor * p[P.sd_PT] * normal(seed, k, 4 + i)
        height = tank_height(p, i)
        x[S.LSL1 + i] = 1.0 if true >= 0.1 * height else 0.0
        x[S.LSM1 + i] = 1.0 if true >= 0.5 * height else 0.0
        x[S.LSH1 + i] = 1.0 if true >= 0.9 * height else 0.0


@compiled
def measure_line(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, seed: int, sensor: float) -> None:
    """Flow, discharge pressure and pump speeds; every reading at ``t`` [s], ``sensor`` scales all noise (0 or 1)."""
    k = math.floor(t + 0.5)
    if not (sev[F.sensor_stuck_flow] > 0.0 and t >= onset[F.sensor_stuck_flow]):
        shown = x[S.q_transfer] * (1.0 + p[P.bias_FT])
        if t >= onset[F.sensor_bias_flow]:
            shown *= 1.0 + sev[F.sensor_bias_flow]
        if sensor > 0.0:
            shown += sensor * p[P.rel_FT] * (abs(shown) + 0.02) * normal(seed, k, 8)
        x[S.FT] = shown
    x[S.P5], x[S.P6] = pressure(p, x[S.head_main]), pressure(p, x[S.head_discharge])
    x[S.PT5], x[S.PT6] = x[S.P5] + p[P.bias_PT5], x[S.P6] + p[P.bias_PT6]
    x[S.ST1], x[S.ST2] = x[S.N1] + p[P.bias_ST], x[S.N2] + p[P.bias_ST]
    if sensor > 0.0:
        x[S.PT5] += sensor * p[P.sd_PT] * normal(seed, k, 9)
        x[S.PT6] += sensor * p[P.sd_PT] * normal(seed, k, 14)
        x[S.ST1] = clip(x[S.ST1] + sensor * p[P.sd_ST] * normal(seed, k, 10), 0.0, 1.5)
        x[S.ST2] = clip(x[S.ST2] + sensor * p[P.sd_ST] * normal(seed, k, 11), 0.0, 1.5)


@compiled
def supervise_pumps(x: Vec, p: Vec, dt: float) -> None:
    """Each drive counts the seconds that its pump runs without flow, which it finds from the load of its motor.

    Below the least flow a running pump is dry (nothing to draw) or works against a closed line (dead head); what goes
    beyond the grace period that a start needs is added up.
    """
    total = x[S.q_main] + x[S.q_bypass]
    wet = max(x[S.q_out1], x[S.q_out2], x[S.q_out3])
    for j in range(2):
        running = x[S.N1 + j] > 0.1
        short = x[S.q_main + j] < p[P.flow_least]
        x[S.no_flow1 + j] = x[S.no_flow1 + j] + dt if running and short else 0.0
        x[S.idle1 + j] = x[S.no_flow1 + j]
        if x[S.no_flow1 + j] > p[P.grace]:
            if x[S.head_suction] < 0.0 and wet < p[P.flow_least] and total < p[P.flow_least]:
                x[S.dry_s] += dt
            else:
                x[S.dead_head_s] += dt
