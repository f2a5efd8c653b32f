"""Mistakes beside the sixty, two or three of each class: listed before the check was asked about them."""

from __future__ import annotations

from benchmarks.plants.mistake import Mistake, acting, code, table
from benchmarks.plants.site import Edit

_NAMES, _UNITS, _SIGNS = "misspelt names", "wrong units", "wrong signs"
_LIMITS, _GUARDS, _PERMISSIVES = "limits", "guards and states", "permissives"
_MODEL, _BALANCES, _CONTROL = "readings, truth and estimate", "balances and the physical world", "control"
_FAULTS, _FALLBACKS, _NUMBERS = "faults", "fallbacks", "noise, quality and times"


def _parameters(kind: str, name: str, points: tuple[str, ...], *changes: tuple[str, str]) -> Mistake:
    edits = tuple(Edit("engineering/parameters.csv", old, new) for old, new in changes)
    return Mistake(kind, name, edits, points)


FURTHER: tuple[Mistake, ...] = (
    table(_NAMES, "a symptom of a fault", "symptom_faults", "S-V1-OFF,inlet", "S-V1-OF,inlet", "S-V1-OF"),
    table(_NAMES, "a tag in a limit", "limits", "T1 >= 288,", "TT1 >= 288,", "LIM-T-LOW"),
    table(_UNITS, "a heat transfer in kW/K", "parameters", "UA,500,W/K", "UA,0.5,W/K", "UA",
          "TIC1", "T1", "t_started"),
    table(_UNITS, "the time of start-up in minutes", "states", "0,yes,730,", "0,yes,12.2,", "starting"),
    table(_UNITS, "a brim in cubic metres", "parameters", "V_brim,11,", "V_brim,0.011,", "V_brim", "LIM-L-HIGH"),
    _parameters(_SIGNS, "both gains of the temperature loop", ("TIC1", "Kp_temperature"),
                ("Kp_temperature,0.002,", "Kp_temperature,-0.002,"),
                ("Ki_temperature,0.0002,", "Ki_temperature,-0.0002,")),
    table(_SIGNS, "a symptom of what is too hot", "symptoms", "S-HOT,F-TEMPERATURE,high,", "S-HOT,F-TEMPERATURE,low,",
          "S-HOT"),
    Mistake(_LIMITS, "a limit that no fallback serves", (
        Edit("engineering/fallback_limits.csv", "drain,LIM-L-HIGH,120,0,Without feed the level came back within 38 s "
          "with the outlet half blocked\n", ""),
        Edit("engineering/fallback_limits.csv", "isolate,LIM-L-HIGH,120,0,Without feed the level came back within 62 s "
          "with the outlet half blocked\n", ""),
    ), ("LIM-L-HIGH",)),
    table(_LIMITS, "a limit that nothing can keep", "limits", "T1 >= 288,", "T1 >= 288 and T1 <= 280,", "LIM-T-LOW"),
    table(_GUARDS, "a state that there is not", "transitions", "t_hold,normal,holding,", "t_hold,normal,holdng,",
          "t_hold", "holdng"),
    table(_GUARDS, "a state that its own setpoints never settle", "states",
          "holding,Holding,no,yes,3,no,,F1.sp <= 0.001", "holding,Holding,no,yes,3,no,,F1.sp >= 0.02", "holding"),
    table(_PERMISSIVES, "a valve that is never so open", "limits", "XV1.cmd >= 0.5 or", "XV1.cmd >= 1.5 or",
          "PRM-XV1"),
    table(_PERMISSIVES, "cooling the wrong way round", "limits", "V2.pos >= 0.02 or", "V2.pos <= 0.02 or", "PRM-COOL"),
    code(_MODEL, "an estimate that fails", """
    def estimate(self, readings):
        raise KeyError("T9")
""", "T9"),
    code(_MODEL, "a truth in degrees Celsius", """
    def truth(self, record, inputs):
        found = super().truth(record, inputs)
        return {**found, "T1": found["T1"] - 273.15}
""", "T1", "truth"),
    code(_MODEL, "two readings that were swapped", """
    def readings(self, state, inputs):
        found = super().readings(state, inputs)
        return {**found, "F1": found["F3"], "F3": found["F1"]}
""", "F1", "F3"),
    acting(_BALANCES, "liquid from nowhere", "    x[S.V] += 0.002", "F-MASS"),
    table(_BALANCES, "a heat balance that forgets the feed", "features", "cp / 1000 * F1 * T2 - cp / 1000 * F2 * T1",
          "0 - cp / 1000 * F2 * T1", "F-HEAT"),
    table(_CONTROL, "a temperature loop without reset", "parameters", "Ki_temperature,0.0002,", "Ki_temperature,0,",
          "TIC1", "Ki_temperature"),
    table(_CONTROL, "a pump that is too small", "parameters", "K_P1,0.08,", "K_P1,0.03,", "LIC1",
          "K_P1", "LIM-L-HIGH"),
    table(_CONTROL, "a jacket that is too small", "parameters", "UA,500,", "UA,150,", "TIC1", "t_started"),
    _parameters(_CONTROL, "gains a hundred times too small", ("TIC1", "Kp_temperature"),
                ("Kp_temperature,0.002,", "Kp_temperature,0.00002,"),
                ("Ki_temperature,0.0002,", "Ki_temperature,0.000002,")),
    table(_FAULTS, "a typical size that is outside its range", "faults", "J1,1,0.7,0.05,0.95,", "J1,1,0.7,0.8,0.95,",
          "fouling"),
    table(_FAULTS, "a fault of nothing that there is", "faults", "leak,Leak of the vessel,R1,",
          "leak,Leak of the vessel,R2,", "leak", "R2"),
    table(_FALLBACKS, "a setpoint beyond what the state admits", "fallbacks", "L1.sp,2.5,,no", "L1.sp,10.4,,no",
          "drain"),
    table(_FALLBACKS, "a command of what is only read", "fallbacks", "V2.man,1,0.5,yes,Cooling full",
          "V2.pos,1,0.5,yes,Cooling full", "drain", "V2.pos"),
    table(_NUMBERS, "a noise of a twin that is much too small", "case.toml", "T1 = [0.5, 0.1]", "T1 = [0.005, 0.0]",
          "T1"),
    table(_NUMBERS, "a time to settle that never ends", "case.toml", "adapt_s = 3600",
          "adapt_s = 3600\nsettle_s = 5000.0", "settle_s"),
    table(_NUMBERS, "one number where two are needed", "case.toml", "T1 = [0.5, 0.1]", "T1 = 0.5", "errors, T1"),
)  # fmt: skip
