"""Mistakes in settings and tables that make no sense by themselves or with one another: classes 1 to 6."""

from __future__ import annotations

from benchmarks.plants.mistake import Mistake, table
from benchmarks.plants.site import Edit

_NAMES, _UNITS, _SIGNS = "misspelt names", "wrong units", "wrong signs"
_LIMITS, _GUARDS, _PERMISSIVES = "limits", "guards and states", "permissives"

IN_TABLES: tuple[Mistake, ...] = (
    table(_NAMES, "a key of [twin]", "case.toml", "lead_s = 400", "leed_s = 400", "leed_s"),
    table(_NAMES, "the tag of production", "case.toml", 'throughput = "F1"', 'throughput = "F11"', "throughput"),
    table(_NAMES, "a variable of [twin.errors]", "case.toml", "V1_zt = [", "V1_zz = [", "V1_zz"),
    table(_NAMES, "the transition that ends start-up", "case.toml", '"t_started"', '"t_start"', "started_by"),
    table(_NAMES, "a limit of a figure", "case.toml", 'limits = ["LIM-T-HIGH"]', 'limits = ["LIM-T-HI"]', "LIM-T-HI"),
    table(_UNITS, "a limit in degrees Celsius", "limits", "T1 <= 313,", "T1 <= 40,", "LIM-T-HIGH"),
    table(
        _UNITS, "production per minute", "case.toml", "design_rate = 0.0333333333333333", "design_rate = 2",
        "design_rate",
    ),
    table(_UNITS, "a time constant in milliseconds", "parameters", "tau_V1,0.3,", "tau_V1,300,", "tau_V1", "FIC1"),
    table(_UNITS, "a feed temperature in Celsius", "parameters", "T_feed,350,", "T_feed,77,", "T_feed", "T1", "T2"),
    table(_UNITS, "a flow in m3/h", "signals", "F1,PV,L/s,", "F1,PV,m3/h,", "F1"),
    table(
        _SIGNS, "a proportional gain", "parameters", "Kp_temperature,0.002,", "Kp_temperature,-0.002,", "TIC1",
        "Kp_temperature",
    ),
    Mistake(
        _SIGNS, "both gains of the level loop",
        (
            Edit("engineering/parameters.csv", "Kp_level,0.2,", "Kp_level,-0.2,"),
            Edit("engineering/parameters.csv", "Ki_level,0.002,", "Ki_level,-0.002,"),
        ),
        ("LIC1", "Kp_level", "Ki_level"),
    ),
    Mistake(
        _SIGNS, "both gains of the feed loop",
        (
            Edit("engineering/parameters.csv", "Kp_flow,10,", "Kp_flow,-10,"),
            Edit("engineering/parameters.csv", "Ki_flow,5,", "Ki_flow,-5,"),
        ),
        ("FIC1", "Kp_flow", "Ki_flow"),
    ),
    Mistake(
        _SIGNS, "a fallback that closes the cooling",
        (
            Edit("engineering/fallbacks.csv", "drain,shutdown,1,XV1.cmd,0,1,", "drain,shutdown,1,XV1.cmd,0,0.01,"),
            Edit("engineering/fallbacks.csv", "drain,shutdown,2,F1.sp,0,0.05,", "drain,shutdown,2,F1.sp,0,0.0005,"),
            Edit("engineering/fallbacks.csv", "drain,shutdown,3,V2.man,1,", "drain,shutdown,3,V2.man,0,"),
        ),
        ("drain",),
    ),
    table(
        _SIGNS, "the direction of a symptom", "symptoms", "S-OUTLET-LOW,F-OUTLET,low,", "S-OUTLET-LOW,F-OUTLET,high,",
        "S-OUTLET-LOW",
    ),
    table(_LIMITS, "a level that no instrument shows", "limits", "L1 <= V_brim,Operating", "L1 <= 20,Operating",
          "LIM-L-HIGH"),
    table(_LIMITS, "a trip limit below the setpoint", "limits", "T1 <= 313,", "T1 <= 309,", "LIM-T-HIGH"),
    table(_LIMITS, "an envelope above the setpoint", "limits", "T1 >= 288,", "T1 >= 311,", "LIM-T-LOW"),
    table(_LIMITS, "a low limit above the setpoint", "limits", "L1 >= 2 or F1 <= 0.0005", "L1 >= 10.2 or F1 <= 0.0005",
          "LIM-L-LOW"),
    table(_LIMITS, "a range below the limit", "signals", "L1,PV,L,-2,14,", "L1,PV,L,-2,10.6,", "LIM-L-HIGH", "L1"),
    table(_GUARDS, "a start-up that never ends", "transitions", "L1 >= 9 and T1 <= 311", "L1 >= 9 and T1 <= 300",
          "t_started"),
    table(
        _GUARDS, "a guard beyond a limit", "transitions",
        "t_compensate,normal,compensated,fault_diagnosed,T1 <= 329",
        "t_compensate,normal,compensated,fault_diagnosed,T1 >= 330", "t_compensate",
    ),
    table(
        _GUARDS, "a state that nothing leads to", "states", "shutdown,Shut-down",
        "standby,Standby,no,no,1,no,,F1.sp <= 0.001,Waits\nshutdown,Shut-down", "standby",
    ),
    table(_GUARDS, "a restart that drains too far", "transitions", "T1 <= 310 and L1 <= 4.5", "T1 <= 310 and L1 <= 1",
          "t_restart"),
    table(
        _GUARDS, "a guard that contradicts itself", "transitions",
        "t_resume,holding,reduced_load,fault_diagnosed,T1 <= 312 and L1 <= 10.8",
        "t_resume,holding,reduced_load,fault_diagnosed,T1 <= 312 and T1 >= 313", "t_resume",
    ),
    table(_PERMISSIVES, "feed only below 5 L", "limits", "F1.sp <= 0.0005 or L1 <= V_brim",
          "F1.sp <= 0.0005 or L1 <= 5", "PRM-FEED"),
    table(
        _PERMISSIVES, "what forbids the fallback's cooling", "limits", "PRM-FEED,",
        "PRM-V2,permissive,no,V2.man <= 0.5,CE-9,Cooling by hand is for small corrections\nPRM-FEED,", "PRM-V2",
    ),
    table(_PERMISSIVES, "cooling that is never so high", "limits", "V2.pos >= 0.02 or", "V2.pos >= 0.8 or", "PRM-COOL"),
    table(
        _PERMISSIVES, "a setpoint that no limit minds", "limits", "PRM-FEED,",
        "PRM-T,permissive,no,T1.sp <= 310.5 or F1.sp <= 0.0005,CE-9,No warmer than by design\nPRM-FEED,", "PRM-T",
    ),
    table(
        _PERMISSIVES, "what forbids the fallback's draining", "limits", "PRM-FEED,",
        "PRM-L,permissive,no,L1.sp >= 6,CE-9,The vessel stays filled\nPRM-FEED,", "PRM-L",
    ),
)  # fmt: skip
