"""``homeostat plant show``: a plant's tables, with the rows that follow from what they state."""

import argparse
import csv
import io

from homeostat.cli.arguments import UsageError
from homeostat.domain.quotation import printable
from homeostat.knowledge.build.derived.tables import tables
from homeostat.knowledge.build.tables.reading import Rows
from homeostat.plants.files.places import plant_folder
from homeostat.stl.spelling import near_matches

_SOURCE = "follows_from"
"""The last column: the row that this one follows from, empty where it is stated."""


def carry_out(options: argparse.Namespace) -> int:
    """Print one table or all of them as CSV; 0."""
    found = tables(plant_folder(options.case))
    if options.table is None:
        print("\n".join(f"# {name}: {_counted(table)}\n{_written(table)}" for name, table in found.items()), end="")
        return 0
    if options.table not in found:
        hint = near_matches(options.table, found)
        raise UsageError(f"there is no table {options.table!r}{hint}; there are {', '.join(found)}")
    print(_written(found[options.table]), end="")
    return 0


def _counted(table: Rows) -> str:
    follow = sum(origin.generated for origin in table.origins)
    return f"{len(table.rows)} row{'' if len(table.rows) == 1 else 's'}, {follow} of them from other tables"


def _written(table: Rows) -> str:
    """The table as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*map(printable, table.columns), _SOURCE])
    for number, row in enumerate(table.rows):
        origin = table.origins[number] if table.origins else None
        source = f"{origin.table}.csv row {origin.line}" if origin is not None and origin.generated else ""
        writer.writerow([*map(printable, row.values()), source])
    return text.getvalue()
