"""The Mixing Module with the numbers of its engineering tables, ready to be simulated in tests."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.plants.mixing_module.hydraulics import ROOM, solve
from homeostat.plants.mixing_module.layout import FaultSlot, P, S, StateSlot
from homeostat.plants.mixing_module.process import MixingModel
from homeostat.process.batch import Batch, simulate
from homeostat.process.compiled import machine_code
from homeostat.process.types import Cube, Table, Vec
from tests.knowledge.whole import whole

MODEL = MixingModel()
TABLES = whole("mixing_module") / "engineering"
FAULTS = FaultSlot._fields
ALL = tuple(range(len(S)))
CLOSED = 1e-6
"""Opening that a closed valve has in the flow laws."""
TIGHT = 1e18
"""Resistance of a leak that is not there [m/(L/s)^2]."""


def rows(table: str) -> list[dict[str, str]]:
    """Rows of one engineering table."""
    with (TABLES / f"{table}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _tables() -> dict[str, float]:
    values = {r["symbol"]: float(r["value"]) for r in rows("parameters")}
    for r in rows("sensors"):
        values[r["parameter_bias"]] = 0.0
        values[r["parameter_noise"]] = float(r["noise_sd"])
    return values


NOMINAL = _tables()
SEVERITY = {r["id"]: float(r["nominal"]) for r in rows("faults")}
RANGE = {r["id"]: (float(r["low"]), float(r["high"])) for r in rows("faults")}


def parameters(**changes: float) -> Vec:
    """Nominal parameters but for ``changes``, shape (parameters,)."""
    values = NOMINAL | changes
    return np.array([values.pop(name) for name in MODEL.parameters])


def inputs(**changes: float) -> Vec:
    """Everything closed and still but for ``changes`` (``VO1=1.0``), shape (inputs,)."""
    row = np.zeros(len(MODEL.inputs))
    for name, value in changes.items():
        row[MODEL.inputs.index(f"cmd_{name}")] = value
    return row


def timed(steps: int, *changes: tuple[int, dict[str, float]]) -> Table:
    """One row per second; from each time on [s] what ``inputs`` makes of its names, shape (steps, inputs)."""
    u = np.tile(inputs(), (steps, 1))
    for since, names in changes:
        u[since:] = inputs(**names)
    return u


def start(p: Vec | None = None, n: tuple[float, float] = (0.0, 0.0), **levels: float) -> Vec:
    """The initial state but for ``levels`` (``B201=0.1`` [m]), open valves (``VO1=1.0``), and pump speeds ``n``."""
    p = parameters() if p is None else p
    x = MODEL.initial_state(p)
    for name, value in levels.items():
        if name.startswith("B20"):
            x[S.V1 + int(name[3]) - 1] = value * p[P.area]
            x[S.L1 + int(name[3]) - 1] = value
        else:
            x[StateSlot._fields.index(f"{name}_pos")] = value
    x[S.N1], x[S.N2] = n
    return x


@dataclass(frozen=True, slots=True)
class Run:
    """A simulation with every state recorded."""

    record: Cube
    """States, shape (members, times, states)."""
    state: Table
    """Final states, shape (members, states)."""

    def of(self, name: str, member: int = 0) -> Vec:
        """One state of one member over time, shape (times,); row k is at k + 1 s."""
        return self.record[member, :, StateSlot._fields.index(name)]


def batch(
    steps: int,
    *,
    members: int = 1,
    p: Vec | Table | None = None,
    faults: Mapping[str, tuple[float, float]] | None = None,
    u: Vec | Table | None = None,
    x: Vec | Table | None = None,
    start_s: float = 0.0,
    process: float = 0.0,
    sensor: float = 0.0,
    first_seed: int = 1,
) -> Batch:
    """Members that share ``p``, ``faults`` (name -> severity, onset), ``u`` (one row, or one per second) and ``x``."""
    p = parameters() if p is None else p
    x = MODEL.initial_state(np.atleast_2d(p)[0]) if x is None else x
    u = inputs() if u is None else u
    severity, onset = np.zeros((members, len(FAULTS))), np.full((members, len(FAULTS)), np.inf)
    for name, (size, onset_s) in (faults or {}).items():
        severity[:, FAULTS.index(name)], onset[:, FAULTS.index(name)] = size, onset_s
    return Batch(
        state=np.array(np.broadcast_to(x, (members, len(S))), order="C"),
        parameters=np.array(np.broadcast_to(p, (members, len(P))), order="C"),
        severity=severity, onset_s=onset,
        inputs=np.array(np.broadcast_to(u, (steps, len(MODEL.inputs))), order="C")[None],
        input_of=np.zeros(members, dtype=np.int64),
        start_s=start_s, steps=steps, stride=1, record=ALL,
        seeds=np.arange(members, dtype=np.int64) + first_seed,
        process_noise=np.full(members, process), sensor_noise=np.full(members, sensor),
    )  # fmt: skip


def run(what: Batch) -> Run:
    """Simulate with every state recorded."""
    result = simulate(MODEL.kernel, what, lambda i: MODEL.states[i])
    return Run(result.record, result.state)


@dataclass(frozen=True, slots=True)
class Network:
    """The pipes at one moment, solved."""

    flows: Vec
    """Tank outlets (3), P101, main pipe, bypass, into B204, leaks at M and D [L/s]."""
    heads: tuple[float, float, float]
    """S, M, D [m]."""
    left: float
    """How much the flows still changed [L/s]."""


def network(
    p: Vec,
    levels: tuple[float, float, float, float],
    *,
    outlets: tuple[float, float, float] = (CLOSED, CLOSED, CLOSED),
    into_B204: float = 1.0,
    n: tuple[float, float] = (0.0, 0.0),
    leak_main: float = TIGHT,
    leak_common: float = TIGHT,
    main: float | None = None,
    guess: float = 0.05,
) -> Network:
    """Flows for openings ``outlets`` and ``into_B204``, speeds ``n`` (P102's with its size) and leaks' resistances."""
    x = start(p, B201=levels[0], B202=levels[1], B203=levels[2], B204=levels[3])
    wide = [max(o, CLOSED) ** -2 for o in (*outlets, into_B204)]
    line = np.array([
        *(p[P.k_tank] * w for w in wide[:3]), p[P.k_main] if main is None else main, p[P.k_transfer] * wide[3],
        leak_main, leak_common, *n,
    ])  # fmt: skip
    flows = np.full(9, float(guess))
    left = machine_code(solve)(x, p, line, flows, np.zeros(ROOM))
    return Network(flows, (float(x[S.head_suction]), float(x[S.head_main]), float(x[S.head_discharge])), left)
