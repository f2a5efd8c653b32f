"""The report of a campaign: one page that needs nothing else, and its tables as files."""

from __future__ import annotations

import urllib.parse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path, PurePosixPath
from typing import Final

from homeostat import __version__
from homeostat.evaluate.report.contents import Contents, contents
from homeostat.evaluate.report.figures.gallery import Gallery, gallery
from homeostat.evaluate.report.groups import Source, entrant, source
from homeostat.evaluate.report.summary import summary, what_was_run
from homeostat.evaluate.report.tables.formats import comma_separated, latex, markdown
from homeostat.evaluate.report.tables.runs import failed, what_failed
from homeostat.evaluate.report.tables.table import Kind, Table, said
from homeostat.evaluate.study.row import Row

REPORT: Final = "report.html"
"""Name of the page in the campaign's folder."""
TABLES: Final = "tables"
"""Name of the folder with the tables."""
_PAGE: Final = "page"
_FORMATS: Final = {".md": markdown, ".tex": latex, ".csv": comma_separated}


@dataclass(frozen=True, slots=True)
class Failure:
    """One run that failed, as the page shows it."""

    row: Row
    """The run."""
    who: str
    """Who proposed, and what it went without."""
    what: str
    """What failed."""
    link: str
    """Where its record lies, seen from the page; empty where it was not kept."""
    command: str
    """What runs it again."""


def write_report(
    folder: Path, title: str, rows: Sequence[Row], rerun: Callable[[Row], str], reference: str | None = None
) -> tuple[Path, ...]:
    """Write ``report.html`` and ``tables/*`` into ``folder``, the campaign's own, so that links to records hold.

    The same rows in any order give the same files. Tables of an earlier report that this one lacks are left.

    Args:
        rerun: gives the command that makes one run again.
        reference: name of the proposer that others are compared with; by default the first in order.

    Returns:
        Paths of all files, the page first.

    Raises:
        ImportError: the packages of the extra ``campaign`` are not installed.
    """
    known = contents(rows, reference)
    page = folder / REPORT
    into = folder / TABLES
    into.mkdir(parents=True, exist_ok=True)
    page.write_text(html(title, rows, rerun, known, reference), encoding="utf-8", newline="\n")
    written = [page]
    for table in known.tables:
        for ending, form in _FORMATS.items():
            path = into / (table.name + ending)
            path.write_text(form(table), encoding="utf-8", newline="\n")
            written.append(path)
    return tuple(written)


def html(
    title: str, rows: Sequence[Row], rerun: Callable[[Row], str], known: Contents, reference: str | None = None
) -> str:
    """The page. Everything that comes from the rows is escaped; only figures and style are taken as they are."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    page = Environment(
        loader=FunctionLoader(_file), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    failures = _failures(rows, rerun)
    drawn = gallery(rows) if rows else Gallery((), (), (), (), ())
    return page.get_template("report.html").render(
        title=title, version=__version__, style=_file("report.css"), facts=what_was_run(rows), known=known,
        told=summary(rows, reference), drawn=drawn, said=said, is_text=_is_text, folder=TABLES,
        failures=[one for one in failures if source(one.row.proposer) is not Source.YARDSTICK],
        yardsticks=[one for one in failures if source(one.row.proposer) is Source.YARDSTICK],
        lines=_lines,
    )  # fmt: skip


def _failures(rows: Sequence[Row], rerun: Callable[[Row], str]) -> list[Failure]:
    return [Failure(row, entrant(row), what_failed(row), _link(row.trace), rerun(row)) for row in failed(rows)]


def _link(trace: str) -> str:
    """A link to a folder below the page's; empty for none, and for whatever leads elsewhere."""
    parts = PurePosixPath(trace.replace("\\", "/"))
    if not trace or parts.is_absolute() or ".." in parts.parts:
        return ""
    return f"./{urllib.parse.quote(str(parts))}"


def _is_text(kind: Kind) -> bool:
    return kind is Kind.TEXT


def _lines(table: Table) -> list[list[tuple[str, bool]]]:
    """How the cells of a table read, and whether they are words."""
    return [
        [(said(cell, column), _is_text(column.kind)) for cell, column in zip(line, table.columns, strict=True)]
        for line in table.lines
    ]


def _file(name: str) -> str:
    return files(__package__).joinpath(_PAGE, name).read_text(encoding="utf-8")
