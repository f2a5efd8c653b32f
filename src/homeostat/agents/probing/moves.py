"""Moves: what may be tried only to learn something: other ways that are open, and small steps of open setpoints."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from homeostat.agents.search.candidates import Point, SearchSpace, along_by_design
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath

STEPS = (0.05, 0.1, 0.2)
"""Steps of a setpoint, up and down, as fractions of its range [1]."""
CHANGE = 0.01
"""Production that a move is worth, and one more for all of a setpoint's range [1]."""
RISK = 0.05
"""Production that is worth each rank by which a state is riskier than the present one, while it lasts [1]."""


@dataclass(frozen=True, slots=True)
class Move:
    """A candidate."""

    actions: ActionSet
    """What is commanded; what follows anyway where it is a wait."""
    path: RecoveryPath | None
    """The path that it takes; None for a wait."""
    once: float = 0.0
    """What it costs to move at all, in production [1]."""
    risk: float = 0.0
    """What its risk costs while it lasts, in production [1]."""


BETWEEN = 0.01
"""Share of its range by which what has two positions is at neither [1]."""


def moves(paths: Sequence[RecoveryPath], tags: Mapping[str, Tag], values: Mapping[str, float]) -> Iterator[Move]:
    """Every move along ``paths`` from the present ``values``.

    A step is small where the state that it is taken in could be entered without any other change. A way with
    later steps is tried only where it ends as a batch does by itself, or where somebody may decide to go back to where
    it began: from elsewhere there may be no way on.
    """
    been: set[str] = set()
    for path in paths:
        if path.awaited:
            if path.decisions and (path.target in path.machine.ordinary or path.way_back(values) is not None):
                actions = along_by_design(path, tags)
                yield Move(actions, path, CHANGE, RISK * _risk_added(path))
            continue
        space = SearchSpace(path.machine.state(path.target), tags)
        here = space.present(values)
        if path.target in been or not _stands_in(space, here, values):
            continue
        been.add(path.target)
        for point in _around(space, here):
            change = CHANGE * (1.0 + space.gap(point, here))
            yield Move(space.actions(point), path, change, RISK * _risk_added(path))


def _risk_added(path: RecoveryPath) -> int:
    """By how many ranks the state that ``path`` leads to at once is riskier than the one that it leaves."""
    return max(path.machine.state(path.now).risk - path.machine.state(path.states[0]).risk, 0)


def _stands_in(space: SearchSpace, here: Point, values: Mapping[str, float]) -> bool:
    """Whether the plant could be in the state as it stands: nothing reads off ``here`` by more than its scale.

    What has two positions must be at one of them: from between, any move would be a stroke.
    """
    pairs = ((space.tags[r.tag], v, values.get(r.tag, math.nan)) for r, v in zip(space.ranges, here, strict=True))
    return not any(
        value is not None and abs(value - read) > (BETWEEN * tag.range.span if tag.two_position else tag.scale)
        for tag, value, read in pairs
    )


def _around(space: SearchSpace, here: Point) -> Iterator[Point]:
    """Points that differ from ``here`` by one step of one setpoint; manual outputs stay, and what has two positions."""
    for k, (r, value) in enumerate(zip(space.ranges, here, strict=True)):
        if value is None or r.design is None or r.high <= r.low or space.tags[r.tag].two_position:
            continue
        for step in (sign * share * (r.high - r.low) for share in STEPS for sign in (-1.0, 1.0)):
            if r.low <= value + step <= r.high:
                yield (*here[:k], value + step, *here[k + 1 :])
