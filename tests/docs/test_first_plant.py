"""The guide to a first plant has every file of the example, word for word, and the example is as short as it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.plants.plant import load_plant
from tests.docs.blocks import REPO, blocks
from tests.evaluate.two_tanks import tanks

GUIDE = (REPO / "docs" / "tutorials" / "your-first-plant.md").read_text("utf-8")
EXAMPLE = REPO / "examples" / "two_tanks"
GENERATED = {"plant.ttl", "baseline.csv"}
FILES = sorted(path for path in EXAMPLE.rglob("*") if path.is_file() and path.suffix in (".py", ".csv", ".toml"))
WRITTEN = [path for path in FILES if path.name not in GENERATED]
MOST_LINES = 260
MOST_LINES_OF_MODEL = 25


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_the_guide_shows_the_file_as_it_is(path: Path) -> None:
    assert path.read_text("utf-8") in {block.body for block in blocks(GUIDE)}
    assert f"`{path.relative_to(EXAMPLE).as_posix()}`:" in GUIDE


def test_the_table_of_totals_is_one_that_the_plant_takes(tmp_path: Path) -> None:
    (shown,) = (block.body for block in blocks(GUIDE) if "totals = " in block.body)
    folder = tanks(tmp_path)
    settings = (folder / "case.toml").read_text("utf-8")
    stated, separator, rest = settings.partition("[objective]\n")
    (folder / "case.toml").write_text(f"{stated}{shown}\n{rest[rest.index('[twin]') :]}", "utf-8")
    assert separator and load_plant(str(folder), learned=False, kept=False).totals == {"product_L": "product"}


def test_the_plant_is_short() -> None:
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in WRITTEN}
    assert sum(lines.values()) <= MOST_LINES
    assert lines[EXAMPLE / "process.py"] <= MOST_LINES_OF_MODEL
