"""The published reactor with its noise, second by second, on this project's kernel.

The kernel runs without noise of its own; before each second the published deviates are put into the state. They come
from one stream (``RandomState(42).randn``), in the order reactor temperature, feed flow, concentration of A and of D
in the feed, feed temperature; in the shut-down phase the feed flow is not measured, so that four are drawn. A rollout
goes on in the same stream wherever the calls before it have left it.

Two facts of the published model that the noise-free trajectories cannot show:

- the second that ends at t carries the temperature that was measured at its start, next to the volume and the
  positions at its end;
- the level loop's feed-forward follows the true feed flow; only the flow loop sees the noise. With a noisy
  feed-forward 50 of 90 recorded verdicts come out with other numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.recorded_calls import Setpoints
from homeostat.plants.cstr.process import NORMAL
from homeostat.process.types import Vec
from tests.plants.cstr.reactor import FAULTS, MODEL, PUBLISHED, SEVERITY, P, S, U, inputs, parameters

END_S = 8000
"""End of every published run and rollout [s]."""
_FIRST, _NONE = np.zeros(1, dtype=np.int64), np.zeros(1)
DESIGN = Setpoints(310.0, 10.0, 2.0 / 60.0)
"""Setpoints at the start of every run."""
TAGS = ("T1", "L1", "overflow", "V1.pos", "P1.pos", "V2.pos")
"""What the published rules read: measured temperature [K], true level [L], overflow [L/s], positions [1]."""


@cache
def stream() -> Vec:
    """The published noise, long enough for a run and seven rollouts."""
    return np.random.RandomState(42).randn(300_000)


@dataclass(frozen=True, slots=True)
class Course:
    """A stretch of seconds; the first row is the second from which it starts."""

    start_s: int
    """Process time of the first row [s]."""
    signals: Mapping[str, Vec]
    """Tag of :data:`TAGS` -> values, shape (seconds + 1,)."""
    true_temperature: Vec
    """Without the noise [K], shape (seconds + 1,)."""
    normal: Vec
    """1 where the second belongs to the phase NORMAL, otherwise 0, shape (seconds + 1,)."""
    draws: int
    """Normal deviates that the stream has given at its end."""

    @property
    def seconds(self) -> int:
        """Simulated seconds."""
        return len(self.normal) - 1


class PublishedReactor:
    """The published plant with one fault of nominal size."""

    def __init__(self, fault: str, onset_s: float) -> None:
        """Empty vessel at t = 0, ``fault`` acting from ``onset_s`` on."""
        self.time_s = 0
        self.draws = 0
        self._parameters = parameters(**PUBLISHED)
        self._state = MODEL.initial_state(self._parameters)
        self._inputs = _inputs(DESIGN)
        self._severity, self._onset = np.zeros(len(FAULTS)), np.full(len(FAULTS), np.inf)
        self._severity[FAULTS.index(fault)] = SEVERITY[fault]
        self._onset[FAULTS.index(fault)] = onset_s
        self.last: tuple[float, ...] = ()
        """The row of the last second: the tags of :data:`TAGS`, true temperature, whether the phase is NORMAL."""

    def advance(self, until_s: int) -> None:
        """Run on to ``until_s`` [s]."""
        while self.time_s < until_s:
            self.last = self._second()

    def roll_out(self, setpoints: Setpoints, draws: int, until_s: int = END_S) -> Course:
        """What ``setpoints`` would do if they were stepped to now, with the stream at ``draws``; the plant stays."""
        kept = self._state.copy(), self._inputs, self.time_s, self.draws
        start_s, rows = self.time_s, [self.last]
        self._inputs, self.draws = _inputs(setpoints), draws
        while self.time_s < until_s:
            rows.append(self._second())
        drawn = self.draws
        self._state, self._inputs, self.time_s, self.draws = kept
        columns = np.array(rows).T
        return Course(start_s, dict(zip(TAGS, columns, strict=False)), columns[-2], columns[-1], drawn)

    def _second(self) -> tuple[float, ...]:
        """One second with the published noise; the row at its end."""
        x, p, u, z, k = self._state, self._parameters, self._inputs, stream(), self.draws
        x[S.T1] = measured = x[S.T] + p[P.sd_T1] * z[k]
        k += 1
        setpoint = u[U.F1_sp]
        if self.time_s < p[P.t_shutdown]:
            # The loop sees setpoint - reading; the feed-forward reads F1. So the noise goes into the setpoint.
            u[U.F1_sp] = setpoint - p[P.rel_F1] * z[k] * x[S.F1]
            k += 1
        x[S.CA_feed_noise], x[S.CD_feed_noise], x[S.T_feed_noise] = z[k : k + 3]
        MODEL.kernel(
            0, 1, x[None], p[None], self._severity[None], self._onset[None], u[None, None], _FIRST, float(self.time_s),
            _FIRST, 1, 1, _FIRST, _NONE, _NONE, _FIRST[:0], np.zeros((1, 1, 0)), np.full(1, np.nan),
        )  # fmt: skip
        u[U.F1_sp] = setpoint
        self.time_s += 1
        self.draws = k + 3
        return (
            measured, x[S.V], x[S.overflow], x[S.V1_position], x[S.P1_position], x[S.V2_position], x[S.T],
            float(x[S.phase] == NORMAL),
        )  # fmt: skip


def _inputs(setpoints: Setpoints) -> Vec:
    return inputs(T1_sp=setpoints.temperature, L1_sp=setpoints.level, F1_sp=setpoints.feed)
