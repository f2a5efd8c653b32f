"""The reactor put together from blocks beside its hand-written kernel: ``python -m benchmarks.plants.kernels``.

Both have the same balances, loops, instruments, noise and faults of actuators. The hand-written one has phases of
start-up and shut-down as well, and each has its own order of a second, so that courses are alike and not equal.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

import numpy as np

from homeostat.plants.plant import load_plant
from homeostat.process.batch import Batch, simulate, use_threads
from homeostat.process.blocks import (
    Flowsheet,
    Vessel,
    arrhenius,
    exchanged,
    limited,
    linear_valve,
    overflow,
    pump_flow,
)
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec

MEMBERS, SECONDS, ROUNDS = 200, 1500, 7
FAULTS = ("V1_stuck_open", "P1_weak", "V2_stuck_closed", "V2_stuck_open", "R1_leak")
START_L = 10.0


def reactor() -> Flowsheet:
    """The reactor of `homeostat.plants.cstr.kernel`, of its tables' parameters."""
    s = Flowsheet()
    warm, cold = s.disturbance("T_feed", sd="sd_T_feed", tau="tau_feed"), s.disturbance("T_coolant")
    a = s.disturbance("CA_feed", sd="sd_CA_feed", tau="tau_feed")
    d = s.disturbance("CD_feed", sd="sd_CD_feed", tau="tau_feed")
    s.sensor("T2", warm)
    s.sensor("T3", cold)
    r = Vessel(s, "R1", "L", START_L)
    t = r.heated(310.0, "cp")
    species = {name: r.holds(name, "mol/L") for name in ("A", "B", "C", "D")}
    s.sensor("L1", r.volume)
    speed = s.controller("level", "L1", acts=1)
    feed = linear_valve("Cv_V1", s.loop("flow", measured="F1", drives="V1", acts=-1).opening)
    wild = s.sensor("F1", feed, relative=True) / "feedforward_P1"
    pump = s.actuator("P1", limited(speed.output + limited(wild, 0.0, 1.0), 0.0, 1.0))
    out = r.draw(pump_flow("K_P1", pump.opening))
    valve = s.loop("temperature", measured="T1", drives="V2", acts=1)
    r.draw(overflow(r.volume, "V_brim", "k_brim"))
    r.feed(feed, warm, A=a, D=d)
    r.react(arrhenius("k0_AD", "E_AD", t) * species["A"] * species["D"], "dH_AD", A=-1, D=-1, B=1)
    r.react(arrhenius("k0_A", "E_A", t) * species["A"], "dH_A", A=-1, C=1)
    r.heat(-1.0 * exchanged("UA", t, cold) * valve.opening)
    r.heat(-1.0 * exchanged("UA_ambient", t, "T_ambient"))
    s.sensor("T1", t)
    s.sensor("F2", out, relative=True)
    s.sensor("F3", linear_valve("F3_max", valve.opening), relative=True)
    for each in s.actuators.values():
        s.sensor(f"{each.name}_zt", each.position)
    s.total("product", "L", out)
    return s


def composed() -> ComposedModel:
    """Its model, with the parameters of the tables."""
    stated = {p.symbol: p.value for p in load_plant("cstr").description.parameters}
    return ComposedModel(reactor(), {**stated, **_gains(stated)}, FAULTS)


def _gains(stated: dict[str, float]) -> dict[str, float]:
    """What a flowsheet calls otherwise: instruments' errors, and the gains that are called alike."""
    named = {"F1": "rel_F1", "F2": "rel_F2", "F3": "rel_F3", "V1_zt": "sd_ZT", "P1_zt": "sd_ZT", "V2_zt": "sd_ZT"}
    noise = {f"sd_{name}": stated[of] for name, of in named.items()}
    return noise | {f"bias_{name}": 0.0 for name in named}


def batch(model: ProcessModel, parameters: Vec, inputs: dict[str, float]) -> Batch:
    """Members with noise and no fault, from the model's start."""
    state = np.tile(model.initial_state(parameters), (MEMBERS, 1))
    if "V" in model.states:
        state[:, [model.states.index(n) for n in ("V", "T", "L1", "T1")]] = START_L, 310.0, START_L, 310.0
    row = np.array([inputs.get(name, np.nan) for name in model.inputs])
    none = np.zeros((MEMBERS, len(model.faults)))
    return Batch(
        state=state, parameters=np.tile(parameters, (MEMBERS, 1)), severity=none, onset_s=np.full_like(none, np.inf),
        inputs=np.tile(row, (1, SECONDS, 1)), input_of=np.zeros(MEMBERS, dtype=np.int64), start_s=0.0, steps=SECONDS,
        stride=SECONDS, record=(0,), seeds=np.arange(MEMBERS), process_noise=np.ones(MEMBERS),
        sensor_noise=np.ones(MEMBERS),
    )  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """What the two kernels took."""

    hand_written_s: float
    """Median of the hand-written kernel [s]."""
    from_blocks_s: float
    """Median of the other one [s]."""

    @property
    def ratio(self) -> float:
        """From blocks to hand-written [1]."""
        return self.from_blocks_s / self.hand_written_s


def compared() -> Compared:
    """Let both take turns on one thread: ``MEMBERS`` over ``SECONDS``."""
    use_threads(1)
    plant, put_together = load_plant("cstr"), composed()
    stated = {p.symbol: p.value for p in plant.description.parameters}
    stated |= _gains(stated)
    inputs = {"T1_sp": 310.0, "L1_sp": 10.0, "F1_sp": 1.0 / 30.0, "XV1_cmd": 1.0}
    models: tuple[ProcessModel, ...] = (plant.model, put_together)
    batches = [batch(m, np.array([stated[n] for n in m.parameters]), inputs) for m in models]
    took: list[list[float]] = [[], []]
    for turn in range(ROUNDS + 1):
        for model, given, times in zip(models, batches, took, strict=True):
            begun = time.perf_counter()
            simulate(model.kernel, given)
            if turn:  # the first one may compile
                times.append(time.perf_counter() - begun)
    return Compared(*map(statistics.median, took))


if __name__ == "__main__":
    print(compared())
