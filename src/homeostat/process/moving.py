"""What moves do in one tick of one member: blocks that go round a kernel (compiled).

The rows of a member lie together; see :class:`~homeostat.process.moves.Moves` for what they mean.
"""

import math
from collections.abc import Callable
from enum import IntEnum

from homeostat.process.compiled import compiled
from homeostat.process.types import Cube, IndexTable, Indices, Table, Vec

PARAMETER, STATE, READING, FROZEN, INPUT = 0, 1, 2, 3, 4
SAME_S = 1e-9
"""Times that differ by no more are the same: a sum of ticks is rounded [s]."""


class W(IntEnum):
    """Columns of what is moved."""

    kind = 0
    column = 1


class H(IntEnum):
    """Columns of how it is moved."""

    onset_s = 0
    size = 1
    grows = 2
    least = 3
    most = 4
    done = 5
    """By how much a parameter was moved so far."""
    frozen = 6
    """What a stuck reading shows; NaN before its onset."""
    grown_s = 7
    """Seconds after which what grows stays as it is [s]."""
    period_s = 8
    """Period of what swings [s]; 0 for everything else."""


@compiled
def change(how: Vec, at_s: float) -> float:
    """By how much the row ``how`` moves its column at ``at_s`` [s]."""
    since = at_s - how[H.onset_s]
    if since < -SAME_S:
        return 0.0
    if how[H.period_s] > 0.0:
        return float(how[H.size] * math.sin(2.0 * math.pi * since / how[H.period_s]))
    return float(how[H.size] * min(max(since, 0.0), how[H.grown_s]) if how[H.grows] > 0.0 else how[H.size])


@compiled
def quiet_ticks(what: IndexTable, how: Table, first: int, last: int, at_s: float, tick: float) -> float:
    """Whole ticks from ``at_s`` [s] on in which rows ``first`` to ``last`` - 1 do nothing.

    Infinite for ever. A parameter that differs, and does not go on to differ more, is moved once; everything else
    every tick of ``tick`` [s]; inputs are moved by who commands them.
    """
    begins = math.inf
    for i in range(first, last):
        kind, onset_s = what[i, W.kind], how[i, H.onset_s]
        if kind == PARAMETER and how[i, H.grows] <= 0.0 and how[i, H.period_s] <= 0.0:
            if onset_s > at_s + SAME_S:
                begins = min(begins, onset_s)
        elif kind != INPUT:
            begins = min(begins, onset_s - tick)
    return math.ceil(max(begins - at_s, 0.0) / tick - SAME_S) if begins < math.inf else math.inf


@compiled
def move_parameters(p: Vec, what: IndexTable, how: Table, first: int, last: int, at_s: float) -> None:
    """Move ``p`` to what it is in the tick from ``at_s`` on [s]."""
    for i in range(first, last):
        if what[i, W.kind] == PARAMETER:
            now = change(how[i], at_s)
            p[what[i, W.column]] += now - how[i, H.done]
            how[i, H.done] = now
    for i in range(first, last):
        if what[i, W.kind] == PARAMETER and p[what[i, W.column]] < how[i, H.least]:
            how[i, H.done] += how[i, H.least] - p[what[i, W.column]]
            p[what[i, W.column]] = how[i, H.least]


@compiled
def move_states(x: Vec, what: IndexTable, how: Table, first: int, last: int, at_s: float, tick: float) -> None:
    """Move the states ``x`` at ``at_s`` [s], the end of a tick [s]; stuck readings show what they showed at first."""
    for kind in (STATE, READING):
        for i in range(first, last):
            if what[i, W.kind] == kind:
                x[what[i, W.column]] += change(how[i], at_s) * (tick if kind == STATE else 1.0)
        for i in range(first, last):
            if what[i, W.kind] == kind and x[what[i, W.column]] < how[i, H.least]:
                x[what[i, W.column]] = how[i, H.least]
    for i in range(first, last):
        if what[i, W.kind] == FROZEN and how[i, H.onset_s] <= at_s + SAME_S:
            if math.isnan(how[i, H.frozen]):
                how[i, H.frozen] = x[what[i, W.column]]
            x[what[i, W.column]] = how[i, H.frozen]


@compiled
def is_shown(what: IndexTable, how: Table, i: int, column: int, at_s: float) -> bool:
    """Whether row ``i`` changes what a record of ``column`` shows at ``at_s`` [s]."""
    kind = what[i, W.kind]
    moved = kind == READING or (kind == FROZEN and how[i, H.onset_s] <= at_s + SAME_S)
    return bool(moved and what[i, W.column] == column)


def with_moves(advance: Callable[..., None]) -> Callable[..., None]:
    """``advance``, stopped wherever something of a member is moved beside its equations; ``begin`` is written."""

    def advance_moved(
        tick: float, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices,
        t0: float, begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices,
        out: Cube, broken_at: Vec, moves_of: Indices, what: IndexTable, how: Table, work: Vec,
    ) -> None:  # fmt: skip
        for m in range(first, last):
            one, end, quiet = moves_of[m], moves_of[m + 1], math.inf
            while True:
                k, until = begin[m], steps
                if one < end and k < steps:
                    move_parameters(p[m], what, how, one, end, t0 + k * tick)
                    quiet = k + quiet_ticks(what, how, one, end, t0 + k * tick, tick)
                    if quiet <= k + 1:
                        until = k + 1
                    elif quiet < steps:
                        until = int(quiet)
                advance(
                    m, m + 1, x, p, sev, onset, u, u_of, t0, begin, until, stride, seeds, process, sensor, picks, out,
                    broken_at, work,
                )  # fmt: skip
                if one == end or k >= steps or not math.isnan(broken_at[m]):
                    break
                begin[m] = until
                if quiet <= k + 1:
                    move_states(x[m], what, how, one, end, t0 + until * tick, tick)
                    if until % stride == 0:
                        for i in range(one, end):
                            for j in range(picks.shape[0]):
                                if is_shown(what, how, i, picks[j], t0 + until * tick):
                                    out[m, until // stride - 1, j] = x[m, picks[j]]
                if until >= steps:
                    break

    return advance_moved
