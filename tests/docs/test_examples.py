"""The documentation keeps its word: its examples run and show what the pages say.

Every ``python`` block of a page runs, in order, in one process per page. Every ``$ homeostat ...`` line of a
``console`` block runs and must exit with 0; output shown under it must match, where ``...`` stands for anything.
A command that takes minutes belongs in an ``sh`` block, which is not run.
"""

from __future__ import annotations

import doctest
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


@dataclass(frozen=True)
class Shown:
    """One command of a page with the output that the page promises."""

    page: Path
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
    """The ``$ homeostat`` lines of the page's console blocks."""
    text = page.read_text(encoding="utf-8")
    shown = []
    for block in BLOCK.finditer(text):
        if block["language"] != "console":
            continue
        for part in re.finditer(r"^\$ (?P<command>.+)\n(?P<output>(?:(?!\$ ).*\n)*)", block["body"], re.MULTILINE):
            if part["command"].startswith("homeostat "):
                line = text[: block.start("body") + part.start()].count("\n") + 1
                shown.append(Shown(page, line, part["command"], part["output"]))
    return shown


COMMANDS = [shown for page in PAGES for shown in commands_of(page)]


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
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S
    )
    assert done.returncode == 0, f"{named(page)}:\n{done.stderr}"


@pytest.mark.parametrize("shown", COMMANDS, ids=lambda shown: f"{named(shown.page)}:{shown.line}")
def test_commands_show_what_the_page_says(shown: Shown, tmp_path: Path) -> None:
    words = [sys.executable, "-m", *shlex.split(shown.command, comments=True)]
    done = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, f"{shown.command}:\n{done.stdout}{done.stderr}"
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    if shown.output.strip() and not doctest.OutputChecker().check_output(shown.output, done.stdout, flags):
        pytest.fail(
            f"{named(shown.page)}:{shown.line} promises\n{shown.output}\nbut {shown.command!r} shows\n{done.stdout}"
        )
