"""What members have in common until their newest fault acts is simulated once.

An explanation tries hundreds of sizes and onsets of a fault on the same minutes. Until the onset each of them is the
plant without that fault, and most of the minutes lie before it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from homeostat.process.batch import Batch, BatchResult, Kernel, simulate, tick_of
from homeostat.process.types import Indices, Table

ROUNDED = 1e-9
"""Share of a tick by which an onset may be rounded [1]."""


def simulate_with_prefix(
    kernel: Kernel, batch: Batch, describe: Callable[[int], str], refuse: bool = True
) -> BatchResult:
    """As :func:`~homeostat.process.batch.simulate`, to the bit, for members without noise that follow one schedule.

    ``batch`` records every tick. Without ``refuse``, those whose prefix leaves the physical world do so by themselves.
    """
    before = _without_newest(batch, tick_of(kernel))
    state, begin = batch.state.copy(), np.zeros(len(batch.state), dtype=np.int64)
    prefixes = []
    for members in _families(batch, before):
        length = int(before.ticks[members].max())
        shared = simulate(kernel, _leader(batch, before, members[0], length), describe, refuse)
        if np.isnan(shared.state).any():
            continue
        prefix = shared.record[0]
        begin[members] = before.ticks[members]
        state[members] = prefix[begin[members] - 1]
        prefixes.append((members, prefix[:, batch.record]))
    result = simulate(kernel, replace(batch, state=state, begin=begin), describe, refuse)
    for members, shown in prefixes:
        for m in members:
            result.record[m, : begin[m]] = shown[: begin[m]]
    return result


@dataclass(frozen=True, slots=True)
class _Before:
    """The members of a batch before their newest fault."""

    severity: Table
    """Severities without it, shape (members, faults)."""
    onset_s: Table
    """Onsets without it [s], shape (members, faults)."""
    ticks: Indices
    """Ticks of the batch that end before it acts, shape (members,)."""


def _without_newest(batch: Batch, tick_s: float) -> _Before:
    onset = np.where(np.isfinite(batch.onset_s), batch.onset_s, -np.inf)
    newest = np.arange(len(onset)), onset.argmax(axis=1)
    severity, others = batch.severity.copy(), batch.onset_s.copy()
    severity[newest], others[newest] = 0.0, np.inf
    ended = np.ceil((onset[newest] - batch.start_s) / tick_s - ROUNDED) - 1.0
    return _Before(severity, others, np.clip(ended, 0.0, batch.steps).astype(np.int64))


def _families(batch: Batch, before: _Before) -> list[list[int]]:
    """Members with the same prefix; those that have none, or share it with nobody, are in no family."""
    rows = np.hstack([batch.state, batch.parameters, before.severity, before.onset_s])
    found: dict[bytes, list[int]] = {}
    for m in np.flatnonzero(before.ticks > 0).tolist():
        found.setdefault(rows[m].tobytes(), []).append(m)
    return [members for members in found.values() if len(members) > 1]


def _leader(batch: Batch, before: _Before, member: int, ticks: int) -> Batch:
    """``member`` alone for ``ticks``, without its newest fault, every state recorded."""
    without = replace(batch, severity=before.severity, onset_s=before.onset_s, steps=ticks)
    return replace(without.members(np.array([member])), record=tuple(range(batch.state.shape[1])))
