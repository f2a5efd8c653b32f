"""A copy of an installed plant's folder that a test may change."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from homeostat.knowledge.build.build import GRAPH, build
from homeostat.knowledge.build.provenance import seal
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.knowledge.build.whole import write_whole
from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.plant import Plant, load_plant


@dataclass(frozen=True)
class Copy:
    """A writable plant folder."""

    folder: Path

    @classmethod
    def of(cls, name: str, where: Path) -> Copy:
        shutil.copytree(INSTALLED / name, where / name, ignore=shutil.ignore_patterns("__pycache__"))
        return cls(where / name)

    @classmethod
    def whole(cls, name: str, where: Path) -> Copy:
        """With every row stated, those that follow from others as well; its graph is that of the shipped one."""
        made = cls.of(name, where)
        shutil.rmtree(made.folder / FOLDER)
        write_whole(INSTALLED / name, made.folder)
        (made.folder / GRAPH).write_bytes(build(made.folder))
        return made

    def load(self) -> Plant:
        return load_plant(str(self.folder))

    def text(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")

    def replace(self, name: str, old: str, new: str) -> None:
        text = self.text(name)
        assert old in text, f"{name} has no {old!r}"
        (self.folder / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    def reseal(self, name: str) -> None:
        """As somebody who knows how the hash is made."""
        body = self.text(name).rpartition("# sha256")[0]
        (self.folder / name).write_bytes(seal(body.encode()))
