"""A copy of a plant's tables that a test may break: nothing here knows a value of a table."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pyoxigraph import NamedNode, RdfFormat

from homeostat.knowledge.build.build import build, mapped
from homeostat.knowledge.store.embedded import EmbeddedStore
from tests.knowledge.whole import whole

Rows = list[dict[str, str]]

INSTALLED = Path(__file__).resolve().parents[2] / "src" / "homeostat" / "plants"
CSTR = INSTALLED / "cstr"
SYSTEM = NamedNode("urn:homeostat:cstr#system")
TABLES = tuple(sorted(path.stem for path in (whole("cstr") / "engineering").glob("*.csv")))


@dataclass(frozen=True)
class Workbench:
    """A writable copy of the reactor's tables, every row stated, with its settings."""

    folder: Path

    @classmethod
    def at(cls, folder: Path) -> Workbench:
        (folder / "engineering").mkdir(parents=True)
        shutil.copy(CSTR / "case.toml", folder)
        for table in (whole("cstr") / "engineering").glob("*.csv"):
            shutil.copy(table, folder / "engineering")
        return cls(folder)

    def path(self, table: str) -> Path:
        return self.folder / "engineering" / f"{table}.csv"

    def rows(self, table: str) -> Rows:
        with self.path(table).open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def write(self, table: str, rows: Rows) -> None:
        with self.path(table).open(encoding="utf-8", newline="") as file:
            header = next(csv.reader(file))
        with self.path(table).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, header, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def edit(self, table: str, change: Callable[[Rows], Rows]) -> None:
        self.write(table, change(self.rows(table)))

    def call(self, system: str) -> None:
        """Another IRI of the plant's system."""
        path = self.folder / "case.toml"
        path.write_text(re.sub('(?m)^system = ".*"', f'system = "{system}"', path.read_text("utf-8")), encoding="utf-8")

    def graph(self) -> bytes:
        """What the build makes of the tables, bad cells included."""
        return mapped(self.folder)


def store_of(graph: bytes) -> EmbeddedStore:
    store = EmbeddedStore()
    store.load(graph, RdfFormat.TURTLE)
    return store


@cache
def reactor() -> bytes:
    """The reactor's graph as its tables make it now; that the committed one is the same is a test of its own."""
    return build(CSTR)
