"""The tables of both plants go through typed schemas: a bad cell is one line with place, value, bound and remedy."""

from __future__ import annotations

import csv
import itertools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from homeostat.cli.main import main as homeostat
from homeostat.knowledge.build.build import main
from homeostat.knowledge.build.tables.cells import Reads, Refers
from homeostat.knowledge.build.tables.check import mistakes, refuse_bad_tables
from homeostat.knowledge.build.tables.reading import OPTIONAL_COLUMNS
from homeostat.knowledge.build.tables.schemas import SCHEMAS
from homeostat.knowledge.store.error import Code, GraphError
from tests.knowledge.tables import INSTALLED, Rows
from tests.knowledge.whole import whole
from tests.plants.copies import Copy

PLANTS = ("cstr", "mixing_module")


def table(folder: Path, name: str) -> tuple[list[str], Rows]:
    with (folder / "engineering" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        return list(reader.fieldnames or ()), list(reader)


def write(folder: Path, name: str, columns: list[str], rows: Rows) -> None:
    with (folder / "engineering" / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n", restval="", extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def places() -> Iterator[tuple[str, str, str]]:
    """Plant, table and column of every column that has a row."""
    for plant in PLANTS:
        for name, (model, _) in SCHEMAS.items():
            if table(whole(plant), name)[1]:
                yield from ((plant, name, column) for column in model.model_fields)


def marks(name: str, column: str) -> list[Any]:
    return list(SCHEMAS[name][0].model_fields[column].metadata)


def is_number(name: str, column: str) -> bool:
    return SCHEMAS[name][0].model_fields[column].annotation in (int, float, float | None)


@pytest.fixture(scope="module", params=PLANTS)
def tables(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of a plant's tables, which every test leaves as it was."""
    folder = tmp_path_factory.mktemp(request.param) / str(request.param)
    shutil.copytree(whole(str(request.param)) / "engineering", folder / "engineering")
    return folder


def found(folder: Path, name: str, cells: dict[str, str], row: int = 0) -> list[GraphError]:
    """What is said where some cells of one row are others."""
    path = folder / "engineering" / f"{name}.csv"
    before = path.read_bytes()
    columns, rows = table(folder, name)
    rows[row] |= cells
    write(folder, name, columns, rows)
    try:
        said = list(mistakes(folder))
    finally:
        path.write_bytes(before)
    assert all("\n" not in str(item) and str(item).isprintable() and len(str(item)) < 600 for item in said)
    return said


def each(folder: Path, fits: Callable[[str, str], bool]) -> Iterator[tuple[str, str]]:
    chosen = [(name, column) for plant, name, column in places() if plant == folder.name and fits(name, column)]
    assert chosen
    return iter(chosen)


@pytest.mark.parametrize("plant", PLANTS)
def test_the_tables_of_the_plants_are_well(plant: str) -> None:
    refuse_bad_tables(INSTALLED / plant)
    refuse_bad_tables(whole(plant))
    assert {path.stem for path in (whole(plant) / "engineering").glob("*.csv")} == SCHEMAS.keys()


def test_a_plant_may_lack_its_prices_and_no_other_table(tmp_path: Path) -> None:
    copy = Copy.whole("cstr", tmp_path)
    (copy.folder / "engineering" / "prices.csv").unlink()
    assert list(mistakes(copy.folder)) == []
    (copy.folder / "engineering" / "prices.csv").write_bytes(b"")
    assert ["prices.csv: needs a header" in str(item) for item in mistakes(copy.folder)] == [True]
    (copy.folder / "engineering" / "prices.csv").unlink()
    (copy.folder / "engineering" / "criteria.csv").unlink()
    assert any("criteria.csv: cannot be read" in str(item) for item in mistakes(copy.folder))


def test_a_cell_that_is_empty(tables: Path) -> None:
    for name, column in each(tables, lambda n, c: SCHEMAS[n][0].model_fields[c].is_required()):
        said = found(tables, name, {column: ""})
        assert said[0].code is Code.MISSING_VALUE and said[0].message == f"{column}: the cell is empty; fill it"
        assert said[0].thing.startswith(f"{name}.csv row 2 (")


@pytest.mark.parametrize(
    "cell", ["nan", "-inf", "1e300", "-1e300", "1e999", "1_0", "1,5", "0x10", "٣", "five", "9" * 500]
)
def test_a_number_that_cannot_be(tables: Path, cell: str) -> None:
    for name, column in each(tables, is_number):
        said = found(tables, name, {column: cell})
        assert said[0].code is Code.BAD_NUMBER and said[0].message.startswith(f"{column}: "), (name, column, said)


def test_a_name_that_no_row_states(tables: Path) -> None:
    for name, column in each(tables, lambda n, c: any(isinstance(mark, Refers) for mark in marks(n, c))):
        said = found(tables, name, {column: "nowhere.1"})
        assert any(item.code.value.startswith("unknown-") and "'nowhere.1' in " in item.message for item in said)


def test_a_formula_that_reads_what_is_not_there(tables: Path) -> None:
    for name, column in each(tables, lambda n, c: any(isinstance(mark, Reads) for mark in marks(n, c))):
        for cell in ("nowhere.1 + 1", "nowhere.1 <= 3"):
            said = found(tables, name, {column: cell})
            assert said and {item.code for item in said} & {Code.UNKNOWN_TAG, Code.UNKNOWN_SYMBOL, Code.BAD_FORMULA}
        (said, *_) = found(tables, name, {column: "T1 <= ("})
        assert said.code is Code.BAD_FORMULA


def test_a_text_with_characters_that_nobody_sees(tables: Path) -> None:
    cells = itertools.cycle(("a\nb", "a\x1b[2Jb", "a\u202eb", "a" * 5000))
    for (name, column), cell in zip(each(tables, lambda n, c: not is_number(n, c)), cells, strict=False):
        assert found(tables, name, {column: cell})


NEEDED_BY_ANOTHER = {("trips", "fastest"): "fallen needs fastest"}
"""Columns that a table may lack only together with another."""


def test_columns_that_are_missing_or_not_known(tables: Path) -> None:
    for name, (model, _) in SCHEMAS.items():
        path = tables / "engineering" / f"{name}.csv"
        before = path.read_bytes()
        columns, rows = table(tables, name)
        for column in model.model_fields:
            optional = column in OPTIONAL_COLUMNS.get(name, ())
            write(tables, name, [c for c in columns if c != column], rows)
            needed = NEEDED_BY_ANOTHER.get((name, column)) if any(r.get("fallen") for r in rows) else None
            lacking = f"{name}.csv row 1: column {column!r} is missing" if not optional else needed
            said = "".join(map(str, list(mistakes(tables))[:1]))
            assert lacking in said if lacking is not None else not said
            write(tables, name, [c if c != column else f"{c}x" for c in columns], rows)
            first, *more = map(str, list(mistakes(tables))[:2])
            assert f"column '{column}x' is not known; did you mean {column!r}" in first
            assert not more if optional else "is missing" in more[0]
        path.write_bytes(before)


ABSURD = [
    ("signals", {"scale": "0"}, Code.BAD_NUMBER, "scale: '0' is outside 1e-09 to 1e+09 (its unit)"),
    ("signals", {"scale": "1e8"}, Code.BAD_NUMBER, "scale 1e+08 is outside"),
    ("signals", {"low": "5", "high": "4"}, Code.REVERSED_RANGE, "low and high: 5 must be below 4"),
    ("signals", {"role": "pv"}, Code.BAD_WORD, "'pv' is none of PV, SP, MV, STATUS"),
    ("signals", {"relation": "measure"}, Code.BAD_WORD, "did you mean 'measures'"),
    ("signals", {"rate_limit": "-1"}, Code.BAD_NUMBER, "more than 0"),
    ("signals", {"tag": "T 1"}, Code.BAD_TABLE, "no name that formulas can use"),
    ("equipment", {"kind": "Sensr"}, Code.BAD_WORD, "did you mean 'Sensor'"),
    ("sensors", {"noise_sd": "-0.5"}, Code.BAD_NUMBER, "cannot be negative"),
    ("parameters", {"sd": "7", "spread": "relative"}, Code.BAD_NUMBER, "a fraction from 0 to 1"),
    ("parameters", {"sd": "1e8", "spread": "absolute"}, Code.BAD_NUMBER, "is more than 10 times the value"),
    ("parameters", {"spread": "absolut"}, Code.BAD_WORD, "did you mean 'absolute'"),
    ("flows", {"direction": "in"}, Code.BAD_WORD, "'in' is none of input, output"),
    ("operators", {"resource": "M_Fed"}, Code.UNKNOWN_COMPONENT, "did you mean 'M_Feed'"),
    ("equations", {"expression": "1 +"}, Code.BAD_FORMULA, "unexpected end"),
    ("states", {"risk": "-1"}, Code.BAD_NUMBER, "no whole number from 0 to 1000"),
    ("states", {"risk": "1.5"}, Code.BAD_NUMBER, "no whole number from 0 to 1000"),
    ("states", {"initial": "true"}, Code.BAD_WORD, "'true' is none of yes, no"),
    ("state_requirements", {"component": "nothing"}, Code.UNKNOWN_COMPONENT, "equipment.csv"),
    ("setpoints", {"low": "1", "high": "0", "design": ""}, Code.REVERSED_RANGE, "1 must not be above 0"),
    ("setpoints", {"design": "1e6"}, Code.SETPOINT_OUTSIDE_RANGE, "what the state admits"),
    ("transitions", {"guard": "maybe("}, Code.BAD_FORMULA, "guard: formula 'maybe('"),
    ("limits", {"kind": "trip limt"}, Code.BAD_WORD, "did you mean 'trip limit'"),
    ("criteria", {"owner": "actor"}, Code.BAD_WORD, "did you mean 'action'"),
    ("criteria", {"asks_after_s": "1e6", "hard": "no"}, Code.BAD_NUMBER, "what is longer asks"),
    ("criteria", {"asks_after_s": "5", "hard": "no"}, Code.BAD_NUMBER, "what is shorter is a transient"),
    ("criteria", {"asks_after_s": "600", "hard": "yes"}, Code.BAD_WORD, "only what has a price can be bettered"),
    ("criteria", {"asks_after_s": "600", "hard": "no"}, Code.LIMIT_LOOKS_AHEAD, "no reading says it; empty the cell"),
    ("prices", {"kind": "limits"}, Code.BAD_WORD, "did you mean 'limit'"),
    ("prices", {"price": "-1"}, Code.BAD_NUMBER, "price: '-1' is outside 0 to 1e+09"),
    ("prices", {"price": "inf"}, Code.BAD_NUMBER, "price: 'inf' is "),
    ("prices", {"price": "nan"}, Code.BAD_NUMBER, "price: 'nan' is "),
    ("prices", {"item": ""}, Code.MISSING_VALUE, "item: the cell is empty; fill it"),
    ("fallbacks", {"step": "0"}, Code.BAD_NUMBER, "its place in the order"),
    ("fallbacks", {"value": "1e12"}, Code.BAD_NUMBER, "nothing in a plant is larger"),
    ("quality", {"stale_s": "1e9"}, Code.BAD_NUMBER, "outside 1 to 60 s"),
    ("quality", {"stale_s": "1e-9"}, Code.BAD_NUMBER, "readings come once per second"),
    ("quality", {"frozen_s": "0.001"}, Code.BAD_NUMBER, "outside 3 to 60 s"),
    ("quality", {"frozen_s": "3600"}, Code.BAD_NUMBER, "noise may repeat a reading"),
    ("quality", {"noise": "", "frozen_s": "10"}, Code.FROZEN_WITHOUT_NOISE, "noise is empty"),
    *(
        (
            "fallbacks",
            {"rate": bad},
            Code.BAD_NUMBER,
            f"rate: '{bad}' is outside 1e-09 to 1e+09 (unit of the tag) per s",
        )
        for bad in ("-1", "0", "1e12")
    ),
    *(
        (
            "fallbacks",
            {"rate": bad},
            Code.BAD_NUMBER,
            f"rate: '{bad}' is no number; write one in (unit of the tag) per s",
        )
        for bad in ("nan", "inf", "fast")
    ),
    ("fallbacks", {"value": "", "rate": "1"}, Code.BAD_NUMBER, "nothing ramps to automatic; empty the cell"),
    *(
        ("trips", {"lead": bad}, Code.BAD_NUMBER, f"lead: '{bad}' is {what}")
        for bad, what in (
            ("-1", "outside 0 to 1e+09"),
            ("nan", "no number"),
            ("inf", "no number"),
            ("soon", "no number"),
        )
    ),
    ("writables", {"fastest": "0"}, Code.BAD_NUMBER, "fastest: '0' is outside 1e-09"),
    ("trips", {"cusum": "-8"}, Code.BAD_NUMBER, "cusum: '-8' is outside 0 to 1e+09"),
    ("trips", {"grace_s": "3600"}, Code.BAD_NUMBER, "nobody may be blind for longer"),
    ("trips", {"lift": "6", "lift_s": "0"}, Code.LIFT_WITHOUT_CARRIER, "lifts nothing"),
    ("trips", {"lift": "6", "lift_s": "3600"}, Code.BAD_NUMBER, "outside 0 to 1800 s"),
    ("writables", {"confirm_s": "0"}, Code.BAD_NUMBER, "outside 1 to 60 s"),
    ("writables", {"confirm_s": "0.5"}, Code.BAD_NUMBER, "it is read back a tick later"),
    ("fallback_limits", {"acts_within_s": "1e-9"}, Code.BAD_NUMBER, "outside 3 to 600 s: it takes three readings"),
    ("fallback_limits", {"acts_within_s": "3600"}, Code.BAD_NUMBER, "what helps later does not help"),
    ("symptoms", {"on_delay_s": "86400"}, Code.BAD_NUMBER, "outside 0 to 3600 s"),
    ("writables", {"ramped_by": "guards"}, Code.BAD_WORD, "did you mean 'guard'"),
    ("faults", {"prior": "7"}, Code.BAD_NUMBER, "prior: '7' is outside 1e-09 to 1 (probability)"),
    ("faults", {"prior": "0"}, Code.BAD_NUMBER, "what cannot happen is no fault"),
    ("faults", {"nominal": "1e6"}, Code.SEVERITY_OUTSIDE_RANGE, "its low and high"),
    ("features", {"window_s": "-5"}, Code.BAD_NUMBER, "outside 0 to 3600 s"),
    ("features", {"accumulation": "", "window_s": "5"}, Code.BAD_TABLE, "others have neither"),
    ("symptoms", {"sigma": "0"}, Code.BAD_NUMBER, "standard deviations"),
    ("symptoms", {"direction": "hihg"}, Code.BAD_WORD, "did you mean 'high'"),
    ("symptom_faults", {"symptom": "S-X"}, Code.UNKNOWN_SYMPTOM, "symptoms.csv"),
]


@pytest.mark.parametrize(("name", "cells", "code", "words"), ABSURD, ids=lambda value: str(value)[:40])
def test_an_absurd_value(tables: Path, name: str, cells: dict[str, str], code: Code, words: str) -> None:
    said = found(tables, name, cells)
    assert said[0].code is code and words in said[0].message and said[0].thing.startswith(f"{name}.csv row 2 (")


def test_the_same_key_twice(tables: Path) -> None:
    for name, (_, key) in SCHEMAS.items():
        _, rows = table(tables, name)
        if len(rows) > 1:
            said = found(tables, name, {column: rows[0][column] for column in key}, row=1)
            assert any(item.code is Code.DUPLICATE_ID and "of row 2" in item.message for item in said), name


def test_a_name_that_another_table_misses_is_said_once(tables: Path) -> None:
    path = tables / "engineering" / "equipment.csv"
    before = path.read_bytes()
    path.write_bytes(b'id,"kind\n')
    try:
        assert [item.code for item in mistakes(tables)] == [Code.BAD_TABLE]
    finally:
        path.write_bytes(before)


def test_the_build_and_graph_check_name_the_cell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = Copy.of("cstr", tmp_path)
    graph = copy.text("plant.ttl")
    copy.replace("engineering/trips.csv", "LIM-T-HIGH,", "LIM-T-HIGH,-")
    copy.replace("engineering/faults.csv", "0.95,0.15,", "0.95,7,")
    assert main([str(copy.folder)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "[bad-number] trips.csv row 2 ('LIM-T-HIGH'): cusum: '-" in said
    assert "(and 1 more)" in said and copy.text("plant.ttl") == graph
    assert homeostat(("graph", "check", str(copy.folder))) == 1
    out = capsys.readouterr().out
    assert "[bad-number] trips.csv row 2" in out and "[bad-number] faults.csv row 2 ('fouling')" in out
    with pytest.raises(GraphError, match=r"trips\.csv row 2"):
        copy.load()
