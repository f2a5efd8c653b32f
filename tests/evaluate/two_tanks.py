"""Copies of the two tanks of the guide, with something changed in a file."""

from __future__ import annotations

import shutil
from pathlib import Path

TANKS = Path(__file__).parents[2] / "examples" / "two_tanks"


def tanks(folder: Path) -> Path:
    return Path(shutil.copytree(TANKS, folder / "two_tanks", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))


def change(folder: Path, file: str, before: str, after: str) -> None:
    text = (folder / file).read_text("utf-8")
    assert before in text
    (folder / file).write_text(text.replace(before, after, 1), "utf-8")
