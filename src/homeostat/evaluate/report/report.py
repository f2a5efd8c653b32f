"""The report of a study: one page that needs nothing else, and its tables as files."""

import urllib.parse
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path, PurePosixPath
from typing import Final, NamedTuple

from homeostat import __version__
from homeostat.evaluate.report.contents import Contents, contents, failed, what_failed
from homeostat.evaluate.report.groups import Origin, arm, source
from homeostat.evaluate.report.summary import seconds, summary, what_was_run
from homeostat.evaluate.report.tables.formats import comma_separated, latex, markdown
from homeostat.evaluate.report.tables.table import Table, said
from homeostat.journal.beside.files import write_whole
from homeostat.record.row import Row

REPORT: Final = "report.html"
"""Name of the page in the study's folder."""
TABLES: Final = "tables"
"""Name of the folder with the tables."""
_PAGE: Final = "page"
Rerun = Callable[[Row], str]
"""Gives the command that makes one run again."""
_FORMATS: Final = {".md": markdown, ".tex": latex, ".csv": comma_separated}


class Unmade(NamedTuple):
    """A run that was asked for and could not be carried out."""

    job: str
    """Name of its job."""
    failure: str
    """What failed, in one line."""


def write_report(
    folder: Path,
    title: str,
    rows: Sequence[Row],
    rerun: Rerun,
    reference: str | None = None,
    unmade: Sequence[Unmade] = (),
) -> tuple[Path, ...]:
    """Write ``report.html`` and ``tables/*`` into ``folder``, the study's own, so that links to records hold.

    Paths of all files, the page first. The same rows in any order give the same files; tables of an earlier report that
    this one lacks are left. ``reference`` is as in `contents`; ``unmade`` are the runs that were asked for and have no
    row, which the page says. Each file is the old one or the new one, whole, whenever it is read. OSError where the
    disk takes no more, ImportError where the extra ``campaign`` is missing.
    """
    known = contents(rows, reference)
    tables = write_tables(folder / TABLES, known.tables)
    page = folder / REPORT
    write_whole(page, html(title, rows, rerun, known, reference, unmade).encode())
    return page, *tables


def write_tables(folder: Path, tables: Sequence[Table]) -> tuple[Path, ...]:
    """Write every table as Markdown, LaTeX and CSV into ``folder``, which is made; paths of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for table in tables:
        for ending, form in _FORMATS.items():
            path = folder / (table.name + ending)
            write_whole(path, form(table).encode())
            written.append(path)
    return tuple(written)


def html(
    title: str,
    rows: Sequence[Row],
    rerun: Rerun,
    known: Contents,
    reference: str | None = None,
    unmade: Sequence[Unmade] = (),
) -> str:
    """The page. Everything that comes from the rows is escaped; only figures and style are taken as they are."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    from homeostat.evaluate.report.figures.gallery import Gallery, gallery

    page = Environment(loader=FunctionLoader(_file), autoescape=True, undefined=StrictUndefined)
    page.trim_blocks = page.lstrip_blocks = page.keep_trailing_newline = True
    page.globals |= {
        "said": said,
        "arm": arm,
        "what_failed": what_failed,
        "link": _link,
        "rerun": rerun,
        "seconds": seconds,
    }
    parts = [[r for r in failed(rows) if (source(r.proposer) is Origin.REFERENCE) is it] for it in (False, True)]
    drawn = gallery(rows) if rows else Gallery((), ())
    return page.get_template("report.html").render(
        {"title": title, "version": __version__, "style": _file("report.css"), "folder": TABLES},
        known=known,
        facts=what_was_run(rows, len(unmade)),
        told=summary(rows, reference),
        drawn=drawn,
        failures=parts[0],
        references=parts[1],
        unmade=unmade,
    )


def _link(trace: str) -> str:
    """A link to a folder below the page's; empty for none, and for whatever leads elsewhere."""
    parts = PurePosixPath(trace.replace("\\", "/"))
    if not trace or parts.is_absolute() or ".." in parts.parts:
        return ""
    return f"./{urllib.parse.quote(str(parts))}"


def _file(name: str) -> str:
    return files(__package__).joinpath(_PAGE, name).read_text(encoding="utf-8")
