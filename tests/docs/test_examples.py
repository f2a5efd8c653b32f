"""The documentation keeps its word: its examples run and show what the pages say.

Every ``$ ...`` line of a ``console`` block and every line of an ``sh`` block is carried out, in order, in one folder
per page that has the folders of a checkout, and must exit with 0; output shown under a ``$`` line must match, where
``...`` stands for anything. A ``homeostat`` command that needs no shell is carried out in this process, which has
loaded everything; whatever else in one of its own. Then every ``python`` block of the page runs there, in order, in one
process.

A comment on the line before a block may change that. ``<!-- run with: OPTIONS -->`` adds options that make the commands
of the block shorter. ``<!-- not run: WHY -->`` is for what needs a server, a key, a network or minutes: such commands
are read by `tests.docs.test_not_run`.
"""

from __future__ import annotations

import doctest
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import Done, homeostat
from tests.docs.blocks import PAGES, REPO, blocks, commands_of, named, python_of

LIMIT_S = 240
HERE = {**os.environ, "PYTHONPATH": str(REPO / "src")}
"""The environment of an example: the package of this tree, from whatever folder."""
SHELL = frozenset("$`<>|&*~")
"""Signs that a shell may give a meaning."""
SLOW = {"docs/how-to/run-a-campaign.md"}
"""Pages whose examples take most of a minute."""
ALL = [
    pytest.param(page, id=named(page), marks=[pytest.mark.slow] if named(page) in SLOW else [])
    for page in PAGES
    if python_of(page.read_text("utf-8")) or commands_of(page.read_text("utf-8"))
]


def test_the_readme_is_among_the_pages() -> None:
    assert REPO / "README.md" in PAGES


def test_blocks_keep_their_line_numbers() -> None:
    page = "# Title\n\n```python\nx = 1\n```\n\n```sh\nnot python\n```\ntext\n```python\nassert x == 1\n```\n"
    assert python_of(page).splitlines() == ["", "", "", "x = 1", *[""] * 7, "assert x == 1"]
    assert [block.line for block in blocks(page)] == [4, 8, 12]


def test_which_commands_are_carried_out() -> None:
    page = (
        "<!-- run with: --end 3 -->\n```sh\nshort --of it  # why\n\n```\n<!-- not run: a key -->\n```sh\nlong\n```\n"
        "```console\n$ first\nsaid\n$ second\n```\n"
    )
    assert [(shown.line, shown.command, shown.output) for shown in commands_of(page)] == [
        (3, "short --of it --end 3  # why", ""),
        (11, "first", "said\n"),
        (13, "second", ""),
    ]


def checkout(folder: Path) -> Path:
    """A folder with what a page finds in a checkout; the commands of this tree are in its ``bin``."""
    for name, words in (("homeostat", "-m homeostat"), ("python", "")):
        (folder / "bin" / name).parent.mkdir(exist_ok=True)
        (folder / "bin" / name).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {words} "$@"\n')
        (folder / "bin" / name).chmod(0o755)
    (folder / "here").mkdir()
    for name in ("src", "campaigns", "examples"):
        (folder / "here" / name).symlink_to(REPO / name)
    return folder / "here"


def carried_out(command: str, here: Path, env: dict[str, str]) -> Done:
    """What ``command`` does in folder ``here``."""
    if command.startswith("homeostat ") and SHELL.isdisjoint(command):
        return homeostat(*shlex.split(command, comments=True)[1:], cwd=here)
    done = subprocess.run(
        ["sh", "-c", command],
        cwd=here,
        env=env,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        stdin=subprocess.DEVNULL,
    )
    return Done(done.returncode, done.stdout, done.stderr, here)


@pytest.mark.timeout(900)
@pytest.mark.parametrize("page", ALL)
def test_examples_do_what_the_page_says(page: Path, tmp_path: Path) -> None:
    text, here = page.read_text("utf-8"), checkout(tmp_path)
    env = {**HERE, "PATH": f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    for shown in commands_of(text):
        done = carried_out(shown.command, here, env)
        where = f"{named(page)}:{shown.line}"
        assert done.status == 0, f"{where}: {shown.command}:\n{done.out}{done.err}"
        flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
        if shown.output.strip() and not doctest.OutputChecker().check_output(shown.output, done.out, flags):
            pytest.fail(f"{where} promises\n{shown.output}\nbut it shows\n{done.out}")
    program = f"exec(compile({python_of(text)!r}, {str(page)!r}, 'exec'), {{'__name__': '__main__'}})"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=here, env=env, capture_output=True, text=True, timeout=LIMIT_S
    )
    assert done.returncode == 0, f"{named(page)}:\n{done.stderr}"
