"""Actuators whose manual output is named though no loop drives them: what is wrong is a row of the loops, or none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from homeostat.knowledge.build.derived.actuators import COMMAND, MANUAL
from homeostat.knowledge.build.tables.causes import unknown_name
from homeostat.knowledge.build.tables.reading import Rows
from homeostat.knowledge.store.error import Code, GraphError

_TOLD: Final = 4
"""So many rows that name a tag are told."""


def undriven(stated: Mapping[str, Rows], unknown: Sequence[tuple[str, str]]) -> Iterator[GraphError]:
    """One mistake for each actuator whose manual output is missed and that no loop drives.

    ``stated``: the tables as they stand. ``unknown``: place of a row, and what it says that there is not.
    """
    loops = [(row.get("id", ""), _commands(row.get("mv", ""))) for row in stated["loops"].rows]
    driven = {command.removesuffix(COMMAND) for _, commands in loops for command in commands}
    missed: dict[str, list[str]] = {}
    for place, message in unknown:
        name = unknown_name(message)
        if name.endswith(MANUAL):
            missed.setdefault(name.removesuffix(MANUAL), []).append(place.partition(" (")[0])
    for line, row in enumerate(stated["equipment"].rows, start=2):
        name = row.get("id", "")
        if row.get("kind") == "Actuator" and name in missed and name not in driven:
            used = f"{_listed(sorted(set(missed[name])))} name its manual output {name}{MANUAL}"
            remedy = f"or name {name}{COMMAND} there, which it has without a loop"
            if shared := _contested(loops):
                at, command, others = shared
                what = f"mv: {command} is the manipulated value of {' and '.join(others)}, and {name}{COMMAND} of none"
                thing = f"loops.csv row {at + 2} ({loops[at][0]!r})"
                yield GraphError(Code.UNKNOWN_TAG, thing, f"{what}, though {used}; correct mv, {remedy}")
            else:
                what = f"no row of loops.csv has {name}{COMMAND} as its mv, so it has no manual output, though {used}"
                thing = f"equipment.csv row {line} ({name!r})"
                yield GraphError(Code.UNKNOWN_TAG, thing, f"{what}; add its loop, {remedy}")


def _contested(loops: Sequence[tuple[str, tuple[str, ...]]]) -> tuple[int, str, tuple[str, ...]] | None:
    """Number of a loop that commands what another one does, which commands other things besides, or lacks some.

    Two that override each other command the same; of others that of more commands is the likelier to be wrong.
    """
    found = [
        (-len(commands), at, command)
        for at, (_, commands) in enumerate(loops)
        for command in commands
        if any(command in others and set(others) != set(commands) for _, others in loops)
    ]
    if not found:
        return None
    _, at, command = min(found)
    return at, command, tuple(name for name, commands in loops if command in commands)


def _commands(cell: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(cell.replace("|", " ").split()))


def _listed(places: list[str]) -> str:
    told = places[:_TOLD]
    more = [f"{len(places) - _TOLD} more"] if places[_TOLD:] else []
    *first, last = told + more
    return f"{', '.join(first)} and {last}" if first else last
