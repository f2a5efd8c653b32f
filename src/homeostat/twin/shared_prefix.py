"""What members have in common until their newest fault acts is simulated once.

An explanation tries hundreds of sizes and onsets of a fault on the same minutes. Until the onset each of them is the
plant without that fault, and most of the minutes lie before it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from homeostat.process.batch import Batch, BatchResult, Kernel, simulate
from homeostat.process.types import Indices, Table


def simulate_with_prefix(kernel: Kernel, batch: Batch, describe: Callable[[int], str]) -> BatchResult:
    """As :func:`~homeostat.process.batch.simulate`, to the bit, for members without noise that follow one schedule.

    ``batch`` records every second.
    """
    before = _without_newest(batch)
    state, begin = batch.state.copy(), np.zeros(len(batch.state), dtype=np.int64)
    prefixes = []
    for members in _families(batch, before):
        length = int(before.seconds[members].max())
        prefix = simulate(kernel, _leader(batch, before, members[0], length), describe).record[0]
        begin[members] = before.seconds[members]
        state[members] = prefix[begin[members] - 1]
        prefixes.append((members, prefix[:, batch.record]))
    result = simulate(kernel, replace(batch, state=state, begin=begin), describe)
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
    seconds: Indices
    """Seconds of the batch that end before it acts, shape (members,)."""


def _without_newest(batch: Batch) -> _Before:
    onset = np.where(np.isfinite(batch.onset_s), batch.onset_s, -np.inf)
    newest = np.arange(len(onset)), onset.argmax(axis=1)
    severity, others = batch.severity.copy(), batch.onset_s.copy()
    severity[newest], others[newest] = 0.0, np.inf
    ended = np.ceil(onset[newest] - batch.start_s) - 1.0
    return _Before(severity, others, np.clip(ended, 0.0, batch.steps).astype(np.int64))


def _families(batch: Batch, before: _Before) -> list[list[int]]:
    """Members with the same prefix; those that have none, or share it with nobody, are in no family."""
    rows = np.hstack([batch.state, batch.parameters, before.severity, before.onset_s])
    found: dict[bytes, list[int]] = {}
    for m in np.flatnonzero(before.seconds > 0).tolist():
        found.setdefault(rows[m].tobytes(), []).append(m)
    return [members for members in found.values() if len(members) > 1]


def _leader(batch: Batch, before: _Before, member: int, seconds: int) -> Batch:
    """``member`` alone for ``seconds``, without its newest fault, every state recorded."""
    without = replace(batch, severity=before.severity, onset_s=before.onset_s, steps=seconds)
    return replace(without.members(np.array([member])), record=tuple(range(batch.state.shape[1])))
