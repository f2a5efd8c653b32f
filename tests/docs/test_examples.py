"""The documentation keeps its word: its examples run and show what the pages say.

Every ``python`` block of a page runs, in order, in one process per page. Every ``$ ...`` line of a ``console`` block
runs, in order, in one folder per page, and must exit with 0; output shown under it must match, where ``...`` stands for
anything. A command that takes minutes belongs in an ``sh`` block, which is not run.
"""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
PAGES = [page for page in [REPO / "README.md", *sorted((REPO / "docs").glob("**/*.md"))] if page.is_file()]
BLOCK = re.compile(r"^```(?P<language>\w+)[^\n]*\n(?P<body>.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
LIMIT_S = 180
HERE = {**os.environ, "PYTHONPATH": str(REPO / "src")}
"""The environment of an example: the package of this tree, from whatever folder."""


@dataclass(frozen=True)
class Shown:
    """One command of a page with the output that the page promises."""

    line: int
    command: str
    output: str


def named(page: Path) -> str:
    return str(page.relative_to(REPO))


def python_of(page: str) -> str:
    """The page's Python blocks on their own line numbers, everything else blank."""
    lines: list[str] = []
    for block in BLOCK.finditer(page):
        if block["language"] == "python":
            first = page[: block.start("body")].count("\n")
            lines += [""] * (first - len(lines)) + block["body"].splitlines()
    return "\n".join(lines)


def commands_of(page: Path) -> list[Shown]:
    """The ``$`` lines of the page's console blocks."""
    text = page.read_text(encoding="utf-8")
    blocks = [block for block in BLOCK.finditer(text) if block["language"] == "console"]
    return [
        Shown(text[: block.start("body") + part.start()].count("\n") + 1, part["command"], part["output"])
        for block in blocks
        for part in re.finditer(r"^\$ (?P<command>.+)\n(?P<output>(?:(?!\$ ).*\n)*)", block["body"], re.MULTILINE)
    ]


def test_the_readme_is_among_the_pages() -> None:
    assert REPO / "README.md" in PAGES


def test_blocks_keep_their_line_numbers() -> None:
    page = "# Title\n\n```python\nx = 1\n```\n\n```sh\nnot python\n```\ntext\n```python\nassert x == 1\n```\n"
    assert python_of(page).splitlines() == ["", "", "", "x = 1", *[""] * 7, "assert x == 1"]


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_python_blocks_run(page: Path, tmp_path: Path) -> None:
    source = python_of(page.read_text(encoding="utf-8"))
    if not source:
        pytest.skip("the page has no Python block")
    program = f"exec(compile({source!r}, {str(page)!r}, 'exec'), {{'__name__': '__main__'}})"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=HERE, capture_output=True, text=True, timeout=LIMIT_S
    )
    assert done.returncode == 0, f"{named(page)}:\n{done.stderr}"


@pytest.mark.parametrize("page", [page for page in PAGES if commands_of(page)], ids=named)
def test_commands_show_what_the_page_says(page: Path, tmp_path: Path) -> None:
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    for name, words in (("homeostat", "-m homeostat"), ("python", "")):
        (bin_ / name).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {words} "$@"\n')
        (bin_ / name).chmod(0o755)
    (tmp_path / "here").mkdir()
    for shown in commands_of(page):
        done = subprocess.run(
            ["sh", "-c", shown.command],
            cwd=tmp_path / "here",
            env={**HERE, "PATH": f"{bin_}{os.pathsep}{os.environ['PATH']}"},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            stdin=subprocess.DEVNULL,
        )
        assert done.returncode == 0, f"{shown.command}:\n{done.stdout}{done.stderr}"
        flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
        if shown.output.strip() and not doctest.OutputChecker().check_output(shown.output, done.stdout, flags):
            pytest.fail(f"{named(page)}:{shown.line} promises\n{shown.output}\nbut it shows\n{done.stdout}")
