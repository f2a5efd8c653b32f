"""The reactor put together from blocks beside a kernel of it by hand: ``python -m benchmarks.plants.kernels``.

Both have the same balances, loops, instruments, noise, phases and faults; the plant that ships is the one from blocks.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.plants.by_hand.kernel import advance
from benchmarks.plants.by_hand.layout import FaultSlot, Input, Parameter, StateSlot
from homeostat.process.batch import Batch, Kernel, simulate, use_threads
from tests.plants.cstr.reactor import MODEL, NOMINAL, inputs

MEMBERS, SECONDS, ROUNDS = 200, 1500, 7


@dataclass(frozen=True)
class Compiled:
    """A kernel, and the names of its columns."""

    kernel: Kernel
    states: tuple[str, ...]
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    faults: tuple[str, ...]


BY_HAND = Compiled(advance, StateSlot._fields, Parameter._fields, Input._fields, FaultSlot._fields)
FROM_BLOCKS = Compiled(MODEL.kernel, MODEL.states, MODEL.parameters, MODEL.inputs, MODEL.faults)


def batch(of: Compiled) -> Batch:
    """Members with noise and no fault that fill their vessels, and then hold them."""
    state = np.zeros((MEMBERS, len(of.states)))
    start = MODEL.initial_state(np.array([NOMINAL[name] for name in MODEL.parameters]))
    for name, value in zip(MODEL.states, start, strict=True):
        named = name.replace("position", "pos")
        if named in of.states or name in of.states:
            state[:, of.states.index(name if name in of.states else named)] = value
    given = dict(zip(MODEL.inputs, inputs(), strict=True))
    row = np.array([given.get(name, np.nan) for name in of.inputs])
    none = np.zeros((MEMBERS, len(of.faults)))
    return Batch(
        state=state, parameters=np.tile([NOMINAL[name] for name in of.parameters], (MEMBERS, 1)),
        severity=none, onset_s=np.full_like(none, np.inf), inputs=np.tile(row, (1, SECONDS, 1)),
        input_of=np.zeros(MEMBERS, dtype=np.int64), start_s=0.0, steps=SECONDS, stride=SECONDS,
        record=(of.states.index("V"), of.states.index("T")), seeds=np.arange(MEMBERS),
        process_noise=np.ones(MEMBERS), sensor_noise=np.ones(MEMBERS),
    )  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """What the two kernels took, and how far apart they end."""

    hand_written_s: float
    """Median of the hand-written kernel [s]."""
    from_blocks_s: float
    """Median of the other one [s]."""
    apart: float
    """Largest difference of volume [L] and temperature [K] at the end."""

    @property
    def ratio(self) -> float:
        """From blocks to hand-written [1]."""
        return self.from_blocks_s / self.hand_written_s


def compared() -> Compared:
    """Let both take turns on one thread: ``MEMBERS`` over ``SECONDS``."""
    use_threads(1)
    both = BY_HAND, FROM_BLOCKS
    batches = [batch(each) for each in both]
    took: list[list[float]] = [[], []]
    ends = [np.empty(0), np.empty(0)]
    for turn in range(ROUNDS + 1):
        for k, each in enumerate(both):
            begun = time.perf_counter()
            ends[k] = simulate(each.kernel, batches[k]).record[:, -1]
            if turn:  # the first one may compile
                took[k].append(time.perf_counter() - begun)
    return Compared(*map(statistics.median, took), float(np.abs(ends[0] - ends[1]).max()))


if __name__ == "__main__":
    found = compared()
    print(found, f"ratio {found.ratio:.2f}")
