"""Courses that go on from where one has ended, many at once: what is commanded stays as it is then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.process.batch import Batch, BatchRun
from homeostat.process.types import Cube, Vec

MOMENTS: Final = 4000
"""Most moments of such a course that are kept."""


@dataclass(frozen=True, slots=True)
class Begun:
    """Where one goes on from."""

    state: Vec
    """True state, shape (states,)."""
    inputs: Vec
    """Inputs, shape (inputs,); NaN for automatic."""
    at_s: float
    """Process time then [s]; the same for all that go on together."""
    fault: str = ""
    """What is wrong, by an equation of the model; empty for nothing."""
    severity: float = 0.0
    """How much, in the fault's unit."""
    onset_s: float = 0.0
    """Since when, in process time [s]."""


def onward(bench: Bench, every: Sequence[Begun], for_s: float) -> list[Trajectory]:
    """The true signals of each for ``for_s`` [s], without noise; NaN once it has left the physical world."""
    record, dt_s = states_of(bench, every, for_s)
    inputs = np.array([each.inputs for each in every])
    along = np.broadcast_to(inputs[:, None], (*record.shape[:2], inputs.shape[1]))
    truth, variables = bench.plant.model.truth(record, along), bench.plant.description.variables
    named = {tag: truth[variable] for tag, variable in variables.items()}
    named |= {name: values for name, values in truth.items() if name not in named}
    members = range(len(every))
    return [Trajectory(dt_s, dt_s, {name: values[row : row + 1] for name, values in named.items()}) for row in members]


def states_of(bench: Bench, every: Sequence[Begun], for_s: float) -> tuple[Cube, float]:
    """The true states of each, shape (members, times, states), and the time between two [s]; as :func:`onward`."""
    model, timing = bench.plant.model, bench.plant.description.timing
    steps = max(int(for_s / timing.tick_s), 1)
    stride, members = -(-steps // MOMENTS), len(every)
    severity = np.zeros((members, len(model.faults)))
    onset_s = np.full_like(severity, np.inf)
    for row, each in enumerate(every):
        if each.fault:
            column = model.faults.index(each.fault)
            severity[row, column], onset_s[row, column] = each.severity, each.onset_s
    inputs = np.array([each.inputs for each in every])
    batch = Batch(
        state=np.array([each.state for each in every]),
        parameters=np.tile(bench.nominal, (members, 1)),
        severity=severity,
        onset_s=onset_s,
        inputs=np.repeat(inputs[:, None], steps, axis=1),
        input_of=np.arange(members),
        start_s=every[0].at_s,
        steps=steps,
        stride=stride,
        record=tuple(range(len(model.states))),
        seeds=np.zeros(members, dtype=np.int64),
        process_noise=np.zeros(members),
        sensor_noise=np.zeros(members),
    )
    run = BatchRun(model.kernel, batch, refuse=False)
    run.advance(steps)
    return run.record, stride * timing.tick_s
