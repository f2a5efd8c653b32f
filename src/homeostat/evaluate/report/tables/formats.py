"""Tables as Markdown, LaTeX and CSV. Names and reasons come from files and models: none may act as markup."""

import csv
import io
import re
from typing import Final

from homeostat.evaluate.report.statistics import Estimate, Rate, Spread
from homeostat.evaluate.report.tables.table import EMPTY, Cell, Column, Kind, Percent, Table, one_line, said

_NAMES: Final = "backslash asciicircum asciitilde less greater bar quotedbl asciigrave quotesingle"
_LATEX: Final = str.maketrans(
    {c: f"\\{c}" for c in "{}$&#%_"}
    | {c: rf"\text{name}{{}}" for c, name in zip("\\^~<>|\"`'", _NAMES.split(), strict=True)}
    | {c: f"{{{c}}}" for c in "[]*-"}
    | {"–": "--", "−": "$-$"}
)
"""Characters that mean something to LaTeX, or that a font without Unicode lacks. A bracket or star that begins a line
would be taken for an argument of the line break before it."""
_PARTS: Final = {
    Kind.RATE: (" [%]", " count", " of", " low [%]", " high [%]"),
    Kind.SPREAD: (" median", " worst", " n"),
    Kind.ESTIMATE: (" mean", " low", " high"),
}
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
"""First characters from which a spreadsheet takes a text for a formula."""


def markdown(table: Table) -> str:
    """Title, note, table and the meaning of its columns, as GitHub reads them."""
    heads = " | ".join(_plain(name) for name in table.header)
    rule = "|".join("---" if column.kind is Kind.TEXT else "---:" for column in table.columns)
    lines = [
        f"| {' | '.join(_plain(said(c, column)) for c, column in zip(line, table.columns, strict=True))} |"
        for line in table.lines
    ]
    meanings = [f"- *{_plain(c.name)}*: {_plain(c.meaning)}" for c in table.columns if c.meaning]
    parts = [f"# {_plain(table.title)}", _plain(table.note), "\n".join([f"| {heads} |", f"|{rule}|", *lines])]
    return "\n\n".join([*parts, "\n".join(meanings)] if meanings else parts) + "\n"


def latex(table: Table) -> str:
    """A long table with the rules of booktabs, its caption and its label."""
    shape = "".join("l" if column.kind is Kind.TEXT else "r" for column in table.columns)
    heads = " & ".join(name.translate(_LATEX) for name in table.header) + r" \\"
    lines = [
        " & ".join(said(c, column).translate(_LATEX) for c, column in zip(line, table.columns, strict=True)) + r" \\"
        for line in table.lines
    ]
    caption = f"{table.title.translate(_LATEX)}. {table.note.translate(_LATEX)}"
    return "\n".join(
        [
            r"% Needs \usepackage[T1]{fontenc} and \usepackage{textcomp,booktabs,longtable}.",
            rf"\begin{{longtable}}{{{shape}}}",
            rf"\caption{{{caption}}}\label{{tab:{table.name}}}\\",
            *(r"\toprule", heads, r"\midrule", r"\endfirsthead"),
            *(r"\toprule", heads, r"\midrule", r"\endhead"),
            *(r"\bottomrule", r"\endfoot"),
            *lines,
            r"\end{longtable}",
            "",
        ]
    )


def comma_separated(table: Table) -> str:
    """One line per line; rates, medians and means are spread over several columns of plain numbers.

    Of words that a spreadsheet would compute, an apostrophe in front makes words.
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([one_line(c.name) + part for c in table.columns for part in _PARTS.get(c.kind, ("",))])
    for line in table.lines:
        writer.writerow([p for c, column in zip(line, table.columns, strict=True) for p in _parts(c, column)])
    return file.getvalue()


def _parts(cell: Cell, column: Column) -> list[str]:
    """The cell as plain numbers, as many as the column's kind has."""
    missing = [""] * len(_PARTS.get(column.kind, ("",)))
    match cell:
        case None:
            found = []
        case str():
            text = one_line(cell)
            found = [f"'{text}" if text.startswith(_FORMULA) else text]
        case Rate():
            ends = ["", ""] if (i := cell.interval) is None else [_full(100.0 * i.low), _full(100.0 * i.high)]
            found = [_full(100.0 * cell.share), str(cell.count), str(cell.of), *ends]
        case Percent():
            found = [_full(cell.value)]
        case Spread():
            found = [_full(cell.median * column.scale), _full(cell.worst * column.scale), str(cell.n)]
        case Estimate():
            i = cell.interval
            ends = [] if i is None else [_full(i.low * column.scale), _full(i.high * column.scale)]
            found = [_full(cell.mean * column.scale), *ends]
        case _:
            found = [_full(cell * column.scale)]
    return [*found, *missing[len(found) :]]


def _full(value: float) -> str:
    return f"{value:.10g}"


def _plain(text: str) -> str:
    """``text`` such that Markdown shows it as it is; an underscore inside a word is left, since it means nothing."""
    escaped = re.sub(r"([\\`*\[\]~|])", r"\\\1", one_line(text))
    escaped = escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"(?<!\w)_|_(?!\w)", r"\\_", escaped) or EMPTY
