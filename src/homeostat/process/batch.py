"""The batch engine: many members of one process, simulated tick by tick in one call."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from homeostat.domain.plant.timing import TICK_S
from homeostat.process.moves import Moves
from homeostat.process.types import Cube, Indices, Table, Vec

MOST_THREADS = 16
"""Most threads that one call uses."""
PER_MEMBER = (
    "state",
    "parameters",
    "severity",
    "onset_s",
    "input_of",
    "seeds",
    "process_noise",
    "sensor_noise",
    "begin",
)
"""Fields of a batch that have one row for each member."""
_CORES = os.cpu_count()
_threads = 0


def use_threads(number: int) -> None:
    """Let every later call in this process use ``number`` threads; 0 for as many as there are cores.

    Processes that work side by side use one each; their linear algebra, which is not the engine's, takes
    OPENBLAS_NUM_THREADS=1 from the environment for that.
    """
    global _threads
    if number < 0:
        raise ValueError(f"{number} threads: must be >= 0")
    _threads = number


class ProcessError(ArithmeticError):
    """The simulation left the physical world; the message names the member, the time and the value."""


class Kernel(Protocol):
    """Compiled code that advances members ``first`` to ``last`` - 1 in place.

    States are those ``begin`` ticks after ``t0`` and are brought to tick ``steps``. It writes every ``stride``-th
    state, restricted to ``picks``, into ``out``, and the time [s] of the first non-physical state into ``broken_at``
    (NaN where all is well). ``moves`` are carried out between two ticks, and written as time goes.
    """

    def __call__(
        self, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
        begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
        broken_at: Vec, moves: Moves | None = None,
    ) -> None:  # fmt: skip
        """Advance the members; ValueError where an array does not have the columns of the process."""
        ...


@runtime_checkable
class TimedKernel(Protocol):
    """A kernel that says by how much it goes on with each row of inputs."""

    @property
    def tick_s(self) -> float:
        """Process time of one tick [s]."""
        ...


def tick_of(kernel: Kernel) -> float:
    """Process time of one tick of ``kernel`` [s]; one that does not say it goes on by a second."""
    return kernel.tick_s if isinstance(kernel, TimedKernel) else TICK_S


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
    """K input schedules, one row per tick, shape (K, >= steps, inputs)."""
    input_of: Indices
    """Which schedule each member follows, shape (M,)."""
    start_s: float
    """Process time of the initial states [s]."""
    steps: int
    """Ticks to simulate."""
    stride: int
    """Every how many ticks the state is recorded."""
    record: tuple[int, ...]
    """Columns of the state that are recorded."""
    seeds: Indices
    """Noise seed of each member, shape (M,)."""
    process_noise: Vec
    """Scale of the process disturbances of each member, 0 for none, shape (M,)."""
    sensor_noise: Vec
    """Scale of the sensor noise of each member, 0 for none, shape (M,)."""
    begin: Indices | None = None
    """Ticks after start_s at which each member has its initial state, shape (M,); None for 0."""
    moves: Moves | None = None
    """What happens to the members beside their equations; None for nothing."""

    def members(self, rows: Indices) -> Batch:
        """The batch of these members alone."""
        given = {name: v[rows] for name in PER_MEMBER if (v := getattr(self, name)) is not None}
        return replace(self, moves=None if self.moves is None else self.moves.members(rows), **given)


@dataclass(frozen=True, slots=True)
class BatchResult:
    """What came of it."""

    record: Cube
    """Recorded columns, shape (M, steps // stride, columns); the first row is ``stride`` ticks after the start.

    Rows before a member's beginning mean nothing."""
    state: Table
    """Final states, shape (M, states)."""


def simulate(
    kernel: Kernel, batch: Batch, describe: Callable[[int], str] = "state {}".format, refuse: bool = True
) -> BatchResult:
    """Advance every member of ``batch``; work is shared among the cores, results do not depend on how.

    ``refuse`` as in :class:`BatchRun`.

    Raises:
        ProcessError: arrays do not fit together, a value is not finite, or a member leaves the physical world
            (NaN, negative volume).
    """
    run = BatchRun(kernel, batch, describe, refuse)
    run.advance(batch.steps)
    return BatchResult(record=run.record, state=run.state)


class BatchRun:
    """A batch that is checked once and then advanced piece by piece: inputs may be chosen as it goes."""

    def __init__(
        self, kernel: Kernel, batch: Batch, describe: Callable[[int], str] = "state {}".format, refuse: bool = True
    ) -> None:
        """At the beginning; raises as :func:`simulate` does.

        Without ``refuse`` no error is raised where a member leaves the physical world: its states, and its record from
        then on, are NaN, and all others go on.
        """
        _check_shapes(batch)
        _check_values(batch, describe)
        self._kernel, self._describe, self._refuse = kernel, describe, refuse
        self._batch = batch = _packed(batch)
        self._picks = np.array(batch.record, dtype=np.int64)
        self._begin = np.zeros(len(batch.state), dtype=np.int64) if batch.begin is None else batch.begin.copy()
        moves = Moves.none(len(batch.state)) if batch.moves is None else batch.moves
        self.moves = moves.beginning_in(batch.state, batch.start_s)
        """What happens beside the equations; what is written of it holds from the second that is reached."""
        self._reached = 0
        self.state = batch.state
        """States at the tick that is reached, shape (M, states)."""
        self.inputs = batch.inputs
        """Input schedules, shape (K, steps, inputs); those of ticks that are not reached yet may be written."""
        self.parameters = batch.parameters.copy() if moves else batch.parameters
        """Parameters, shape (M, parameters); what is written holds from the tick that is reached."""
        self.severity, self.onset_s = batch.severity, batch.onset_s
        """Severities and onsets [s] of the faults, shape (M, faults); as the parameters."""
        self.record = np.full((len(batch.state), batch.steps // batch.stride, len(batch.record)), np.nan)
        """As in :class:`BatchResult`, as far as it is reached."""

    def advance(self, until: int) -> None:
        """Advance every member to tick ``until``; raises as :func:`simulate` does."""
        if not self._reached <= until <= self._batch.steps:
            raise ProcessError(f"tick {until} must lie in {self._reached} to {self._batch.steps}")
        if np.isinf(self.inputs[:, self._reached : until]).any():
            when = f"at t = {self._batch.start_s + self._reached * tick_of(self._kernel):.10g} s"
            raise ProcessError(f"input schedules contain an infinite value {when}; NaN stands for automatic")
        members, broken, b = len(self.state), np.full(len(self.state), np.nan), self._batch
        given = (self.state, self.parameters, b.severity, b.onset_s, self.inputs, b.input_of, float(b.start_s))
        noise = (b.seeds, b.process_noise, b.sensor_noise)

        def run(first: int, last: int) -> None:
            where = (self._picks, self.record, broken)
            self._kernel(first, last, *given, self._begin, until, b.stride, *noise, *where, self.moves)

        workers = min(_threads or _CORES or 1, MOST_THREADS)
        if members * (until - self._reached) < 20_000 or workers == 1 or members == 1:
            run(0, members)
        else:
            edges = np.linspace(0, members, 4 * workers + 1).astype(int)
            with ThreadPoolExecutor(workers) as pool:
                list(pool.map(run, edges[:-1], edges[1:]))
        lost = ~np.isnan(broken)
        if lost.any() and self._refuse:
            raise self._first_broken(broken)
        self.state[lost] = np.nan
        self._reached = until
        self._begin = np.maximum(self._begin, until)

    def _first_broken(self, broken: Vec) -> ProcessError:
        """Which member left the physical world, when, and with what state."""
        member = int(np.flatnonzero(~np.isnan(broken))[0])
        row = self.state[member]
        wrong = np.flatnonzero(~np.isfinite(row)).tolist() or self._batch.record or range(len(row))
        bad = ", ".join(f"{self._describe(int(c))} = {row[c]:.6g}" for c in wrong[:3])
        return ProcessError(
            f"member {member} left the physical world at t = {broken[member]:.10g} s (volume < 0 or not finite): {bad}"
        )


def _packed(batch: Batch) -> Batch:
    """The same in one memory layout, so that one compiled version serves every caller; the state is a copy."""
    whole = {name: v for name in ("input_of", "seeds", "begin") if (v := getattr(batch, name)) is not None}
    numbers = ("parameters", "severity", "onset_s", "inputs", "process_noise", "sensor_noise")
    packed: dict[str, Any] = {name: np.require(v, np.int64, ("C", "W")) for name, v in whole.items()}
    packed |= {name: np.require(getattr(batch, name), np.float64, ("C", "W")) for name in numbers}
    return replace(batch, state=np.array(batch.state, dtype=np.float64, order="C"), **packed)


def _check_shapes(batch: Batch) -> None:
    """Refuse arrays that do not fit together: compiled code does not look where it reads."""
    if batch.steps < 1 or batch.stride < 1:
        raise ProcessError(f"steps {batch.steps} and stride {batch.stride} must be >= 1")
    if batch.inputs.ndim != 3 or batch.inputs.shape[1] < batch.steps:
        raise ProcessError(f"input schedules of shape {batch.inputs.shape} do not cover {batch.steps} ticks")
    members, states = batch.state.shape
    for name in PER_MEMBER:
        array = getattr(batch, name)
        if array is not None and len(array) != members:
            raise ProcessError(f"{name} has {len(array)} rows for {members} members; must be one each")
    if batch.onset_s.shape != batch.severity.shape:
        raise ProcessError(f"onset_s of shape {batch.onset_s.shape} must be like severity, {batch.severity.shape}")
    if batch.moves is not None:
        _check_moves(batch, batch.moves)
    for name, limit in {"input_of": len(batch.inputs), "record": states, "begin": batch.steps + 1}.items():
        chosen = getattr(batch, name)
        used = np.asarray(() if chosen is None else chosen)
        if used.size and not 0 <= used.min() <= used.max() < limit:
            raise ProcessError(f"{name} {sorted(set(used.tolist()))} must be within 0 and {limit - 1}")


def _check_moves(batch: Batch, moves: Moves) -> None:
    members, states = batch.state.shape
    if len(moves.begin) != members + 1:
        raise ProcessError(f"there are moves of {len(moves.begin) - 1} members for {members}; must be one each")
    if misfit := moves.misfit(states, batch.parameters.shape[1], batch.inputs.shape[2]):
        raise ProcessError(misfit)


def _check_values(batch: Batch, describe: Callable[[int], str]) -> None:
    """Refuse what is not finite before it can spread."""
    when = f"at t = {batch.start_s:.10g} s"
    if not np.isfinite(batch.start_s):
        raise ProcessError(f"start_s is {batch.start_s!r}; must be finite")
    for name, table, good in (
        ("state", batch.state, np.isfinite(batch.state)),
        ("parameter", batch.parameters, np.isfinite(batch.parameters)),
        ("severity", batch.severity, np.isfinite(batch.severity)),
        ("onset", batch.onset_s, ~np.isnan(batch.onset_s)),
        ("process noise", batch.process_noise[:, None], np.isfinite(batch.process_noise[:, None])),
        ("sensor noise", batch.sensor_noise[:, None], np.isfinite(batch.sensor_noise[:, None])),
    ):
        if not good.all():
            member, column = (int(i) for i in np.argwhere(~good)[0])
            label = describe(column) if name == "state" else f"{name} {column}"
            raise ProcessError(f"member {member}: {label} is {float(table[member, column])!r} {when}; must be finite")
