"""The model's contract: every tag has reading and truth, an estimate shows the readings, and kernels repeat themselves.

The simulated plant, the twin and the search rely on each of these; what breaks one is refused before anything is run.
"""

from __future__ import annotations

import contextlib
import math
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from homeostat.domain.plant.description import Relation
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.process.batch import Batch, BatchResult, simulate, tick_of
from homeostat.process.kernel import CompiledKernel
from homeostat.process.model import written_in
from homeostat.process.types import Table, Vec

TICKS = 60
"""Length of what is simulated, in ticks."""
_SWITCH: Final = "NUMBA_DISABLE_JIT"


def interface(bench: Bench) -> Iterator[Finding]:
    """Names, shapes and numbers of what the model gives for the plant's first ticks."""
    plant, model = bench.plant, bench.plant.model
    state = model.initial_state(bench.nominal)
    if problem := _not_a_state(state, len(model.states)):
        yield of_model(bench, "interface", "initial_state", problem, f"give {len(model.states)} finite numbers")
        return
    result = simulate(model.kernel, opening(bench), model.states.__getitem__)
    read, where = model.readings(result.state[0], plant.start), bench.places
    truth = model.truth(result.record, np.tile(plant.start, (1, TICKS, 1)))
    for signal in plant.description.signals:
        name, row = signal.variable, where.row("signals", tag=signal.tag.name)
        measured = signal.relation is Relation.MEASURES
        if name not in read:
            yield _lacking(bench, "readings", signal.tag.name, name, str(row))
        elif measured and not math.isfinite(read[name]):
            what = f"readings say {read[name]} of {name!r}, the variable of {signal.tag.name!r}, after {TICKS} ticks"
            yield of_model(bench, "interface", "readings", what, "give a finite number for everything that is measured")
        if name not in truth:
            yield _lacking(bench, "truth", signal.tag.name, name, str(row))
        elif np.shape(truth[name]) != (1, TICKS):
            what = f"truth gives {name!r} the shape {np.shape(truth[name])}"
            yield of_model(bench, "interface", "truth", what, f"give (members, times), here (1, {TICKS})")
    yield from _estimated(bench, read)


def _estimated(bench: Bench, read: Mapping[str, float]) -> Iterator[Finding]:
    """Whether an estimate is a state at all."""
    model = bench.plant.model
    if {signal.variable for signal in bench.plant.description.signals} - read.keys():
        return
    if problem := _not_a_state(model.estimate(read), len(model.states)):
        yield of_model(
            bench, "interface", "estimate", problem, f"give {len(model.states)} finite numbers, shape (states,)"
        )


def repetition(bench: Bench) -> Iterator[Finding]:
    """Equal inputs give equal courses: again, among other members, in two parts, and compiled as in plain Python."""
    model, batch = bench.plant.model, opening(bench, members=3)
    first = simulate(model.kernel, batch)
    half = TICKS // 2
    begun = simulate(model.kernel, _cut(batch, batch.state, 0, half))
    middle = replace(batch, start_s=half * tick_of(model.kernel))
    rest = simulate(model.kernel, _cut(middle, begun.state, half, TICKS - half))
    again = {
        "when it is simulated again": simulate(model.kernel, batch).state,
        "in two parts": rest.state,
        "without other members beside it": simulate(model.kernel, batch.members(np.array([0]))).state,
    }
    for how, state in again.items():
        if not np.array_equal(state, first.state[: len(state)], equal_nan=True):
            name = _worst(model.states, state, first.state[: len(state)])
            what = f"the same course ends in another state {how}: {name} differs"
            yield of_model(bench, "repetition", "kernel", what, "let the kernel depend on its arguments alone")
    yield from _plain(bench, batch, first)


def _plain(bench: Bench, batch: Batch, compiled: BatchResult) -> Iterator[Finding]:
    """Machine code against the Python that it was made of, where the kernel has both."""
    kernel = bench.plant.model.kernel
    if isinstance(kernel, CompiledKernel):
        with _interpreted():
            plain = simulate(kernel, batch)
        if not np.allclose(plain.state, compiled.state, rtol=1e-6, atol=1e-9, equal_nan=True):
            name = _worst(bench.plant.model.states, plain.state, compiled.state)
            what = f"machine code and plain Python differ after {TICKS} ticks: {name}"
            yield of_model(bench, "repetition", "kernel", what, "use nothing in it that numba computes otherwise")


def opening(bench: Bench, members: int = 1) -> Batch:
    """Members in the first ticks of a run, the plant's own noise included."""
    model = bench.plant.model
    none = np.zeros((members, len(model.faults)))
    ones = np.ones(members)
    return Batch(
        state=np.tile(model.initial_state(bench.nominal), (members, 1)),
        parameters=np.tile(bench.nominal, (members, 1)),
        severity=none,
        onset_s=np.full_like(none, np.inf),
        inputs=np.tile(bench.plant.start, (1, TICKS, 1)),
        input_of=np.zeros(members, dtype=np.int64),
        start_s=0.0,
        steps=TICKS,
        stride=1,
        record=tuple(range(len(model.states))),
        seeds=np.arange(members, dtype=np.int64) + 5,
        process_noise=ones,
        sensor_noise=ones,
    )


def of_model(bench: Bench, check: str, method: str, what: str, remedy: str) -> Finding:
    """What ``check`` finds about a ``method`` of the process model."""
    return Finding(Severity.ERROR, check, Place(module_file(bench), None, method), what, remedy)


def module_file(bench: Bench) -> str:
    """File in which the process model's class is."""
    return f"{written_in(bench.plant.model).rpartition('.')[2]}.py"


@contextlib.contextmanager
def _interpreted() -> Iterator[None]:
    """Kernels run as plain Python meanwhile."""
    before = os.environ.get(_SWITCH)
    os.environ[_SWITCH] = "1"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # whole numbers overflow on purpose in random draws
            yield
    finally:
        os.environ.pop(_SWITCH)
        if before is not None:
            os.environ[_SWITCH] = before


def _cut(batch: Batch, state: Table, begin: int, steps: int) -> Batch:
    return replace(batch, state=state, steps=steps, inputs=batch.inputs[:, begin : begin + steps])


def _not_a_state(state: Vec, columns: int) -> str:
    if np.shape(state) != (columns,):
        return f"it gives the shape {np.shape(state)} for {columns} states"
    wrong = np.flatnonzero(~np.isfinite(state))
    return f"it gives {float(state[wrong[0]])} for state {wrong[0]}" if wrong.size else ""


def _worst(names: tuple[str, ...], some: Table, others: Table) -> str:
    """The state that differs most, by how much."""
    off = np.abs(np.nan_to_num(some - others, nan=np.inf)).max(axis=0)
    column = int(np.argmax(off))
    return f"{names[column]!r} by {off[column]:.3g}"


def _lacking(bench: Bench, method: str, tag: str, variable: str, row: str) -> Finding:
    what = f"{method} have no {variable!r}, which carries tag {tag!r} ({row})"
    return of_model(
        bench, "interface", method, what, f"add it to what {method}() gives, or correct the column 'variable'"
    )
