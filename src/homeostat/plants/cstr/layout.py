"""Where each quantity of the reactor stands in the engine's arrays.

The kernels index rows of plain arrays; these named tuples are the only place that knows the positions.
"""

from __future__ import annotations

from typing import NamedTuple


class State(NamedTuple):
    """Row of the state array."""

    V: int  # liquid volume [L]
    CA: int  # concentrations [mol/L]
    CB: int
    CC: int
    CD: int
    T: int  # reactor temperature [K]
    V1_pos: int  # actuator positions [1]
    P1_pos: int
    V2_pos: int
    XV1_pos: int
    V1_cmd: int  # controller outputs [1]
    P1_cmd: int
    V2_cmd: int
    flow_integral: int  # integral terms of the three loops [1]
    level_integral: int
    temperature_integral: int
    phase: int  # 0 STARTUP, 1 NORMAL, 2 SHUTDOWN
    feed_CA: int  # filtered feed disturbances, in standard deviations of the unfiltered one
    feed_CD: int
    feed_T: int
    T1: int  # last measured values, in the unit of their tag
    L1: int
    F1: int
    F2: int
    F3: int
    T2: int
    T3: int
    T1_ideal: int  # what T1 and L1 would read without noise
    L1_ideal: int
    V1_zt: int
    P1_zt: int
    V2_zt: int
    F1_true: int  # true flows of the last step [L/s]
    F2_true: int
    F3_true: int
    leak: int
    overflow: int
    T2_true: int  # feed and cooling water temperature of the last step [K]
    T3_true: int
    UA: int  # effective heat transfer coefficient of the last step [W/K]
    product: int  # liquid delivered by P1 since t = 0 [L]
    V1_travel: int  # accumulated movement of each actuator since t = 0 [1]
    P1_travel: int
    V2_travel: int
    V1_rate: int  # movement of each actuator in the last second [1/s]
    P1_rate: int
    V2_rate: int


class Parameter(NamedTuple):
    """Row of the parameter array; meaning, value, unit and uncertainty are in ``engineering/parameters.csv``."""

    UA: int
    UA_ambient: int
    T_ambient: int
    cp: int
    T_feed: int
    T_coolant: int
    CA_feed: int
    CD_feed: int
    k0_AD: int
    E_AD: int
    k0_A: int
    E_A: int
    dH_AD: int
    dH_A: int
    Cv_V1: int
    K_P1: int
    F3_max: int
    tau_V1: int
    tau_P1: int
    tau_V2: int
    tau_XV1: int
    V_brim: int
    k_brim: int
    tau_fouling: int
    Kp_flow: int
    Ki_flow: int
    Kp_level: int
    Ki_level: int
    trim_low: int
    feedforward_P1: int
    Kp_temperature: int
    Ki_temperature: int
    t_startup: int
    t_shutdown: int
    L_heel: int
    sd_CA_feed: int
    sd_CD_feed: int
    sd_T_feed: int
    tau_feed: int
    published_balance: int
    sd_T1: int
    sd_L1: int
    rel_F1: int
    rel_F2: int
    rel_F3: int
    sd_T2: int
    sd_T3: int
    sd_ZT: int
    bias_T1: int
    bias_L1: int
    bias_F1: int
    bias_F2: int
    bias_F3: int
    bias_T2: int
    bias_T3: int
    bias_ZT1: int
    bias_ZTP: int
    bias_ZT2: int


class Input(NamedTuple):
    """Row of the input schedule; NaN in a manual output means automatic, in T2_in the model's own feed."""

    T1_sp: int
    L1_sp: int
    F1_sp: int
    V1_man: int
    P1_man: int
    V2_man: int
    XV1_cmd: int
    T2_in: int


class FaultSlot(NamedTuple):
    """Column of the fault severity and onset arrays."""

    fouling: int
    pump_degrade: int
    cool_stuck_closed: int
    cool_stuck_open: int
    outlet_block: int
    inlet_stuck_open: int
    temp_bias: int
    level_bias: int
    leak: int


S = State(*range(len(State._fields)))
P = Parameter(*range(len(Parameter._fields)))
U = Input(*range(len(Input._fields)))
F = FaultSlot(*range(len(FaultSlot._fields)))
