"""Flowsheets for tests: two heated tanks, and what stands in the tables of such a plant."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from homeostat.process.batch import Batch, BatchResult, simulate
from homeostat.process.blocks import Flowsheet, Vessel, heater, linear_valve, pump_flow, valve_flow
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.types import Vec

STATED = {
    "T_feed": 300.0, "sd_T_feed": 0.5, "tau_feed": 30.0, "F_V1": 0.2, "V_start": 20.0, "cp": 4.18, "Kv_12": 0.05,
    "A_B1": 5.0, "F_P1": 0.3, "P_H1": 60.0, "tau_V1": 1.0, "tau_P1": 1.0, "tau_H1": 3.0, "Kp_FIC1": 2.0, "Ki_FIC1": 0.5,
    "Kp_LIC2": 0.1, "Ki_LIC2": 0.001, "Kp_TIC2": 0.1, "Ki_TIC2": 0.001,
}  # fmt: skip
"""Of the two tanks."""
SETPOINTS = {"F1_sp": 0.1, "L2_sp": 20.0, "T2_sp": 330.0}
FAULTS = ("V1_stuck_open", "V1_stuck_closed", "P1_weak", "B1_leak")


def two_tanks() -> Flowsheet:
    """Water through two tanks in series; the second is heated and held at its level."""
    s = Flowsheet()
    feed_temperature = s.disturbance("T_feed", sd="sd_T_feed", tau="tau_feed")
    b1, b2 = Vessel(s, "B1", "L", "V_start"), Vessel(s, "B2", "L", "V_start")
    t1, t2 = b1.heated("T_feed", "cp"), b2.heated("T_feed", "cp")
    feed = linear_valve("F_V1", s.loop("FIC1", measured="F1", drives="V1", acts=-1).opening)
    b1.feed(feed, feed_temperature)
    b2.feed(b1.draw(valve_flow("Kv_12", 1.0, b1.volume / "A_B1")), t1)
    out = b2.draw(pump_flow("F_P1", s.loop("LIC2", measured="L2", drives="P1", acts=1).opening))
    b2.heat(heater("P_H1", s.loop("TIC2", measured="T2", drives="H1", acts=-1).opening))
    for name, of in {"T0": feed_temperature, "L1": b1.volume, "L2": b2.volume, "T1": t1, "T2": t2}.items():
        s.sensor(name, of)
    s.sensor("F1", feed, relative=True)
    s.sensor("F2", out, relative=True)
    for actuator in s.actuators.values():
        s.sensor(f"{actuator.name}_zt", actuator.position)
    s.total("product", "L", out)
    return s


def with_instruments(stated: Mapping[str, float], sheet: Flowsheet, noise: float = 0.01) -> dict[str, float]:
    """``stated`` with what tables state of every instrument: no calibration error, and ``noise``."""
    named = {f"{what}_{name}": value for name in sheet.sensors for what, value in (("bias", 0.0), ("sd", noise))}
    return {**named, **stated}


def composed(sheet: Flowsheet, stated: Mapping[str, float], faults: Collection[str] = ()) -> ComposedModel:
    """The model of ``sheet``."""
    return ComposedModel(sheet, with_instruments(stated, sheet), faults)


def row(model: ComposedModel, stated: Mapping[str, float]) -> Vec:
    """Parameters in the model's order, without calibration errors and with little noise."""
    return np.array([stated.get(n, 0.0 if n.startswith("bias_") else 0.01) for n in model.parameters])


def commanded(model: ComposedModel, **values: float) -> Vec:
    """Inputs in the model's order; those that are not given are on automatic."""
    return np.array([values.get(name, np.nan) for name in model.inputs])


def run(
    model: ComposedModel,
    stated: Mapping[str, float],
    inputs: Vec,
    steps: int,
    faults: Mapping[str, float] | None = None,
    noise: float = 0.0,
) -> tuple[BatchResult, Mapping[str, Vec]]:
    """One member from where the plant starts, faults from the beginning; also state -> its course."""
    severity = np.array([[(faults or {}).get(name, 0.0) for name in model.faults]])
    parameters = row(model, stated)[None]
    batch = Batch(
        state=model.initial_state(parameters[0])[None],
        parameters=parameters,
        severity=severity,
        onset_s=np.zeros_like(severity),
        inputs=np.tile(inputs, (1, steps, 1)),
        input_of=np.zeros(1, dtype=np.int64),
        start_s=0.0,
        steps=steps,
        stride=1,
        record=tuple(range(len(model.states))),
        seeds=np.array([7]),
        process_noise=np.full(1, noise),
        sensor_noise=np.full(1, noise),
    )
    with np.errstate(over="ignore"):  # plain Python says that the noise counts modulo 2^64
        result = simulate(model.kernel, batch)
    return result, {name: result.record[0, :, i] for i, name in enumerate(model.states)}
