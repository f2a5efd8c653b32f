"""Checking a plant's tables before anything is made of them: a bad cell is one line with its place and the remedy."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final, TypeAlias

from pydantic import ValidationError

from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.build.derived.actuators import COMMAND
from homeostat.knowledge.build.derived.tables import derived, idle_omissions, stated_tables
from homeostat.knowledge.build.tables.causes import first_causes, unknown_name
from homeostat.knowledge.build.tables.cells import CellError, Reads, Refers, TableRow, shown
from homeostat.knowledge.build.tables.reading import FOLDER, OPTIONAL, OPTIONAL_COLUMNS, Rows, is_short
from homeostat.knowledge.build.tables.schemas import EVERY, SCHEMAS, SHORT_SCHEMAS
from homeostat.knowledge.build.tables.undriven import undriven
from homeostat.knowledge.build.timing import timing_of
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
_NUMBERED: Final = frozenset({("transitions", "id"), ("fallbacks", "step")})
"""Keys that follow from the rest of their rows and from the order of rows."""

Unknown: TypeAlias = tuple[str, int, str, Code, str]
"""Table, number of the row from 0, column, mistake, message."""


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
    places = [place for kind in kinds for place, _ in _STATED[kind][1]]
    if table.origins and {"signals", "equipment"} & set(places):  # those of a short plant
        places.append("instruments")
    where = " or ".join(dict.fromkeys(f"{place}.csv" for place in places))
    for number, row in enumerate(table.rows):
        for used in sorted(_used(row[column], mark) - names):
            hint = near_matches(used[:_LONGEST], sorted(names))
            message = f"there is no {what} {shown(used)} in {where}{hint}; correct it or add its row"
            yield name, number, column, code, message


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


def refuse_bad_tables(folder: Path) -> None:
    """GraphError with the first mistake in the tables of the plant in ``folder``, and the number of the others."""
    refuse(list(mistakes(folder)))


def mistakes(folder: Path) -> Iterator[GraphError]:
    """Every mistake in the tables of the plant in ``folder``, which must be all that there are; see `first_causes`."""
    yield from first_causes([*_mistakes(folder)])


def _mistakes(folder: Path) -> Iterator[GraphError]:
    tables, unread = stated_tables(folder)
    yield from unread
    short, timing, whole = is_short(folder), timing_of(folder), tables
    for path in sorted((folder / FOLDER).glob("*.csv")):
        if path.stem not in (EVERY if short else SCHEMAS):
            read = "the mapping does not read it"
            if path.stem in SHORT_SCHEMAS:
                read = "it is read only beside an instruments.csv; add that or remove it"
            yield GraphError(Code.BAD_MAPPING, path.name, f"is no table of a plant; {read}")
    if short:
        bad = [error for name, table in tables.items() for error in _of_short(name, table, timing)]
        yield from bad
        if bad or unread:
            return
        yield from _idle(tables, timing)
        whole = derived(tables, timing)
    unknown = [
        GraphError(code, _place(name, number, whole[name]), f"{whole[name].told(column)}: {message}")
        for name, number, column, code, message in unknown_names(whole, {name: EVERY[name][0] for name in whole})
    ]
    misspelt = any("loops.csv row" in e.thing and unknown_name(e.message).endswith(COMMAND) for e in unknown)
    if short and not misspelt:
        yield from undriven(tables, [(error.thing, error.message) for error in unknown])
    for name, table in whole.items():
        yield from _columns(name, table) or _cells(name, table, timing)
    yield from unknown


def _idle(tables: Mapping[str, Rows], timing: Timing) -> Iterator[GraphError]:
    """Omitted rows that name no table, or no row that follows."""
    omitted, idle = tables["omitted"], idle_omissions(tables, timing)
    if not idle:
        return
    every = derived({**tables, "omitted": Rows((), ())}, timing)
    for number in idle:
        row, place = omitted.rows[number], _place("omitted", number, omitted)
        if row["table"] not in SCHEMAS:
            hint = near_matches(row["table"], SCHEMAS)
            yield GraphError(Code.BAD_TABLE, place, f"table: there is no table {shown(row['table'])}{hint}; correct it")
            continue
        table, key = every[row["table"]], EVERY[row["table"]][1]
        rows = zip(table.rows, table.origins, strict=True)
        names = [" ".join(each[column] for column in key) for each, origin in rows if origin.generated]
        hint = near_matches(row["row"][:_LONGEST], names)
        message = (
            f"row: nothing that follows in {row['table']} is called {shown(row['row'])}{hint}; correct or remove it"
        )
        yield GraphError(Code.BAD_TABLE, place, message)


def _of_short(name: str, table: Rows, timing: Timing) -> list[GraphError]:
    """What is wrong with a stated table before anything follows from it.

    Columns may be left out where they can be filled; those of the short tables must be right, because more follows.
    """
    if not table.columns:
        return []
    fields = EVERY[name][0].model_fields
    short = name in SHORT_SCHEMAS
    needed = [c for c, field in fields.items() if field.is_required()] if short else EVERY[name][1]
    lacking = _lacking_columns(name, table, [column for column in needed if (name, column) not in _NUMBERED])
    found = [*_unknown_columns(name, table), *lacking]
    return found or (list(_cells(name, table, timing)) if short else [])


def _columns(name: str, table: Rows) -> list[GraphError]:
    """Columns that are missing, or that the table does not have."""
    if name in OPTIONAL and not table.columns:
        return []
    return [*_unknown_columns(name, table), *_lacking_columns(name, table, EVERY[name][0].model_fields)]


def _unknown_columns(name: str, table: Rows) -> Iterator[GraphError]:
    known = EVERY[name][0].model_fields
    for column in table.columns:
        if column not in known:
            message = f"column {shown(column)} is not known{near_matches(column, known)}; there are {', '.join(known)}"
            yield GraphError(Code.BAD_TABLE, f"{name}.csv row 1", message)


def _lacking_columns(name: str, table: Rows, needed: Iterable[str]) -> Iterator[GraphError]:
    for column in needed:
        if column not in table.columns and column not in OPTIONAL_COLUMNS.get(name, ()):
            hint = near_matches(column, table.columns)
            message = f"column {column!r} is missing{hint}; add it, with an empty cell where nothing is stated"
            yield GraphError(Code.BAD_TABLE, f"{name}.csv row 1", message)


def _cells(name: str, table: Rows, timing: Timing) -> Iterator[GraphError]:
    """Cells that are no value of their column, and rows that contradict themselves or another one."""
    model, key = EVERY[name]
    seen: dict[tuple[str, ...], int] = {}
    for number, row in enumerate(table.rows):
        try:
            model.model_validate({column: cell for column, cell in row.items() if cell}, context=timing)
        except ValidationError as error:
            yield from _bad_row(error, name, number, table)
        names = tuple(row[column] for column in key)
        if names in seen:
            verb = "are those" if key[1:] else "is that"
            other = table.place(name, seen[names]).removeprefix(f"{name}.csv ")
            message = f"{' and '.join(key)} {verb} of {other}; remove or rename one of them"
            yield GraphError(Code.DUPLICATE_ID, _place(name, number, table), message)
        seen.setdefault(names, number)


def _bad_row(error: ValidationError, name: str, number: int, table: Rows) -> Iterator[GraphError]:
    place = _place(name, number, table)
    for found in error.errors(include_url=False):
        column = f"{table.told(str(found['loc'][0]))}: " if found["loc"] else ""
        cause = found.get("ctx", {}).get("error")
        if isinstance(cause, CellError):
            yield GraphError(cause.code, place, f"{column}{cause}")
        else:
            yield GraphError(Code.MISSING_VALUE, place, f"{column}the cell is empty; fill it")


def _place(name: str, number: int, table: Rows) -> str:
    """Where a row is, with what it is about."""
    about = " ".join(table.rows[number].get(column, "") for column in EVERY[name][1])
    return f"{table.place(name, number)} ({shown(about)})"
