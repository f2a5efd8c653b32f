"""Rows that stand for several: states that are joined or all of them, and steps that are numbered by their order."""

from collections.abc import Iterator, Mapping
from itertools import count
from typing import Final

from homeostat.knowledge.build.derived.draft import Line, lines_of
from homeostat.knowledge.build.tables.reading import Rows

ALL = "*"
"""Stands for every state that is meant."""
JOINED: Final[Mapping[str, tuple[str, ...]]] = {
    "fallback_limits": ("strategy", "limit"),
    "fallback_waivers": ("strategy", "permissive"),
    "fallbacks": ("strategy", "tag"),
    "flows": ("operator",),
    "prices": ("item",),
    "quality": ("tag",),
    "setpoints": ("tag",),
    "start_up": ("limit",),
    "state_requirements": ("state", "component"),
    "symptom_faults": ("symptom", "fault"),
    "trips": ("limit",),
    "writables": ("tag",),
}
"""Table -> columns that may name several with ``|`` between them: one row stands for each of these, or each pair."""
ALSO = "also"
"""Where a loop keeps what it commands beside its first command."""


def expanded(stated: Mapping[str, Rows]) -> dict[str, list[Line]]:
    """The rows of every table, one for each thing that they are about, so that each has its key."""
    lines = {name: lines_of(name, table.rows) for name, table in stated.items()}
    lines["loops"] = [_loop(line) for line in lines["loops"]]
    for name, columns in JOINED.items():
        for column in columns:
            lines[name] = [each for line in lines[name] for each in _apart(line, column)]
    lines["fallbacks"] = list(_steps(lines["fallbacks"]))
    states = [line["id"] for line in lines["states"]]
    lines["setpoints"] = list(_setpoints(lines["setpoints"], states))
    left = _left_by_decision(lines)
    lines["transitions"] = [each for line in lines["transitions"] for each in _transitions(line, left)]
    return lines


def starts(line: Line) -> bool:
    """Whether a state belongs to start-up."""
    return line["start_up"] == "yes" or bool(line["start_up_s"])


def _left_by_decision(lines: Mapping[str, list[Line]]) -> list[str]:
    """What ``*`` stands for as a source: neither start-up, which ends by itself, nor where a fallback leads to."""
    safe = {line["target"] for line in lines["fallbacks"]}
    return [line["id"] for line in lines["states"] if not starts(line) and line["id"] not in safe]


def _steps(lines: list[Line]) -> Iterator[Line]:
    """Steps in the order of their rows, strategy by strategy; the target stands in the first row of its strategy."""
    order = list(dict.fromkeys(line["strategy"] for line in lines))
    numbers: dict[str, Iterator[int]] = {}
    targets: dict[str, str] = {}
    for line in sorted(lines, key=lambda line: order.index(line["strategy"])):
        step = next(numbers.setdefault(line["strategy"], count(1)))
        target = targets.setdefault(line["strategy"], line["target"])
        step_and_target = {"step": line["step"] or str(step), "target": line["target"] or target}
        yield Line(line.origin, line.cells | step_and_target)


def _apart(line: Line, column: str) -> Iterator[Line]:
    """One row for each name in a cell."""
    if "|" not in line[column]:
        yield line
        return
    for name in line[column].split("|"):
        yield Line(line.origin, line.cells | {column: name.strip()})


def _loop(line: Line) -> Line:
    """A loop with its first command, and what else its controller commands under a name that no table has."""
    first, *others = _named(line["mv"], [])
    return Line(line.origin, line.cells | {"mv": first, ALSO: " ".join(others)})


def _setpoints(lines: list[Line], states: list[str]) -> Iterator[Line]:
    """One row for each state; a row for one state counts before one for some, and that before one for all."""
    taken: set[tuple[str, str]] = set()
    for line in sorted(lines, key=lambda line: _breadth(line["state"])):
        names = _named(line["state"], states)
        for name in names:
            if len(names) == 1 or (name, line["tag"]) not in taken:
                yield Line(line.origin, line.cells | {"state": name})
            taken.add((name, line["tag"]))


def _breadth(cell: str) -> int:
    return 2 if cell == ALL else int(len(_named(cell, [])) > 1)


def _transitions(line: Line, left: list[str]) -> Iterator[Line]:
    """One row for each source."""
    target, cell = line["target"], line["source"]
    sources = _named(cell, [name for name in left if name != target])
    for source in sources:
        own = line["id"] if len(sources) == 1 and cell != ALL else ""
        name = own or (f"{line['id']}_{source}" if line["id"] else f"t_{source}_{target}")
        yield Line(line.origin, line.cells | {"id": name, "source": source})


def _named(cell: str, everything: list[str]) -> list[str]:
    """The names in a cell: one, several with blanks or ``|`` between them, or ``*`` for ``everything``."""
    if cell == ALL:
        return everything or [ALL]
    return list(dict.fromkeys(cell.replace("|", " ").split())) or [""]
