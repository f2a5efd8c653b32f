"""Candidate action sets of a state: where a search looks first, and next."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath

Point = tuple[float | None, ...]
"""One value per setpoint range of the state; None leaves a manual output on automatic."""
PRIMES = (2, 3, 5, 7, 11, 13, 17)
"""Bases of the Halton sequence; of more dimensions, larger ones would begin with points in one corner."""
LATTICE = 29
"""Numbers 1 to 28 times a power of 2, modulo this prime, are each of them once: what is scattered there instead."""
TOGETHER = 6
"""So many dimensions are stepped in all combinations, 729 of them; of more, one and two at a time."""


@dataclass(frozen=True, slots=True)
class SearchSpace:
    """What may be commanded in one state, and how a point becomes an action set."""

    state: State
    """The state."""
    tags: Mapping[str, Tag]
    """Tag name -> tag, for the rate limits."""

    @property
    def ranges(self) -> tuple[SetpointRange, ...]:
        """The dimensions."""
        return self.state.setpoints

    @property
    def design(self) -> Point:
        """Every setpoint at its design value, every manual output on automatic."""
        return tuple(r.design for r in self.ranges)

    def present(self, values: Mapping[str, float]) -> Point:
        """Where the plant's setpoints are now, brought into the state's ranges."""
        point: list[float | None] = []
        for r in self.ranges:
            value = values.get(r.tag, math.nan)
            if math.isnan(value) or r.high <= r.low:
                point.append(r.design)
            else:
                point.append(min(max(self.tags[r.tag].nearest(value), r.low), r.high))
        return tuple(point)

    def actions(self, point: Point) -> ActionSet:
        """The action set of ``point``."""
        pairs = zip(self.ranges, point, strict=True)
        return ActionSet(
            tuple(Command(r.tag, v, None if v is None else self.tags[r.tag].rate_limit) for r, v in pairs),
            self.state.name,
        )

    def point(self, actions: ActionSet) -> Point | None:
        """What ``actions`` command at once, as a point; None where they do not say all of it, or say more."""
        given = {c.tag: c.value for c in actions.commands}
        if given.keys() != {r.tag for r in self.ranges}:
            return None
        return tuple(given[r.tag] for r in self.ranges)

    def settled(self, point: Point) -> Point:
        """``point`` with what leaves no choice as this space has it: stuck actuators stand elsewhere each time."""
        return tuple(v if r.high > r.low else r.design for r, v in zip(self.ranges, point, strict=True))

    def admits(self, point: Point) -> bool:
        """Whether ``point`` lies in the ranges; nothing but a manual output may be left on automatic."""
        pairs = zip(self.ranges, point, strict=True)
        return all(r.design is None if v is None else r.low <= v <= r.high for r, v in pairs)

    def distance(self, point: Point) -> float:
        """How far ``point`` is from the design: setpoints in their ranges, summed; a manual output counts as two."""
        return self.gap(point, self.design)

    def gap(self, point: Point, other: Point) -> float:
        """How far two points are apart: differences in the ranges, summed; manual against automatic counts as two."""
        total = 0.0
        for r, v, w in zip(self.ranges, point, other, strict=True):
            if v is None or w is None:
                total += 0.0 if v is w else 2.0
            elif r.high > r.low:
                total += abs(v - w) / (r.high - r.low)
        return total

    def first(
        self, present: Point, levels: int = 13, scattered: int = 24, commanded: Mapping[str, float] | None = None
    ) -> list[Point]:
        """Sweeps of each setpoint from the design and the present point, and points scattered over the box.

        Manual outputs are tried where their controllers have them now, too, as far as ``commanded`` says where: what
        a controller does by a reading that is wrong need not go on, and no step is made by that.
        """
        points = [self.design, present]
        for k, r in enumerate(self.ranges):
            if r.high <= r.low:
                continue
            values = [r.low + (r.high - r.low) * i / (levels - 1) for i in range(levels)]
            if self.tags[r.tag].two_position:
                values = [r.low, r.high]
            elif r.design is None:
                values = [r.low + (r.high - r.low) * f for f in (0.5, 0.75, 1.0)]
                now = (commanded or {}).get(r.tag, math.nan)
                values += [min(max(self.tags[r.tag].nearest(now), r.low), r.high)] if math.isfinite(now) else []
            for base in {self.design, present}:
                points += [(*base[:k], v, *base[k + 1 :]) for v in values]
        for n in range(1, scattered + 1):
            points.append(tuple(self._scatter(r, n, k) for k, r in enumerate(self.ranges)))
        return list(dict.fromkeys(points))

    def around(self, point: Point, fraction: float) -> list[Point]:
        """Every combination of one step down, none, or up in each dimension; a step is ``fraction`` of the range.

        Of two positions both. Of more dimensions than :data:`TOGETHER` those in which at most two are stepped.
        """
        options: list[Sequence[float | None]] = []
        for r, v in zip(self.ranges, point, strict=True):
            if v is None or r.high <= r.low:
                options.append((v,))
            elif self.tags[r.tag].two_position:
                options.append((r.low, r.high))
            else:
                step = fraction * (r.high - r.low)
                options.append(sorted({min(max(v + s * step, r.low), r.high) for s in (-1.0, 0.0, 1.0)}))
        moving = [k for k, values in enumerate(options) if len(values) > 1]
        if len(moving) <= TOGETHER:
            return [tuple(c) for c in itertools.product(*options)]
        pairs = (
            itertools.product(*(values if k in pair else (point[k],) for k, values in enumerate(options)))
            for pair in itertools.combinations(moving, 2)
        )
        return list(dict.fromkeys(itertools.chain.from_iterable(pairs)))

    def _scatter(self, r: SetpointRange, n: int, k: int) -> float | None:
        """The n-th of points that are spread evenly in the range of dimension ``k``; manual outputs stay automatic."""
        if r.design is None:
            return None
        value = r.low + (r.high - r.low) * (_halton(n, PRIMES[k]) if k < len(PRIMES) else _lattice(n, k))
        return self.tags[r.tag].nearest(value) if r.high > r.low else value


def _halton(n: int, base: int) -> float:
    """The n-th number of the van der Corput sequence of this base, 0 to 1."""
    fraction, weight = 0.0, 1.0
    while n > 0:
        weight /= base
        n, digit = divmod(n, base)
        fraction += digit * weight
    return fraction


def _lattice(n: int, k: int) -> float:
    """The n-th number of a rank-1 lattice in dimension ``k`` (Korobov, with generator 2), 0 to 1."""
    return n * pow(2, k, LATTICE) % LATTICE / LATTICE


def design_commands(state: State, tags: Mapping[str, Tag]) -> tuple[Command, ...]:
    """What ``state`` is commanded by design, each not faster than its tag may change."""
    return SearchSpace(state, tags).actions(SearchSpace(state, tags).design).commands


def along_by_design(path: RecoveryPath, tags: Mapping[str, Tag]) -> ActionSet:
    """``path``, with what each state on it is commanded by design."""
    return ActionSet.along(path, lambda state: design_commands(state, tags))
