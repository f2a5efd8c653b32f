"""Every row of a plant's tables in files of their own: for whoever reads files, such as an RML processor."""

import csv
from pathlib import Path

from homeostat.knowledge.build.derived.tables import tables
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.knowledge.build.tables.schemas import SCHEMAS


def write_whole(folder: Path, target: Path) -> None:
    """Write the tables of the plant in ``folder``, with every row that follows, below ``target``.

    The tables from which rows follow are not among them, so nothing follows there any more. Raises GraphError where a
    table cannot be read, OSError where one cannot be written.
    """
    place = target / FOLDER
    place.mkdir(parents=True, exist_ok=True)
    for name, table in tables(folder).items():
        if name in SCHEMAS:
            columns = table.columns or tuple(SCHEMAS[name][0].model_fields)
            with (place / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, columns, lineterminator="\n")
                writer.writeheader()
                writer.writerows(table.rows)
