"""The guide to a first plant has every file of the example, word for word, and the example is as short as it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.blocks import REPO, blocks

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


def test_the_plant_is_short() -> None:
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in WRITTEN}
    assert sum(lines.values()) <= MOST_LINES
    assert lines[EXAMPLE / "process.py"] <= MOST_LINES_OF_MODEL
