"""Moves: what may be tried only to learn something: other ways that are open, and small steps of open setpoints."""

from collections.abc import Iterator, Mapping, Sequence

from homeostat.agents.search.candidates import Point, SearchSpace, design_commands, present_point
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath

STEPS = (0.05, 0.1, 0.2)
"""Steps of a setpoint, up and down, as fractions of its range [1]."""
CHANGE = 0.01
"""Production that a move is worth which goes over the whole range of a setpoint, or takes another way [1]."""


def moves(
    paths: Sequence[RecoveryPath], tags: Mapping[str, Tag], values: Mapping[str, float]
) -> Iterator[tuple[ActionSet, RecoveryPath, float]]:
    """Every move along ``paths`` from the present ``values``, with its path and what it costs to move at all [1]."""
    for path in paths:
        if path.awaited:
            if path.decisions:
                yield ActionSet.along(path, lambda state: design_commands(state, tags)), path, CHANGE
            continue
        space = SearchSpace(path.machine.state(path.target), tags)
        here = present_point(space.state, values)
        for point in _around(space, here):
            yield space.actions(point), path, CHANGE * space.gap(point, here)


def _around(space: SearchSpace, here: Point) -> Iterator[Point]:
    """Points that differ from ``here`` by one step of one setpoint; manual outputs stay as they are."""
    for k, (r, value) in enumerate(zip(space.ranges, here, strict=True)):
        if value is None or r.design is None or r.high <= r.low:
            continue
        for step in (sign * share * (r.high - r.low) for share in STEPS for sign in (-1.0, 1.0)):
            if r.low <= value + step <= r.high:
                yield (*here[:k], value + step, *here[k + 1 :])
