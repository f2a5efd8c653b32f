"""The fenced blocks of the documentation's pages, and what a comment before one says of how it is tested."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REPO = Path(__file__).resolve().parents[2]
PAGES = [
    page
    for page in (REPO / "README.md", REPO / "CONTRIBUTING.md", *sorted((REPO / "docs").glob("**/*.md")))
    if page.is_file()
]
MARKERS = ("not run", "run with")
BLOCK = re.compile(
    r"^(?:<!-- (?P<marker>" + "|".join(MARKERS) + r"): (?P<said>[^\n]+) -->\n)?"
    r"```(?P<language>[^\n`]*)\n(?P<body>.*?)^```[ \t]*$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """One fenced block of a page."""

    line: int
    """Line of the page on which its first line stands."""
    language: str
    """What stands behind the fence; empty for a figure."""
    body: str
    """Its lines."""
    marker: str = ""
    """One of `MARKERS`: ``not run`` for a block that is read and not carried out, ``run with`` for one that is carried
    out with options that shorten it; empty for one that is carried out as it stands."""
    said: str = ""
    """Why it is not run, or the options."""


@dataclass(frozen=True)
class Shown:
    """One command of a page, with the output that the page promises; where that is empty, none is promised."""

    line: int
    command: str
    output: str


def named(page: Path) -> str:
    """The page as a test is called after it."""
    return str(page.relative_to(REPO))


def blocks(text: str) -> list[Block]:
    """The blocks of a page with ``text``."""
    return [
        Block(
            text[: block.start("body")].count("\n") + 1,
            block["language"].strip(),
            block["body"],
            block["marker"] or "",
            block["said"] or "",
        )
        for block in BLOCK.finditer(text)
    ]


def python_of(text: str) -> str:
    """The page's Python blocks on their own line numbers, everything else blank."""
    lines: list[str] = []
    for block in blocks(text):
        if block.language == "python":
            lines += [""] * (block.line - 1 - len(lines)) + block.body.splitlines()
    return "\n".join(lines)


def commands_of(text: str) -> list[Shown]:
    """What is carried out: the ``$`` lines of console blocks, and every line of the ``sh`` blocks that are run."""
    found: list[Shown] = []
    for block in blocks(text):
        if block.language == "console":
            found += _prompted(block)
        elif block.language == "sh" and block.marker != "not run":
            found += [Shown(line, _lengthened(command, block.said), "") for line, command in lines_of(block)]
    return found


def not_run(text: str) -> list[Shown]:
    """The commands of a page that are not carried out."""
    marked = [block for block in blocks(text) if block.marker == "not run"]
    return [Shown(line, command, "") for block in marked for line, command in lines_of(block)]


def lines_of(block: Block) -> Iterator[tuple[int, str]]:
    """The lines of a block that say something, each with its place in the page."""
    for k, line in enumerate(block.body.splitlines()):
        if line.strip():
            yield block.line + k, line


def _prompted(block: Block) -> list[Shown]:
    shown = re.finditer(r"^\$ (?P<command>.+)\n(?P<output>(?:(?!\$ ).*\n)*)", block.body, re.MULTILINE)
    return [Shown(block.line + block.body[: s.start()].count("\n"), s["command"], s["output"]) for s in shown]


def _lengthened(command: str, options: str) -> str:
    """``command`` with ``options``, before what it says behind a ``#``."""
    said, hash_, comment = re.match(r"(.*?)(\s+#\s|$)(.*)", command, re.DOTALL).groups()  # type: ignore[union-attr]
    return f"{said} {options}{hash_}{comment}" if options else command
