"""Where each quantity of the Mixing Module stands in the engine's arrays.

The kernels index rows of plain arrays; these named tuples are the only place that knows the positions. Tanks are
numbered 1 to 4 for B201 to B204, so that a tank's column is the first tank's plus an offset.
"""

from __future__ import annotations

from typing import NamedTuple

TANKS = 4
"""B201, B202, B203 (feed) and B204 (collecting)."""
FEEDS = 3
"""B201, B202, B203."""
VALVES = 8
"""Inlets of the feed tanks, their outlets, the valve before B204, the drain of B204."""


class State(NamedTuple):
    """Row of the state array."""

    V1: int  # liquid in each tank [L]
    V2: int
    V3: int
    V4: int
    L1: int  # true levels [m]
    L2: int
    L3: int
    L4: int
    P1: int  # true pressures: at the floors of the tanks, behind P101 and in the header [kPa]
    P2: int
    P3: int
    P4: int
    P5: int
    P6: int
    VI1_pos: int  # valve positions, 1 open [1]: inlets, outlets, before B204, drain
    VI2_pos: int
    VI3_pos: int
    VO1_pos: int
    VO2_pos: int
    VO3_pos: int
    VI4_pos: int
    VO4_pos: int
    N1: int  # pump speeds as a fraction of the rated speed [1]: P101, P102
    N2: int
    head_suction: int  # heads of the junctions above the floor of the feed tanks [m]
    head_main: int
    head_discharge: int
    LT1: int  # last readings: levels [m], pressures of tanks, behind P101 and in the header [kPa], flow [L/s]
    LT2: int
    LT3: int
    LT4: int
    PT1: int
    PT2: int
    PT3: int
    PT4: int
    PT5: int
    PT6: int
    FT: int
    LSL1: int  # level switches, 1 when the liquid stands above them: 10 %, 50 %, 90 % of each tank's height
    LSL2: int
    LSL3: int
    LSL4: int
    LSM1: int
    LSM2: int
    LSM3: int
    LSM4: int
    LSH1: int
    LSH2: int
    LSH3: int
    LSH4: int
    ST1: int  # speed readings [1]
    ST2: int
    idle1: int  # seconds that a pump has been running without flow, as its drive counts them [s]
    idle2: int
    no_flow1: int  # the same by the true flow [s]
    no_flow2: int
    q_in1: int  # true flows of the last second [L/s]
    q_in2: int
    q_in3: int
    q_out1: int
    q_out2: int
    q_out3: int
    q_main: int
    q_bypass: int
    q_transfer: int
    q_drain: int
    q_leak: int
    q_over: int
    supplied: int  # totals since t = 0 [L]
    delivered: int
    spilled: int
    overflowed: int
    dry_s: int  # seconds that a pump ran dry, and against a closed line, longer than is allowed [s]
    dead_head_s: int


class Parameter(NamedTuple):
    """Row of the parameter array; meaning, value, unit and uncertainty are in ``engineering/parameters.csv``."""

    area: int
    height_feed: int
    height_B204: int
    floor_B204: int
    floor_leak: int
    pump_a: int
    pump_b: int
    pump_c: int
    bypass_size: int
    tau_pump: int
    travel: int
    k_tank: int
    k_suction: int
    k_main: int
    k_bypass: int
    k_transfer: int
    k_clog: int
    leak_size: int
    fill_rate: int
    drain_cd: int
    drain_area: int
    dry_level: int
    flow_least: int
    grace: int
    density: int
    sd_supply: int
    sd_speed: int
    sd_LT: int
    sd_PT: int
    rel_FT: int
    sd_ST: int
    bias_LT1: int
    bias_LT2: int
    bias_LT3: int
    bias_LT4: int
    bias_PT1: int
    bias_PT2: int
    bias_PT3: int
    bias_PT4: int
    bias_PT5: int
    bias_PT6: int
    bias_FT: int
    bias_ST: int


class Input(NamedTuple):
    """Row of the input schedule: commands to the valves (1 open) and speed references of the pumps [1]."""

    VI1: int
    VI2: int
    VI3: int
    VO1: int
    VO2: int
    VO3: int
    VI4: int
    VO4: int
    P1: int
    P2: int


class FaultSlot(NamedTuple):
    """Column of the fault severity and onset arrays."""

    clogging_main: int
    clogging_B201: int
    clogging_B202: int
    clogging_B203: int
    clogging_common: int
    leakage_main: int
    leakage_common: int
    pump_degradation: int
    pump_failure: int
    pump_failure_P102: int
    sensor_bias_flow: int
    sensor_stuck_flow: int
    sensor_bias_B201: int
    sensor_bias_B202: int
    sensor_bias_B203: int
    sensor_bias_B204: int
    sensor_drift_B201: int
    sensor_drift_B202: int
    sensor_drift_B203: int
    sensor_drift_B204: int
    sensor_stuck_B201: int
    sensor_stuck_B202: int
    sensor_stuck_B203: int
    sensor_stuck_B204: int
    stuck_closed_VI201: int
    stuck_closed_VI202: int
    stuck_closed_VI203: int
    stuck_closed_VO201: int
    stuck_closed_VO202: int
    stuck_closed_VO203: int
    stuck_closed_VI204: int
    stuck_closed_VO204: int
    stuck_open_VI201: int
    stuck_open_VI202: int
    stuck_open_VI203: int
    stuck_open_VO201: int
    stuck_open_VO202: int
    stuck_open_VO203: int
    stuck_open_VI204: int
    stuck_open_VO204: int


S = State(*range(len(State._fields)))
P = Parameter(*range(len(Parameter._fields)))
U = Input(*range(len(Input._fields)))
F = FaultSlot(*range(len(FaultSlot._fields)))
