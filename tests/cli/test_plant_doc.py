"""``homeostat plant doc``: one page, written once, and where it went."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.plants.files.folder import INSTALLED
from tests.cli.command import homeostat, refused


@pytest.mark.parametrize("case", ["cstr", "mixing_module"])
def test_the_page_is_called_after_the_plant(tmp_path: Path, case: str) -> None:
    done = homeostat("plant", "doc", case, cwd=tmp_path)
    assert (
        (done.status, done.err) == (0, "")
        and done.out.startswith(f"{tmp_path / case}.html: ")
        and done.out.count("\n") == 1
    )
    assert (tmp_path / f"{case}.html").read_text("utf-8").startswith("<!DOCTYPE html>\n<html")
    assert [path.name for path in tmp_path.iterdir()] == [f"{case}.html"]


def test_a_folder_is_described_and_a_page_is_not_replaced_without_being_told_so(tmp_path: Path) -> None:
    shutil.copytree(INSTALLED / "cstr", tmp_path / "mine", ignore=shutil.ignore_patterns("__pycache__"))
    page = tmp_path / "page.html"
    page.write_text("kept")
    refused(homeostat("plant", "doc", "./mine", "--out", "page.html", cwd=tmp_path), "'page.html'", "--force")
    assert page.read_text() == "kept"
    done = homeostat("plant", "doc", "./mine", "--out", "page.html", "--force", cwd=tmp_path)
    assert done.status == 0 and "mine: Continuous" in page.read_text("utf-8")


def test_what_cannot_be_read_or_written_is_one_line(tmp_path: Path) -> None:
    refused(homeostat("plant", "doc", "./nowhere", cwd=tmp_path), "there is no folder")
    refused(homeostat("plant", "doc", "reactor", cwd=tmp_path), "unknown plant 'reactor'")
    refused(homeostat("plant", "doc", "cstr", "--out", "no/page.html", cwd=tmp_path), "'no/page.html' cannot be used")
    refused(homeostat("plant", "doc", "cstr", "--out", ".", "--force", cwd=tmp_path), "'.' is a folder")
    assert list(tmp_path.iterdir()) == []


def test_a_plant_whose_tables_are_wrong_has_no_page(tmp_path: Path) -> None:
    shutil.copytree(INSTALLED / "cstr", tmp_path / "mine", ignore=shutil.ignore_patterns("__pycache__"))
    table = tmp_path / "mine" / "engineering" / "instruments.csv"
    table.write_text(table.read_text("utf-8").replace("T1,K,270,380", "T1,K,many,380"), "utf-8")
    refused(homeostat("plant", "doc", "./mine", cwd=tmp_path), "instruments.csv row 2 ('TT1')", "'many'")
    assert not (tmp_path / "mine.html").exists()
