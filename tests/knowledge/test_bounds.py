"""Numbers that disarm what they belong to, and rules that nothing can violate, are one line with the bound each."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.knowledge.checks.consistency import inconsistencies
from homeostat.knowledge.checks.reach import deepest
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.plant import load_plant
from homeostat.stl.formula import parse
from tests.knowledge.absurd import ABSURD
from tests.knowledge.mistakes import Change, cell, where
from tests.knowledge.tables import SYSTEM, Workbench, store_of
from tests.knowledge.test_consistency import MODEL
from tests.plants.copies import Copy

RANGES = {"x": (-2.0, 3.0), "y": (0.0, 5.0), "z": (1.0, 1.5)}
MANY = {f"t{k}": (0.0, 10.0) for k in range(30)}


def said(bench: Workbench) -> list[str]:
    return [str(item) for item in inconsistencies(read_plant(store_of(bench.graph()), SYSTEM), MODEL)]


@pytest.fixture
def bench(tmp_path: Path) -> Workbench:
    return Workbench.at(tmp_path / "plant")


def test_a_number_that_was_written_with_six_digits_is_at_its_bound(bench: Workbench) -> None:
    """A range of 17 K goes through in a second at most: 17.0001 K/s is that, written, and 17.01 K/s is not."""
    for rate, refused in (("17.0001", False), ("17.01", True)):
        bench.edit("signals", where(lambda row: row["tag"] == "T1.sp", rate_limit=rate))
        assert any("rate_limit" in line for line in said(bench)) is refused


@pytest.mark.parametrize(
    ("table", "change", "code", "thing", "words"),
    [*ABSURD[::3], *(pytest.param(*each, marks=pytest.mark.wide) for k, each in enumerate(ABSURD) if k % 3)],
    ids=lambda value: value[:60] if isinstance(value, str) else "",
)
def test_an_absurd_value_is_one_line_with_its_bound(
    bench: Workbench, table: str, change: Change, code: Code, thing: str, words: str
) -> None:
    bench.edit(table, change)
    lines = said(bench)
    assert any(line.startswith(f"[{code}] {thing}: ") and words in line for line in lines), lines
    assert all("\n" not in line and len(line) < 400 for line in lines)


@pytest.mark.parametrize(
    ("table", "change"),
    [
        ("trips", cell("cusum", "20")),
        ("trips", cell("cusum", "1.5", 1)),
        ("trips", cell("lift", "16.5")),
        ("trips", cell("lead", "21")),
        ("fallbacks", cell("rate", "1")),
        ("fallback_limits", cell("rest", "20")),
        ("quality", cell("noise", "2.2")),
        ("quality", cell("fastest", "110")),
        ("writables", where(lambda row: row["tag"] == "XV1.cmd", tolerance="0.02")),
        ("limits", where(lambda row: row["id"] == "LIM-T-HIGH", formula="T1 <= 354")),
        ("limits", where(lambda row: row["id"] == "LIM-T-HIGH", formula="abs(T1 - T1.sp) <= 5")),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_just_inside_its_bound_is_taken(bench: Workbench, table: str, change: Change) -> None:
    if table == "limits":  # what a correction may take is a share of what the limit's reading can vary by
        bench.edit("trips", cell("lift", "5"))
    bench.edit(table, change)
    # Another limit is no longer carried by instruments that the first one did not read.
    assert [line for line in said(bench) if "carrier-reads-limit" not in line] == []


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("trips.csv", "LIM-T-HIGH,10,", "LIM-T-HIGH,1e9,"),
        ("limits.csv", "T1 <= 313,", "T1 - T1 <= 1,"),
        ("writables.csv", "XV1.cmd,0.01,", "XV1.cmd,0.99,"),
        ("fallback_limits.csv", "drain,LIM-T-HIGH,60,0", "drain,LIM-T-HIGH,60,1e9"),
        ("limits.csv", "LIM-T-HIGH,trip limit,yes", "LIM-T-HIGH,trip limit,no"),
    ],
)
def test_no_such_plant_is_loaded(tmp_path: Path, name: str, old: str, new: str) -> None:
    copy = Copy.of("cstr", tmp_path)
    copy.replace(f"engineering/{name}", old, new)
    with pytest.raises(GraphError) as caught:
        copy.load()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["cstr", "mixing_module"])
def test_the_installed_plants_need_no_new_graph(name: str) -> None:
    assert load_plant(name).remade == ()


@pytest.mark.parametrize(
    ("text", "depth"),
    [
        ("x <= 3", 0.0),
        ("x <= 1", 2.0),
        ("x <= 1 or y <= 4", 1.0),
        ("x <= 1 and y <= 4", 2.0),
        ("x <= 1 or x >= 0.5", 0.0),
        ("x <= 1 or x >= 2", 0.5),
        ("x * x >= 0", 0.0),
        ("x * x <= 4", 5.0),
        ("abs(x - z) <= 2", 1.5),
        ("1 / (x - x) <= 0", 0.0),
        ("true", 0.0),
        ("not (x <= 1 implies y <= 4)", 4.0),
    ],
)
def test_how_deeply_a_rule_can_be_violated(text: str, depth: float) -> None:
    assert deepest(parse(text), RANGES) == pytest.approx(depth)


def test_a_violation_is_found_among_many_tags() -> None:
    any_of = " or ".join(f"{tag} <= {k % 7 + 2}" for k, tag in enumerate(MANY))
    assert deepest(parse(any_of), MANY) == pytest.approx(2.0)
    assert deepest(parse(" + ".join(MANY) + " <= 290"), MANY) == pytest.approx(10.0)
    assert deepest(parse(" + ".join(MANY) + " <= 300"), MANY) == 0.0


def test_what_mixes_units_is_violated_in_scales() -> None:
    tags = {"x": Tag("x", Role.PV, "K", Range(-2.0, 3.0), 0.5), "y": Tag("y", Role.PV, "L", Range(0.0, 5.0), 0.1)}
    assert deepest(parse("x <= 1 or y <= 4", tags), RANGES) == pytest.approx(4.0)
