"""The reactor with the numbers of its engineering tables, ready to be simulated in tests and benchmarks."""

from __future__ import annotations

import csv
import functools
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.plant import load_plant
from homeostat.process.batch import Batch, simulate
from homeostat.process.types import Cube, Table, Vec
from tests.knowledge.whole import whole

MODEL = load_plant("cstr", learned=False).model


def _columns(names: tuple[str, ...]) -> Any:
    """Where each of ``names`` stands."""
    return namedtuple("Columns", names)(*range(len(names)))  # type: ignore[misc]


S, P, U, F = map(_columns, (MODEL.states, MODEL.parameters, MODEL.inputs, MODEL.faults))
"""Columns of states, parameters, inputs and faults by their names."""
TABLES = whole("cstr") / "engineering"
FAULTS = MODEL.faults
PUBLISHED_NAMES = {f"{name}_pos": f"{name}_position" for name in ("V1", "P1", "V2", "XV1")}
"""What the references call a column -> its name."""
PUBLISHED = {"published_balance": 1.0, "trim_low": 0.0, "t_shutdown": 7000.0, "tau_feed": 0.0, "sd_L1": 0.0}
"""Parameters under which the reactor is the published one."""
ALL = tuple(range(len(S)))


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
VARIABLES = {r["tag"]: r["variable"] for r in rows("signals")}


@functools.cache
def plant() -> PlantDescription:
    """The reactor as its graph describes it."""
    return load_plant("cstr", learned=False).description


def parameters(**changes: float) -> Vec:
    """Nominal parameters but for ``changes``, shape (parameters,)."""
    values = NOMINAL | changes
    return np.array([values.pop(name) for name in MODEL.parameters])


def inputs(**changes: float) -> Vec:
    """Design setpoints with all loops on automatic, but for ``changes``, shape (inputs,)."""
    row = np.full(len(MODEL.inputs), np.nan)
    row[[U.T1_sp, U.L1_sp, U.F1_sp, U.XV1_cmd]] = 310.0, 10.0, 2.0 / 60.0, 1.0
    for name, value in changes.items():
        row[MODEL.inputs.index(name)] = value
    return row


@dataclass(frozen=True, slots=True)
class Run:
    """A simulation with every state recorded."""

    record: Cube
    """States, shape (members, times, states)."""
    state: Table
    """Final states, shape (members, states)."""

    def of(self, name: str, member: int = 0) -> Vec:
        """One state of one member over time, shape (times,)."""
        return self.record[member, :, MODEL.states.index(PUBLISHED_NAMES.get(name, name))]


def batch(
    steps: int,
    *,
    members: int = 1,
    stride: int = 1,
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
        parameters=np.array(np.broadcast_to(p, (members, len(MODEL.parameters))), order="C"),
        severity=severity, onset_s=onset,
        inputs=np.array(np.broadcast_to(u, (steps, len(U))), order="C")[None],
        input_of=np.zeros(members, dtype=np.int64),
        start_s=start_s, steps=steps, stride=stride, record=ALL,
        seeds=np.arange(members, dtype=np.int64) + first_seed,
        process_noise=np.full(members, process), sensor_noise=np.full(members, sensor),
    )  # fmt: skip


def run(what: Batch) -> Run:
    """Simulate with every state recorded."""
    result = simulate(MODEL.kernel, what, lambda i: MODEL.states[i])
    return Run(result.record, result.state)
