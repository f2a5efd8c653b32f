"""The batch engine: many members of one process, simulated at one-second steps in one call."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from homeostat.process.types import Cube, Indices, Row, Table


class ProcessError(ArithmeticError):
    """The simulation left the physical world; the message names the member, the time and the value."""


class Kernel(Protocol):
    """Compiled code that advances members ``first`` to ``last`` - 1 in place.

    It writes every ``stride``-th state, restricted to ``picks``, into ``out``, and the time [s] of the first
    non-physical state into ``broken_at`` (NaN where all is well).
    """

    def __call__(
        self, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
        steps: int, stride: int, seeds: Indices, process: Row, sensor: Row, picks: Indices, out: Cube, broken_at: Row,
    ) -> None: ...  # fmt: skip


@dataclass(frozen=True, slots=True)
class Batch:
    """What to simulate: M members with their states, parameters, faults, inputs and noise."""

    state: Table
    """Initial states, shape (M, states)."""
    parameters: Table
    """Physical parameters, shape (M, parameters)."""
    severity: Table
    """Fault severities in each fault's unit, 0 where absent, shape (M, faults)."""
    onset_s: Table
    """Process time [s] from which each fault acts, shape (M, faults)."""
    inputs: Cube
    """K input schedules, one row per second, shape (K, >= steps, inputs)."""
    input_of: Indices
    """Which schedule each member follows, shape (M,)."""
    start_s: float
    """Process time of the initial states [s]."""
    steps: int
    """Seconds to simulate."""
    stride: int
    """Every how many seconds the state is recorded."""
    record: tuple[int, ...]
    """Columns of the state that are recorded."""
    seeds: Indices
    """Noise seed of each member, shape (M,)."""
    process_noise: Row
    """Scale of the process disturbances of each member, 0 for none, shape (M,)."""
    sensor_noise: Row
    """Scale of the sensor noise of each member, 0 for none, shape (M,)."""


@dataclass(frozen=True, slots=True)
class BatchResult:
    """What came of it."""

    record: Cube
    """Recorded columns, shape (M, steps // stride, columns); the first row is at start_s + stride."""
    state: Table
    """Final states, shape (M, states)."""


def simulate(kernel: Kernel, batch: Batch, describe: Callable[[int], str] = "state {}".format) -> BatchResult:
    """Advance every member of ``batch``; work is shared among the cores, results do not depend on how.

    Raises:
        ProcessError: an input is not finite, or a member leaves the physical world (NaN, negative volume).
    """
    _check(batch, describe)
    members = batch.state.shape[0]
    state = np.ascontiguousarray(batch.state, dtype=np.float64).copy()
    out = np.empty((members, batch.steps // batch.stride, len(batch.record)))
    broken = np.full(members, np.nan)
    picks = np.array(batch.record, dtype=np.int64)

    def run(first: int, last: int) -> None:
        kernel(
            first, last, state, batch.parameters, batch.severity, batch.onset_s, batch.inputs, batch.input_of,
            float(batch.start_s), batch.steps, batch.stride, batch.seeds, batch.process_noise, batch.sensor_noise,
            picks, out, broken,
        )  # fmt: skip

    workers = min(os.cpu_count() or 1, 16)
    if members * batch.steps < 20_000 or workers == 1 or members == 1:
        run(0, members)
    else:
        edges = np.linspace(0, members, 4 * workers + 1).astype(int)
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(run, edges[:-1], edges[1:]))
    if not np.all(np.isnan(broken)):
        member = int(np.flatnonzero(~np.isnan(broken))[0])
        bad = ", ".join(f"{describe(int(c))} = {state[member, c]:.6g}" for c in batch.record[:3])
        raise ProcessError(
            f"member {member} left the physical world at t = {broken[member]:.0f} s (volume < 0 or not finite): {bad}"
        )
    return BatchResult(record=out, state=state)


def _check(batch: Batch, describe: Callable[[int], str]) -> None:
    """Refuse what is not finite before it can spread."""
    if batch.steps < 1 or batch.stride < 1:
        raise ProcessError(f"steps {batch.steps} and stride {batch.stride} must be >= 1")
    if batch.inputs.shape[1] < batch.steps:
        raise ProcessError(f"input schedule covers {batch.inputs.shape[1]} s, {batch.steps} s are asked for")
    for name, table in (("state", batch.state), ("parameter", batch.parameters), ("severity", batch.severity)):
        good = np.isfinite(table)
        if not good.all():
            member, column = (int(i) for i in np.argwhere(~good)[0])
            label = describe(column) if name == "state" else f"{name} {column}"
            raise ProcessError(
                f"member {member}: {label} is {table[member, column]!r} at t = {batch.start_s:.0f} s; must be finite"
            )
