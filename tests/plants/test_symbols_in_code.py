"""Arithmetic that Python takes for that of texts says how a symbol is written; other mistakes only where they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.plants.error import PlantError
from homeostat.plants.files.code import import_own
from homeostat.plants.files.folder import read_files
from homeostat.plants.scaffold import make_plant


@pytest.mark.parametrize(
    "written", ['2.0 * "cp"', '"cp" * "T_feed"', '"cp" / 2.0', '1.0 + "cp"', '"cp" + 1.0', '-"cp"']
)
def test_a_symbol_without_a_term_is_told_how_to_be_one(tmp_path: Path, written: str) -> None:
    with pytest.raises(PlantError, match=r"process\.py, line 1: TypeError.*; write term\("):
        _imported(tmp_path / "plant", written)


def test_another_mistake_is_to_be_mended(tmp_path: Path) -> None:
    with pytest.raises(PlantError, match=r"ZeroDivisionError.*; mend it"):
        _imported(tmp_path / "plant", "1 / 0")


def _imported(folder: Path, written: str) -> None:
    make_plant(folder, "tanks")
    (folder / "process.py").write_text(f"{written}\n", "utf-8")
    import_own(read_files(folder), "process")
