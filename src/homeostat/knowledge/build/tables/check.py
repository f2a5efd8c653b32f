"""Checking a plant's tables before anything is made of them: a bad cell is one line with its place and the remedy."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, TypeAlias

from pydantic import ValidationError

from homeostat.knowledge.build.tables import behaviour, diagnosis, guarding, structure
from homeostat.knowledge.build.tables.cells import CellError, Reads, Refers, TableRow, shown
from homeostat.knowledge.build.tables.reading import OPTIONAL, OPTIONAL_COLUMNS, Rows, read_rows
from homeostat.knowledge.store.error import Code, GraphError, refuse
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


def unknown_names(tables: Mapping[str, Rows], models: Mapping[str, type[TableRow]]) -> Iterator[Unknown]:
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


FOLDER: Final = "engineering"
"""Where the tables are in a plant's folder."""
SCHEMAS: Final[Mapping[str, tuple[type[TableRow], tuple[str, ...]]]] = {
    "equipment": (structure.Equipment, ("id",)),
    "signals": (structure.Signal, ("tag",)),
    "sensors": (structure.Sensor, ("component",)),
    "loops": (structure.Loop, ("id",)),
    "parameters": (structure.ModelParameter, ("symbol",)),
    "operators": (structure.ProcessOperator, ("id",)),
    "flows": (structure.Flow, ("operator", "direction", "flow")),
    "equations": (structure.OperatorEquation, ("id",)),
    "states": (behaviour.OperatingState, ("id",)),
    "state_requirements": (behaviour.StateRequirement, ("state", "component")),
    "setpoints": (behaviour.Setpoint, ("state", "tag")),
    "transitions": (behaviour.Transition, ("id",)),
    "limits": (behaviour.Limit, ("id",)),
    "criteria": (behaviour.Criterion, ("id",)),
    "prices": (behaviour.Price, ("kind", "item")),
    "fallbacks": (behaviour.FallbackStep, ("strategy", "step")),
    "fallback_waivers": (behaviour.Waiver, ("strategy", "permissive")),
    "fallback_limits": (behaviour.FallbackLimit, ("strategy", "limit")),
    "quality": (guarding.Quality, ("tag",)),
    "trips": (guarding.Trip, ("limit",)),
    "start_up": (guarding.StartUpLimit, ("limit",)),
    "writables": (guarding.Writable, ("tag",)),
    "faults": (diagnosis.Fault, ("id",)),
    "features": (diagnosis.Feature, ("id",)),
    "symptoms": (diagnosis.Symptom, ("id",)),
    "symptom_faults": (diagnosis.SymptomFault, ("symptom", "fault")),
}
"""Table -> what its rows are, and the columns that tell one from another."""


def refuse_bad_tables(folder: Path) -> None:
    """GraphError with the first mistake in the tables of the plant in ``folder``, and the number of the others."""
    refuse(list(mistakes(folder)))


def mistakes(folder: Path) -> Iterator[GraphError]:
    """Every mistake in the tables of the plant in ``folder``, which must be all that there are."""
    tables: dict[str, Rows] = {}
    for name in SCHEMAS:
        try:
            tables[name] = read_rows(folder / FOLDER / f"{name}.csv")
        except GraphError as error:
            yield error
    for path in sorted((folder / FOLDER).glob("*.csv")):
        if path.stem not in SCHEMAS:
            yield GraphError(Code.BAD_MAPPING, path.name, "is no table of a plant; the mapping does not read it")
    for name, table in tables.items():
        yield from _columns(name, table) or _cells(name, table)
    for name, line, column, code, message in unknown_names(tables, {name: SCHEMAS[name][0] for name in tables}):
        yield GraphError(code, _place(name, line, tables[name]), f"{tables[name].told(column)}: {message}")


def _columns(name: str, table: Rows) -> list[GraphError]:
    """Columns that are missing, or that the table does not have."""
    known = SCHEMAS[name][0].model_fields
    found: list[GraphError] = []
    if name in OPTIONAL and not table.columns:
        return found
    for column in table.columns:
        if column not in known:
            message = f"column {shown(column)} is not known{near_matches(column, known)}; there are {', '.join(known)}"
            found.append(GraphError(Code.BAD_TABLE, f"{name}.csv row 1", message))
    for column in known:
        if column not in table.columns and column not in OPTIONAL_COLUMNS.get(name, ()):
            hint = near_matches(column, table.columns)
            message = f"column {column!r} is missing{hint}; add it, with an empty cell where nothing is stated"
            found.append(GraphError(Code.BAD_TABLE, f"{name}.csv row 1", message))
    return found


def _cells(name: str, table: Rows) -> Iterator[GraphError]:
    """Cells that are no value of their column, and rows that contradict themselves or another one."""
    model, key = SCHEMAS[name]
    seen: dict[tuple[str, ...], int] = {}
    for line, row in enumerate(table.rows, start=2):
        try:
            model.model_validate({column: cell for column, cell in row.items() if cell})
        except ValidationError as error:
            yield from _bad_row(error, name, line, table)
        names = tuple(row[column] for column in key)
        if names in seen:
            verb = "are those" if key[1:] else "is that"
            message = f"{' and '.join(key)} {verb} of row {seen[names]}; remove or rename one of them"
            yield GraphError(Code.DUPLICATE_ID, _place(name, line, table), message)
        seen.setdefault(names, line)


def _bad_row(error: ValidationError, name: str, line: int, table: Rows) -> Iterator[GraphError]:
    place = _place(name, line, table)
    for found in error.errors(include_url=False):
        column = f"{table.told(str(found['loc'][0]))}: " if found["loc"] else ""
        cause = found.get("ctx", {}).get("error")
        if isinstance(cause, CellError):
            yield GraphError(cause.code, place, f"{column}{cause}")
        else:
            yield GraphError(Code.MISSING_VALUE, place, f"{column}the cell is empty; fill it")


def _place(name: str, line: int, table: Rows) -> str:
    """Where a row is, with what it is about."""
    row = table.rows[line - 2]
    about = " ".join(row.get(column, "") for column in SCHEMAS[name][1])
    return f"{name}.csv row {line} ({shown(about)})"
