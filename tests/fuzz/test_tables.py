"""Random edits of both plants' tables: a plant loads with finite numbers, or one line says what is wrong and where."""

from __future__ import annotations

import csv
import dataclasses
import math
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyoxigraph import NamedNode

from homeostat.knowledge.build.build import build, mapped, refuse_incomplete
from homeostat.knowledge.build.tables.check import mistakes
from homeostat.knowledge.build.tables.schemas import SCHEMAS
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.files.folder import read_files
from homeostat.plants.files.graph import open_graph, refuse_other_model
from homeostat.plants.model import find_model
from homeostat.plants.settings.file import read_settings
from homeostat.stl.formula import Expression, Formula
from tests.knowledge.tables import INSTALLED
from tests.knowledge.whole import whole

PLANTS = ["cstr", pytest.param("mixing_module", marks=pytest.mark.wide)]
NUMBERS = (
    "0",
    "-1",
    "7",
    "1e300",
    "-1e300",
    "1e999",
    "nan",
    "-inf",
    "1e-300",
    "0x1",
    "1_0",
    "1,5",
    "007",
    "+.5",
    "1e2",
)
WORDS = (
    "",
    "yes",
    "no",
    "true",
    "false",
    "PV",
    "nowhere",
    "T1",
    "T1 <= 3",
    "T1 <= 1e308",
    "((",
    "T1 != 3",
    "a b",
    "%",
    "{id}",
)
ODD = (
    "a\nb",
    "\x00",
    "\x1b[2J",
    "\u202e",
    '"',
    " x",
    "x ",
    "<urn:x>",
    "\ud7ff",
    "'; DROP",
    "é" * 200,
    "9" * 5000,
    "not " * 400,
)
CELLS = st.one_of(
    st.sampled_from(NUMBERS), st.sampled_from(WORDS), st.sampled_from(ODD), st.text(max_size=8), st.floats().map(repr)
)
UNHURRIED = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


def read(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


@pytest.fixture(params=PLANTS)
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A copy of a plant."""
    ignored = shutil.ignore_patterns("__pycache__", "*.py")
    folder = Path(shutil.copytree(INSTALLED / request.param, tmp_path / request.param, ignore=ignored))
    for path in (folder / "engineering").glob("*.csv"):
        path.unlink()
    return folder


def edited(folder: Path, data: st.DataObject, edits: int) -> None:
    """Put the tables back as they are, and then change some of their cells, rows and headers."""
    for path in sorted((whole(folder.name) / "engineering").glob("*.csv")):
        shutil.copy(path, folder / "engineering")
    for _ in range(edits):
        path = folder / "engineering" / f"{data.draw(st.sampled_from(sorted(SCHEMAS)))}.csv"
        table = read(path)
        if not table:  # an edit before this one took its only row
            continue
        row = data.draw(st.integers(min(1, len(table) - 1), len(table) - 1) | st.integers(0, len(table) - 1))
        column = data.draw(st.integers(0, len(table[row]) - 1)) if table[row] else 0
        match data.draw(st.sampled_from(("cell", "cell", "cell", "other", "twice", "lost", "ragged"))):
            case "cell":
                table[row][column : column + 1] = [data.draw(CELLS)]
            case "other":
                table[row][column : column + 1] = [data.draw(st.sampled_from([r[0] for r in table if r]))]
            case "twice":
                table.append(list(table[row]))
            case "lost":
                del table[row]
            case "ragged":
                table[row] = table[row][:column]
        with path.open("w", encoding="utf-8", newline="", errors="surrogatepass") as file:
            csv.writer(file, lineterminator="\n").writerows(table)


def one_line(error: GraphError) -> None:
    text = str(error)
    assert text.isprintable() and len(text) < 1000 and error.thing and error.message, text


def finite(value: Any) -> None:
    """Every number in a description is finite; a formula's own windows may have no end."""
    if isinstance(value, float):
        assert math.isfinite(value)
    elif isinstance(value, Formula | Expression):
        return
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            finite(getattr(value, field.name))
    elif isinstance(value, dict):
        finite(tuple(value.values()))
    elif isinstance(value, tuple | list | frozenset):
        for item in value:
            finite(item)


@settings(max_examples=40, suppress_health_check=UNHURRIED)
@given(data=st.data(), edits=st.integers(1, 3))
def test_every_mistake_is_one_line_that_names_the_table(folder: Path, data: st.DataObject, edits: int) -> None:
    edited(folder, data, edits)
    for mistake in mistakes(folder):
        one_line(mistake)
        assert ".csv" in mistake.thing


@settings(max_examples=8, suppress_health_check=UNHURRIED)
@given(data=st.data(), edits=st.integers(1, 2))
def test_a_plant_loads_with_finite_numbers_or_not_at_all(folder: Path, data: st.DataObject, edits: int) -> None:
    edited(folder, data, edits)
    plant = read_settings(read_files(folder))
    try:
        graph = build(folder)
        description = read_plant(open_graph(graph), NamedNode(plant.system))
        model = find_model(read_files(folder), plant.model, description)
        refuse_other_model(description, model, plant.twin.settings.horizon_s)
    except GraphError as error:
        one_line(error)
        return
    finite(description)
    for signal in description.signals:
        assert signal.tag.range.low < signal.tag.range.high and signal.tag.scale > 0.0


@pytest.mark.slow
@settings(max_examples=8, suppress_health_check=UNHURRIED)
@given(data=st.data())
def test_what_the_schemas_let_pass_and_what_they_do_not_reach_is_refused_by_the_graph(
    folder: Path, data: st.DataObject
) -> None:
    """The shapes are the second look: they too end in a line, whatever the tables say."""
    edited(folder, data, 1)
    try:
        refuse_incomplete(mapped(folder))
    except GraphError as error:
        assert error.thing and all(line.isprintable() for line in str(error).split("\n"))
