"""Where each quantity of the Mixing Module stands in the engine's arrays.

The kernels index rows of plain arrays; these named tuples are the only place that knows the positions. Tanks are
numbered 1 to 4 for B201 to B204, so that a tank's column is the first tank's plus an offset.
"""

from collections import namedtuple

TANKS = 4
"""B201, B202, B203 (feed) and B204 (collecting)."""
FEEDS = 3
"""B201, B202, B203."""
VALVES = 8
"""Inlets of the feed tanks, their outlets, the valve before B204, the drain of B204."""

StateSlot = namedtuple(
    "StateSlot",
    "V1 V2 V3 V4 "  # liquid in each tank [L]
    "L1 L2 L3 L4 "  # true levels [m]
    "P1 P2 P3 P4 P5 P6 "  # true pressures: at the floors of the tanks, behind P101 and in the header [kPa]
    # valve positions, 1 open [1]: inlets, outlets, before B204, drain
    "VI1_pos VI2_pos VI3_pos VO1_pos VO2_pos VO3_pos VI4_pos VO4_pos "
    "N1 N2 "  # pump speeds as a fraction of the rated speed [1]: P101, P102
    "head_suction head_main head_discharge "  # heads of the junctions above the floor of the feed tanks [m]
    # last readings: levels [m], pressures of tanks, behind P101 and in the header [kPa], flow [L/s]
    "LT1 LT2 LT3 LT4 PT1 PT2 PT3 PT4 PT5 PT6 FT "
    # level switches, 1 when the liquid stands above them: 10 %, 50 %, 90 % of each tank's height
    "LSL1 LSL2 LSL3 LSL4 LSM1 LSM2 LSM3 LSM4 LSH1 LSH2 LSH3 LSH4 "
    "ST1 ST2 "  # speed readings [1]
    "idle1 idle2 "  # seconds that a pump has been running without flow, as its drive counts them [s]
    "no_flow1 no_flow2 "  # the same by the true flow [s]
    # true flows of the last second [L/s]
    "q_in1 q_in2 q_in3 q_out1 q_out2 q_out3 q_main q_bypass q_transfer q_drain q_leak q_over "
    "supplied delivered spilled overflowed "  # totals since t = 0 [L]
    "dry_s dead_head_s",  # seconds that a pump ran dry, and against a closed line, longer than is allowed [s]
)
"""Row of the state array."""

Parameter = namedtuple(
    "Parameter",
    "area height_feed height_B204 floor_B204 floor_leak pump_a pump_b pump_c bypass_size tau_pump travel "
    "k_tank k_suction k_main k_bypass k_transfer k_clog leak_size fill_rate drain_cd drain_area dry_level "
    "flow_least grace density sd_supply sd_speed sd_LT sd_PT rel_FT sd_ST bias_LT1 bias_LT2 bias_LT3 bias_LT4 "
    "bias_PT1 bias_PT2 bias_PT3 bias_PT4 bias_PT5 bias_PT6 bias_FT bias_ST "
    # travel of each valve as a multiple of that of all [1]: inlets, outlets, before B204, drain
    "slow_VI1 slow_VI2 slow_VI3 slow_VO1 slow_VO2 slow_VO3 slow_VI4 slow_VO4",
)
"""Row of the parameter array; meaning, value, unit and uncertainty are in ``engineering/parameters.csv``."""

Input = namedtuple("Input", "VI1 VI2 VI3 VO1 VO2 VO3 VI4 VO4 P1 P2")
"""Row of the input schedule: commands to the valves (1 open) and speed references of the pumps [1]."""

FaultSlot = namedtuple(
    "FaultSlot",
    "clogging_main clogging_B201 clogging_B202 clogging_B203 clogging_common leakage_main leakage_common "
    "pump_degradation pump_failure pump_failure_P102 sensor_bias_flow sensor_stuck_flow sensor_bias_B201 "
    "sensor_bias_B202 sensor_bias_B203 sensor_bias_B204 sensor_drift_B201 sensor_drift_B202 sensor_drift_B203 "
    "sensor_drift_B204 sensor_stuck_B201 sensor_stuck_B202 sensor_stuck_B203 sensor_stuck_B204 "
    "stuck_closed_VI201 stuck_closed_VI202 stuck_closed_VI203 stuck_closed_VO201 stuck_closed_VO202 "
    "stuck_closed_VO203 stuck_closed_VI204 stuck_closed_VO204 stuck_open_VI201 stuck_open_VI202 "
    "stuck_open_VI203 stuck_open_VO201 stuck_open_VO202 stuck_open_VO203 stuck_open_VI204 stuck_open_VO204",
)
"""Column of the fault severity and onset arrays."""

S = StateSlot(*range(len(StateSlot._fields)))
P = Parameter(*range(len(Parameter._fields)))
U = Input(*range(len(Input._fields)))
F = FaultSlot(*range(len(FaultSlot._fields)))
