"""A formula may name a parameter: the graph holds its value, checked for its unit."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.knowledge.build.build import build
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.stl.constants import filled
from homeostat.stl.formula import parse, parse_expression
from homeostat.stl.text import render
from tests.knowledge.mistakes import where
from tests.knowledge.tables import Workbench


@pytest.fixture
def bench(tmp_path: Path) -> Workbench:
    return Workbench.at(tmp_path / "plant")


def named(table: str, row: str, column: str, value: str, bench: Workbench) -> None:
    bench.edit(table, where(lambda cells: cells["id"] == row, **{column: value}))


def test_the_graph_holds_the_number_that_the_parameters_state(bench: Workbench) -> None:
    named("limits", "LIM-L-HIGH", "formula", "L1 <= V_brim", bench)
    assert 'hs:formula "L1 <= 11"' in build(bench.folder).decode()
    bench.edit("parameters", where(lambda cells: cells["symbol"] == "V_brim", value="10.9"))
    assert 'hs:formula "L1 <= 10.9"' in build(bench.folder).decode()


def test_a_formula_without_parameters_stays_as_it_is_written(bench: Workbench) -> None:
    named("limits", "LIM-L-HIGH", "formula", "L1<=2*5.5", bench)
    assert 'hs:formula "L1<=2*5.5"' in build(bench.folder).decode()


def test_a_parameter_of_another_unit_is_refused(bench: Workbench) -> None:
    named("limits", "LIM-L-HIGH", "formula", "L1 <= T_ambient", bench)
    with pytest.raises(GraphError, match=r"in L and .T_ambient. in K") as error:
        build(bench.folder)
    assert error.value.code is Code.BAD_FORMULA


def test_what_is_neither_tag_nor_parameter_is_refused_with_the_nearest_one(bench: Workbench) -> None:
    named("limits", "LIM-L-HIGH", "formula", "L1 <= V_brin", bench)
    with pytest.raises(GraphError, match="V_brim"):
        build(bench.folder)


@pytest.mark.parametrize(
    "text, expected",
    [
        ("a / 1000 * x", "4.18 * x"), ("x - a", "x - 4180"), ("x + b", "x + -0.5"), ("x / (a - a)", "x / 0"),
        ("1 / (a - a) * x", "1 / 0 * x"), ("min(a, x) * -b", "min(4180, x) * --0.5"), ("2 * 3 * x", "6 * x"),
    ],
)  # fmt: skip
def test_numbers_are_worked_out_where_nothing_else_is_beside_them(text: str, expected: str) -> None:
    assert render(filled(parse_expression(text).root, {"a": 4180.0, "b": -0.5})) == expected


def test_every_part_of_a_formula_is_filled() -> None:
    text = "always[0,60](x <= a) and not (x >= a or true) implies (x < a) until[1,2] (eventually(x == a))"
    expected = render(parse(text.replace("a)", "7)").replace("a or", "7 or")).root)
    assert render(filled(parse(text).root, {"a": 7.0})) == expected


def test_margins_are_to_the_digit_those_of_the_numbers() -> None:
    named_text, plain = "abs(x) <= cp / 1000 * y", "abs(x) <= 4.18 * y"
    values = {"x": 0.1, "y": 0.3}
    shown = parse(render(filled(parse(named_text).root, {"cp": 4180.0})))
    assert shown.margin_at(values) == parse(plain).margin_at(values)
