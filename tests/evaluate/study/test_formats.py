"""Tables as files: what names and reasons contain is shown, and never acts."""

from __future__ import annotations

import csv
import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.evaluate.report.statistics import Estimate, Interval, Rate, Spread
from homeostat.evaluate.report.tables.formats import comma_separated, latex, markdown
from homeostat.evaluate.report.tables.table import (
    Cell,
    Column,
    Kind,
    Percent,
    Table,
    compact,
    said,
)

ATTACKS = [
    "a|b", "<script>alert(1)</script>", "back\\slash", "100 % & more", "two\nlines", "\\input{/etc/passwd}", "$x$",
    "[1pt] off", "*bold*", "![i](u)", "`code`", "~tilde^", "#{}_", "=1+1", "@SUM(A1)", 'quote"d', "\\|", "tab\tle",
    "nul\x00\x1b[31m", "\u202eevil", "a\u2028b", "--dash", "&lt;", "\\\\*",
]  # fmt: skip
WORDS = st.text(max_size=30)


def one(cell: Cell, kind: Kind = Kind.TEXT, digits: int = 0, scale: float = 1.0) -> Table:
    column = Column("value", kind, "what it is", digits, scale)
    return Table("name", "Title", "Note.", (Column("name", Kind.TEXT), column), (("a", cell),))


def parsed(table: Table) -> list[list[str]]:
    return list(csv.reader(io.StringIO(comma_separated(table)), strict=True))


@pytest.mark.parametrize("attack", ATTACKS)
def test_markdown_keeps_the_table_whole(attack: str) -> None:
    lines = markdown(one(attack)).splitlines()
    (line,) = [text for text in lines if text.startswith("| a ")]
    assert len(re.findall(r"(?<!\\)(?:\\\\)*\|", line)) == 3
    assert "<" not in line
    assert not re.search(r"(?<!\\)(?:\\\\)*[`*\[\]]", line)


@given(WORDS)
def test_markdown_of_any_words_has_one_line_per_line(words: str) -> None:
    text = markdown(one(words))
    assert sum(line.startswith("|") for line in text.splitlines()) == 3


@pytest.mark.parametrize("attack", ATTACKS)
def test_latex_has_no_command_of_its_own(attack: str) -> None:
    (line,) = [text for text in latex(one(attack)).splitlines() if text.startswith("a & ")]
    body = line.removeprefix("a & ").removesuffix(r" \\")
    ours = r"\\(textbackslash|textasciicircum|textasciitilde|textless|textgreater|textbar|textquotedbl)\{\}"
    ours += r"|\\text(asciigrave|quotesingle)\{\}|\\[{}$&#%_]|\{[\[\]*-]\}"
    left = re.sub(ours, "", body)
    assert not set(left) & set("\\{}$&#^_~%<>|\"`'[]*"), left


def test_latex_has_the_rules_of_booktabs() -> None:
    text = latex(one(3, Kind.COUNT))
    assert text.index(r"\toprule") < text.index(r"\midrule") < text.index(r"\bottomrule")
    assert r"\begin{longtable}{lr}" in text
    assert r"a & 3 \\" in text


@pytest.mark.parametrize("attack", ATTACKS)
def test_csv_is_read_back(attack: str) -> None:
    header, line = parsed(one(attack))
    assert header == ["name", "value"]
    assert len(line) == 2
    assert not line[1].startswith(("=", "+", "-", "@"))
    shown = said(attack, Column("value", Kind.TEXT))
    assert line[1].removeprefix("'") == shown


@given(WORDS, WORDS)
def test_csv_of_any_words_is_read_back(first: str, second: str) -> None:
    table = Table("t", "T", "", (Column(first, Kind.TEXT), Column("n", Kind.NUMBER)), ((second, 0.1),))
    header, line = parsed(table)
    assert header[1] == "n"
    assert float(line[1]) == 0.1


def test_csv_spreads_scores_over_columns() -> None:
    rate = Rate(3, 4, Interval(0.301, 0.954))
    assert parsed(one(rate, Kind.RATE)) == [
        ["name", "value [%]", "value count", "value of", "value low [%]", "value high [%]"],
        ["a", "75", "3", "4", "30.1", "95.4"],
    ]
    assert parsed(one(Percent(43.0), Kind.RATE))[1] == ["a", "43", "", "", "", ""]
    assert parsed(one(Spread(0.5, 1.0, 7), Kind.SPREAD, scale=100.0))[1] == ["a", "50", "100", "7"]
    assert parsed(one(Estimate(1.5, Interval(1.0, 2.0)), Kind.ESTIMATE))[1] == ["a", "1.5", "1", "2"]
    assert parsed(one(Estimate(1.5, None), Kind.ESTIMATE))[1] == ["a", "1.5", "", ""]
    assert parsed(one(None, Kind.SPREAD))[1] == ["a", "", "", ""]


@pytest.mark.parametrize(
    ("cell", "digits", "shown"),
    [
        (Rate(19, 20, Interval(0.7639, 0.9911)), 0, "19/20 (76–99 %)"), (Rate(1, 3, None), 0, "33.3 % (1/3)"),
        (Percent(91.5), 0, "91.5 %"), (Spread(1.0, -0.001, 2), 2, "1.00 (0.00)"), (None, 0, "–"), ("", 0, "–"),
        (Estimate(2.0, Interval(-1.0, 3.0)), 1, "2.0 (-1.0 to 3.0)"), (12, 0, "12"), (-0.2, 0, "0"),
    ],
)  # fmt: skip
def test_cells_read_well(cell: Cell, digits: int, shown: str) -> None:
    assert said(cell, Column("value", Kind.NUMBER, "", digits)) == shown


def test_columns_that_say_nothing_are_left_out() -> None:
    table = one(None)
    assert compact(table).header == ("name",)
    assert compact(one(0, Kind.COUNT)).header == ("name", "value")


def test_a_line_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match=r"table 'x' has 1 columns, a line has 2 cells"):
        Table("x", "X", "", (Column("a", Kind.TEXT),), (("a", "b"),))
