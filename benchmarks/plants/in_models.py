"""Mistakes in model, control, faults, fallbacks and numbers, which a simulation shows: classes 7 to 12."""

from __future__ import annotations

from benchmarks.plants.mistake import Mistake, acting, code, table
from benchmarks.plants.site import Edit

_MODEL, _BALANCES, _CONTROL = "readings, truth and estimate", "balances and the physical world", "control"
_FAULTS, _FALLBACKS, _NUMBERS = "faults", "fallbacks", "noise, quality and times"

IN_MODELS: tuple[Mistake, ...] = (
    code(_MODEL, "no reading of a tag", """
    def readings(self, state, inputs):
        return {name: value for name, value in super().readings(state, inputs).items() if name != "T2"}
""", "T2"),
    code(_MODEL, "no truth of a tag", """
    def truth(self, record, inputs):
        return {name: value for name, value in super().truth(record, inputs).items() if name != "L1"}
""", "L1"),
    code(_MODEL, "an estimate that forgets the level", """
    def estimate(self, readings):
        x = super().estimate(readings)
        x[S.V] = 0.0
        return x
""", "estimate"),
    code(_MODEL, "an estimate of another shape", """
    def estimate(self, readings):
        return super().estimate(readings)[:-1]
""", "estimate"),
    code(_MODEL, "a reading that is no number", """
    def readings(self, state, inputs):
        return {**super().readings(state, inputs), "F3": math.nan}
""", "F3"),
    acting(_BALANCES, "liquid that disappears", "    x[S.V] = max(x[S.V] - 0.002, 0.0)", "F-MASS"),
    acting(_BALANCES, "heat that disappears", "    x[S.T] -= 0.02", "F-HEAT"),
    acting(_BALANCES, "a temperature that is no number", "    if t >= 3000.0:\n        x[S.T] = math.nan",
           "3000", "3001"),
    acting(_BALANCES, "equations that never end", "    while t >= 700.0:\n        pass", "process.py"),
    table(_BALANCES, "a balance with the wrong flow", "features", "F-MASS,L1,F1 - F2,", "F-MASS,L1,F1 - F3,",
          "F-MASS"),
    code(_CONTROL, "controllers that forget", """
    def resume(self, states, readings, parameters):
        pass
""", "resume"),
    code(_CONTROL, "one controller that forgets", """
    def resume(self, states, readings, parameters):
        super().resume(states, readings, parameters)
        states[:, S.temperature_integral] = 0.0
""", "resume"),
    table(_CONTROL, "a temperature loop that swings", "parameters", "Ki_temperature,0.0002,", "Ki_temperature,0.02,",
          "TIC1", "Ki_temperature"),
    table(_CONTROL, "a level loop that swings", "parameters", "Ki_level,0.002,", "Ki_level,2,", "LIC1", "Ki_level"),
    table(_CONTROL, "a feed loop that swings", "parameters", "Kp_flow,10,", "Kp_flow,100,", "FIC1", "Kp_flow"),
    table(_FAULTS, "a fault that is too small to be seen", "faults", "pump_degrade,Degraded product pump,P1,1,0.5,0.05",
          "pump_degrade,Degraded product pump,P1,1,0.01,0.01", "pump_degrade"),
    Mistake(_FAULTS, "a fault that other symptoms show", (
        Edit("engineering/symptom_faults.csv", "S-HEAT-HIGH,temp_bias\n", ""),
        Edit("engineering/symptom_faults.csv", "S-COOLING-HIGH,temp_bias\n", ""),
        Edit("engineering/symptom_faults.csv", "S-HOT,temp_bias\n", "S-COLD,temp_bias\n"),
    ), ("temp_bias",)),
    code(_FAULTS, "a fault that does nothing", """
    kernel = staticmethod(lambda first, last, x, p, sev, *rest: CstrModel.kernel(
        first, last, x, p, np.ascontiguousarray(np.where(np.arange(len(F)) == F.leak, 0.0, sev)), *rest))
""", "leak"),
    Mistake(_FAULTS, "two faults alike, of which one forbids the answer to the other", (
        Edit("engineering/faults.csv", "outlet_block,Blocked outlet,P1,1,0.9,0.05,1,0.1,,",
             "outlet_block,Blocked outlet,P1,1,0.5,0.05,1,0.1,P1,"),
        Edit("engineering/state_requirements.csv", "compensated,V2,", "compensated,P1,It must pump\ncompensated,V2,"),
        Edit("engineering/state_requirements.csv", "reduced_load,V1,", "reduced_load,P1,Must pump\nreduced_load,V1,"),
    ), ("outlet_block", "pump_degrade")),
    Mistake(_FAULTS, "an event that nobody sends", (
        Edit("engineering/transitions.csv", "t_compensate,normal,compensated,fault_diagnosed",
             "t_compensate,normal,compensated,fault_diagnosd"),
        Edit("engineering/transitions.csv", "t_reduce,normal,reduced_load,fault_diagnosed",
             "t_reduce,normal,reduced_load,fault_diagnosd"),
        Edit("engineering/transitions.csv", "t_hold,normal,holding,fault_diagnosed",
             "t_hold,normal,holding,fault_diagnosd"),
    ), ("t_compensate", "t_reduce", "t_hold", "normal")),
    Mistake(_FALLBACKS, "a fallback that is too slow", (
        Edit("engineering/fallbacks.csv", "drain,shutdown,1,XV1.cmd,0,1,", "drain,shutdown,1,XV1.cmd,0,0.001,"),
        Edit("engineering/fallbacks.csv", "drain,shutdown,2,F1.sp,0,0.05,", "drain,shutdown,2,F1.sp,0,0.00005,"),
        Edit("engineering/fallbacks.csv", "drain,shutdown,3,V2.man,1,0.5,", "drain,shutdown,3,V2.man,1,0.001,"),
    ), ("drain",)),
    Mistake(_FALLBACKS, "a fallback that leaves the feed on", (
        Edit("engineering/fallbacks.csv", "drain,shutdown,1,XV1.cmd,0,1,yes,Isolate the feed\n", ""),
        Edit("engineering/fallbacks.csv", "drain,shutdown,2,F1.sp,0,0.05,yes,Feed setpoint to zero\n", ""),
    ), ("drain",)),
    table(_FALLBACKS, "a time that no fallback keeps", "fallback_limits", "drain,LIM-L-HIGH,120,",
          "drain,LIM-L-HIGH,3,", "drain"),
    table(_FALLBACKS, "a safe state that is never reached", "states",
          "shutdown,Shut-down,no,no,5,no,,F1.sp <= 0.001", "shutdown,Shut-down,no,no,5,no,,L1 <= 1", "shutdown"),
    table(_FALLBACKS, "a fallback after which nobody can start again", "fallbacks", "L1.sp,2.5,,no,Drain to the heel",
          "L1.sp,10,,no,Drain to the heel", "t_restart"),
    table(_NUMBERS, "a flow at rest that is called frozen", "quality", "F1,,5,,,,5,", "F1,,5,0.0007,10,,5,", "F1"),
    table(_NUMBERS, "a noise that the instrument does not have", "quality", "T1,,5,0.5,10,1,5,", "T1,,5,0.005,10,1,5,",
          "T1"),
    table(_NUMBERS, "a valve that may not move", "quality", "V1.pos,,5,0.002,10,,5,", "V1.pos,,5,0.002,10,0.001,5,",
          "V1.pos"),
    table(_NUMBERS, "a rollout that ends too early", "case.toml", "horizon_s = 900", "horizon_s = 60", "horizon_s",
          "ACC-T-HIGH", "ACC-L-HIGH"),
    table(_NUMBERS, "a symptom of a healthy plant", "symptoms", "S-HOT,F-TEMPERATURE,high,7,1.2,5,",
          "S-HOT,F-TEMPERATURE,high,0.5,0.05,1,", "S-HOT"),
)  # fmt: skip
