"""A plant of two heated tanks that states each thing once, which a test may change."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.knowledge.build.build import build, refuse_incomplete
from homeostat.knowledge.build.derived.tables import tables
from homeostat.knowledge.build.tables.check import mistakes
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import GraphError
from tests.knowledge.tables import store_of

TWO_TANKS = Path(__file__).with_name("two_tanks")
SYSTEM = NamedNode("urn:homeostat:two_tanks#system")


@dataclass(frozen=True)
class Short:
    """A writable copy of the plant's folder."""

    folder: Path

    @classmethod
    def at(cls, folder: Path) -> Short:
        shutil.copytree(TWO_TANKS, folder)
        return cls(folder)

    def path(self, table: str) -> Path:
        return self.folder / "engineering" / f"{table}.csv"

    def write(self, table: str, *lines: str) -> None:
        self.path(table).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def add(self, table: str, line: str) -> None:
        self.write(table, *self.path(table).read_text("utf-8").splitlines(), line)

    def edit(self, table: str, old: str, new: str) -> None:
        text = self.path(table).read_text("utf-8")
        assert old in text, f"{table}.csv has no {old!r}"
        self.path(table).write_text(text.replace(old, new, 1), encoding="utf-8")

    def row(self, table: str, **key: str) -> Mapping[str, str]:
        """The only row of a table with these cells, those that follow from others included."""
        (found,) = [row for row in tables(self.folder)[table].rows if all(row[c] == cell for c, cell in key.items())]
        return found

    def mistakes(self) -> list[GraphError]:
        return list(mistakes(self.folder))

    def plant(self) -> PlantDescription:
        graph = build(self.folder)
        refuse_incomplete(graph)
        return read_plant(store_of(graph), SYSTEM)


def rows_of(folder: Path, table: str) -> list[dict[str, str]]:
    """The rows that stand in a file."""
    with (folder / "engineering" / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
