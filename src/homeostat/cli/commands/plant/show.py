"""``homeostat plant show``: a plant's tables, with the rows that follow from what they state, its times and states."""

import argparse
import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from homeostat.cli.arguments import UsageError
from homeostat.domain.quotation import printable
from homeostat.knowledge.build.derived.tables import tables
from homeostat.knowledge.build.tables.reading import Rows
from homeostat.knowledge.build.timing import timing_of
from homeostat.plants.described import read_stated
from homeostat.plants.files.folder import read_files
from homeostat.plants.files.places import plant_folder
from homeostat.plants.model import find_model
from homeostat.plants.settings.check import balanced
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.times import times
from homeostat.process.blocks.composed import ComposedModel
from homeostat.stl.spelling import near_matches

TIMES = "times"
"""Name of the table of the times in the settings."""
MODEL = "model"
"""Name of the table of the states of the process model; to make it, the plant's code runs."""
_SOURCE = "follows_from"
"""The last column: the row that this one follows from, empty where it is stated."""


def carry_out(options: argparse.Namespace) -> int:
    """Print one table or all of them as CSV; 0."""
    folder = plant_folder(options.case)
    if options.table == TIMES:
        print(_times(folder), end="")
        return 0
    if options.table == MODEL:
        print(_model(options.case), end="")
        return 0
    found = tables(folder)
    if options.table is None:
        print("\n".join(f"# {name}: {_counted(table)}\n{_written(table)}" for name, table in found.items()), end="")
        return 0
    if options.table not in found:
        known = (*found, TIMES, MODEL)
        hint = near_matches(options.table, known)
        raise UsageError(f"there is no table {options.table!r}{hint}; there are {', '.join(known)}")
    print(_written(found[options.table]), end="")
    return 0


def _times(folder: Path) -> str:
    """The times of the settings of the plant in ``folder`` as CSV."""
    timing = timing_of(folder)
    follows = f"a response of {timing.response_s:g} s in ticks of {timing.tick_s:g} s"
    shown = times(read_settings(read_files(folder)), timing)
    rows = [(t.table, t.key, f"{t.seconds:.10g}", "" if t.stated else follows) for t in shown]
    return _csv(("table", "key", "seconds", _SOURCE), rows)


def _model(name: str) -> str:
    """The states that are integrated as CSV: where each begins, and what the settings say of it."""
    plant = read_stated(name, kept=False)
    model, stated = find_model(plant.files, plant.settings.model, plant.description), plant.settings.twin.initial
    values = {p.symbol: p.value for p in plant.description.parameters}
    begins = model.initial_state(np.array([values[symbol] for symbol in model.parameters]))
    units = {s.name: s.unit for s in model.flowsheet.states.values()} if isinstance(model, ComposedModel) else {}
    rows = []
    for state in balanced(model):
        own = f"{stated[state]:.10g}" if state in stated else ""
        rows.append((state, f"{begins[model.states.index(state)]:.6g}", units.get(state, ""), own))
    return _csv(("state", "begins", "unit", "initial"), rows)


def _counted(table: Rows) -> str:
    follow = sum(origin.generated for origin in table.origins)
    return f"{len(table.rows)} row{'' if len(table.rows) == 1 else 's'}, {follow} of them from other tables"


def _written(table: Rows) -> str:
    """The table as CSV."""
    rows = []
    for number, row in enumerate(table.rows):
        origin = table.origins[number] if table.origins else None
        source = f"{origin.table}.csv row {origin.line}" if origin is not None and origin.generated else ""
        rows.append((*map(printable, row.values()), source))
    return _csv((*map(printable, table.columns), _SOURCE), rows)


def _csv(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
