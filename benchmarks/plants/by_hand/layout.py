"""Where each quantity of the reactor stands in the engine's arrays.

The kernels index rows of plain arrays; these named tuples are the only place that knows the positions.
"""

from collections import namedtuple

StateSlot = namedtuple(
    "StateSlot",
    "V "  # liquid volume [L]
    "CA CB CC CD "  # concentrations [mol/L]
    "T "  # reactor temperature [K]
    "V1_pos P1_pos V2_pos XV1_pos "  # actuator positions [1]
    "V1_cmd P1_cmd V2_cmd "  # controller outputs [1]
    "flow_integral level_integral temperature_integral "  # integral terms of the three loops [1]
    "phase "  # 0 STARTUP, 1 NORMAL, 2 SHUTDOWN
    "feed_CA feed_CD feed_T "  # filtered feed disturbances, in standard deviations of the unfiltered one
    "T1 L1 F1 F2 F3 T2 T3 "  # last measured values, in the unit of their tag
    "T1_ideal L1_ideal V1_zt P1_zt V2_zt "  # what T1 and L1 would read without noise
    "F1_true F2_true F3_true leak overflow "  # true flows of the last step [L/s]
    "T2_true T3_true "  # feed and cooling water temperature of the last step [K]
    "UA "  # effective heat transfer coefficient of the last step [W/K]
    "product "  # liquid delivered by P1 since t = 0 [L]
    "V1_travel P1_travel V2_travel "  # accumulated movement of each actuator since t = 0 [1]
    "V1_rate P1_rate V2_rate",  # movement of each actuator in the last second [1/s]
)
"""Row of the state array."""

Parameter = namedtuple(
    "Parameter",
    "UA UA_ambient T_ambient cp T_feed T_coolant CA_feed CD_feed k0_AD E_AD k0_A E_A dH_AD dH_A Cv_V1 K_P1 "
    "F3_max tau_V1 tau_P1 tau_V2 tau_XV1 V_brim k_brim tau_fouling Kp_flow Ki_flow Kp_level Ki_level trim_low "
    "feedforward_P1 Kp_temperature Ki_temperature t_startup t_shutdown L_heel sd_CA_feed sd_CD_feed sd_T_feed "
    "tau_feed published_balance sd_T1 sd_L1 rel_F1 rel_F2 rel_F3 sd_T2 sd_T3 sd_ZT bias_T1 bias_L1 bias_F1 "
    "bias_F2 bias_F3 bias_T2 bias_T3 bias_ZT1 bias_ZTP bias_ZT2",
)
"""Row of the parameter array; meaning, value, unit and uncertainty are in ``engineering/parameters.csv``."""

Input = namedtuple("Input", "T1_sp L1_sp F1_sp V1_man P1_man V2_man XV1_cmd T2_in T3_in")
"""Row of the input schedule; NaN in a manual output means automatic, in the readings T2_in and T3_in unknown."""

FaultSlot = namedtuple(
    "FaultSlot",
    "fouling pump_degrade cool_stuck_closed cool_stuck_open outlet_block inlet_stuck_open temp_bias level_bias leak",
)
"""Column of the fault severity and onset arrays."""

S = StateSlot(*range(len(StateSlot._fields)))
P = Parameter(*range(len(Parameter._fields)))
U = Input(*range(len(Input._fields)))
F = FaultSlot(*range(len(FaultSlot._fields)))
