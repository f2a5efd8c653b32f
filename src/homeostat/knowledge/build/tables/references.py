"""Names in one table that another one must state."""

from collections.abc import Iterator, Mapping
from typing import Final, TypeAlias

from homeostat.knowledge.build.tables.cells import CellError, Reads, Refers, Row, shown
from homeostat.knowledge.build.tables.reading import Rows
from homeostat.knowledge.store.error import Code
from homeostat.stl.spelling import near_matches

_PARAMETERS: Final = (("parameters", "symbol"), ("sensors", "parameter_bias"), ("sensors", "parameter_noise"))
_STATED: Final[Mapping[str, tuple[Code, tuple[tuple[str, str], ...]]]] = {
    "component": (Code.UNKNOWN_COMPONENT, (("equipment", "id"),)),
    "tag": (Code.UNKNOWN_TAG, (("signals", "tag"),)),
    "operator": (Code.UNKNOWN_OPERATOR, (("operators", "id"),)),
    "parameter": (Code.UNKNOWN_PARAMETER, _PARAMETERS),
    "state": (Code.UNKNOWN_STATE, (("states", "id"),)),
    "limit": (Code.UNKNOWN_LIMIT, (("limits", "id"),)),
    "strategy": (Code.UNKNOWN_FALLBACK, (("fallbacks", "strategy"),)),
    "feature": (Code.UNKNOWN_FEATURE, (("features", "id"),)),
    "symptom": (Code.UNKNOWN_SYMPTOM, (("symptoms", "id"),)),
    "fault": (Code.UNKNOWN_FAULT, (("faults", "id"),)),
}
"""What a name can be of -> the mistake where nothing is called so, and tables and columns that state it."""
_LONGEST: Final = 120

Unknown: TypeAlias = tuple[str, int, str, Code, str]
"""Table, line in the file, column, mistake, message."""


def unknown_names(tables: Mapping[str, Rows], models: Mapping[str, type[Row]]) -> Iterator[Unknown]:
    """Every cell that names what no row states; ``tables`` and ``models`` are by the table's name.

    What a table states that is missing or cannot be read is not known, so nobody is blamed for naming it.
    """
    known = {
        kind: frozenset(row.get(column, "") for name, column in places for row in tables[name].rows) - {""}
        for kind, (_, places) in _STATED.items()
        if all(name in tables and column in tables[name].columns for name, column in places)
    }
    for name, model in models.items():
        for column, field in model.model_fields.items():
            for mark in field.metadata:
                if isinstance(mark, Refers | Reads) and column in tables[name].columns and _kinds(mark) <= known.keys():
                    yield from _unknown_in(name, column, tables[name], mark, known)


def _unknown_in(
    name: str, column: str, table: Rows, mark: Refers | Reads, known: Mapping[str, frozenset[str]]
) -> Iterator[Unknown]:
    kinds = sorted(_kinds(mark), reverse=True)
    code = _STATED[mark.kind][0] if isinstance(mark, Refers) else mark.code
    names = frozenset().union(*(known[kind] for kind in kinds))
    what = " or ".join(kinds)
    where = " or ".join(dict.fromkeys(f"{place}.csv" for kind in kinds for place, _ in _STATED[kind][1]))
    for line, row in enumerate(table.rows, start=2):
        for used in sorted(_used(row[column], mark) - names):
            hint = near_matches(used[:_LONGEST], sorted(names))
            message = f"there is no {what} {shown(used)} in {where}{hint}; correct it or add its row"
            yield name, line, column, code, message


def _kinds(mark: Refers | Reads) -> frozenset[str]:
    return frozenset({mark.kind}) if isinstance(mark, Refers) else mark.kinds


def _used(cell: str, mark: Refers | Reads) -> frozenset[str]:
    if not cell:
        return frozenset()
    if isinstance(mark, Refers):
        return frozenset({cell})
    try:
        return mark.read(cell)
    except CellError:  # said where the cell was read
        return frozenset()
