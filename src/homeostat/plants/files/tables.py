"""Rows that are added to the tables of a plant's folder; what is there stays as it is written."""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeAlias

from pyoxigraph import NamedNode

from homeostat.knowledge.build.build import GRAPH, build, refuse_incomplete
from homeostat.knowledge.build.tables.reading import FOLDER, read_rows
from homeostat.knowledge.description.plant import read_plant
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.files.graph import open_graph, refuse_other_model
from homeostat.plants.settings.adopted import with_effects
from homeostat.plants.settings.file import read_settings

if TYPE_CHECKING:
    from homeostat.plants.plant import Plant

Rows: TypeAlias = Sequence[Mapping[str, str]]
"""Rows of a table, each column -> cell."""


def table_file(name: str) -> str:
    """Where the table called ``name`` is in a plant's folder."""
    return f"{FOLDER}/{name}.csv"


def extended(plant: Plant, added: Mapping[str, Rows]) -> Mapping[str, bytes]:
    """Files of the folder of ``plant`` with ``added`` rows, table -> rows: name -> content of tables and graph.

    Nothing is written there. GraphError where the rows do not fit the plant.
    """
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / plant.files.folder.name
        shutil.copytree(plant.files.folder / FOLDER, folder / FOLDER)
        shutil.copyfile(plant.files.folder / SETTINGS, folder / SETTINGS)
        made = {table_file(name): with_rows(folder / table_file(name), rows) for name, rows in added.items()}
        for name, content in made.items():
            (folder / name).write_bytes(content)
        graph = build(folder)
    refuse_incomplete(graph)
    described = read_plant(open_graph(graph), NamedNode(read_settings(plant.files).system))
    refuse_other_model(described, plant.model, plant.twin.horizon_s)
    with_effects(described.faults, plant.description.generated)
    return {**made, GRAPH: graph}


def with_rows(path: Path, rows: Rows) -> bytes:
    """The table in ``path`` with ``rows`` at its end; a column that it lacks is added to its own.

    Where there is no such file it is a new one: a plant with a table of instruments need not have all tables.
    GraphError where it cannot be read.
    """
    if not path.exists():
        new = tuple(dict.fromkeys(column for row in rows for column in row))
        return as_lines([new, *([row.get(column, "") for column in new] for row in rows)]).encode("utf-8")
    columns = read_rows(path).columns
    content = path.read_bytes()
    newline = "\r\n" if b"\r\n" in content else "\n"
    text = content.decode("utf-8").replace("\r\n", "\n")
    more = [name for name in dict.fromkeys(column for row in rows for column in row) if name not in columns]
    if more:
        head, *body = csv.reader(io.StringIO(text))
        text = as_lines([[*head, *more], *([*cells, *("" for _ in more)] for cells in body)])
    added = as_lines([[row.get(column, "") for column in (*columns, *more)] for row in rows])
    whole = f"{text if text.endswith(chr(10)) else text + chr(10)}{added}"
    return whole.replace("\n", newline).encode("utf-8")


def as_lines(rows: Sequence[Sequence[str]]) -> str:
    """Cells as lines of a table, each with its end; what needs quotes has them."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()
