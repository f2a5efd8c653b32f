"""Former names: graphs and tables that were made with them give the same rules as those of today."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pyoxigraph import RdfFormat, parse

from homeostat.cli.main import main
from homeostat.domain.plant.limits import LimitKind
from homeostat.knowledge.build.build import build
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.graph_file import load_file
from homeostat.knowledge.vocabulary.former import COLUMNS, TERMS, WORDS
from homeostat.knowledge.vocabulary.vocabulary import HS
from homeostat.plants.files.graph import open_graph
from tests.knowledge.tables import CSTR, SYSTEM, Workbench

NEW = (CSTR / "plant.ttl").read_text(encoding="utf-8")


def former(text: str) -> str:
    """The graph ``text`` as it was before."""
    for old, new in TERMS.items():
        text, count = re.subn(rf"\bhs:{new.value.removeprefix(HS.iri)}\b", f"hs:{old.value.removeprefix(HS.iri)}", text)
        assert count
    return text


def test_a_graph_with_former_terms_gives_the_same_rules(tmp_path: Path) -> None:
    old = former(NEW)
    assert "hs:Interlock" in old and "hs:deadband" in old and old != NEW
    expected = read_plant(open_graph(NEW.encode()), SYSTEM)
    assert expected.limits.of_kind(LimitKind.TRIP_LIMIT) and any(rule.threshold for rule in expected.symptom_rules)
    assert read_plant(open_graph(old.encode()), SYSTEM) == expected
    (tmp_path / "old.ttl").write_text(old, encoding="utf-8")
    store = EmbeddedStore()
    load_file(store, tmp_path / "old.ttl")
    assert read_plant(store, SYSTEM) == expected


def test_tables_with_former_names_give_the_same_graph(tmp_path: Path) -> None:
    bench = Workbench.at(tmp_path / "plant")
    for table, names in COLUMNS.items():
        text = bench.path(table).read_text(encoding="utf-8")
        for old, new in names.items():
            text = text.replace(f",{new},", f",{old},", 1)
        bench.path(table).write_text(text, encoding="utf-8")
    for table, columns in WORDS.items():
        for column, words in columns.items():
            back = {new: old for old, new in words.items()}
            bench.edit(table, lambda rows: [{**r, column: back.get(r[column], r[column])} for r in rows])  # noqa: B023
    assert ",deadband," in bench.path("symptoms").read_text() and ",interlock," in bench.path("limits").read_text()
    today = build(Workbench.at(tmp_path / "today").folder)
    now, old = (
        {quad.triple for quad in parse(graph, format=RdfFormat.TURTLE)} for graph in (today, build(bench.folder))
    )
    assert {triple.predicate for triple in now ^ old} == {HS.sha256}


def test_a_table_with_both_names_of_a_column_is_refused(tmp_path: Path) -> None:
    bench = Workbench.at(tmp_path / "plant")
    path = bench.path("symptoms")
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([f"{lines[0]},deadband", *(f"{line},1" for line in lines[1:])]), encoding="utf-8")
    with pytest.raises(GraphError, match="needs a header of different column names") as refused:
        build(bench.folder)
    assert refused.value.code is Code.BAD_TABLE and "'deadband (threshold)'" in str(refused.value)


@pytest.mark.parametrize("content", ["", "\n\n"])
def test_a_table_that_is_empty_has_no_header(tmp_path: Path, content: str) -> None:
    bench = Workbench.at(tmp_path / "plant")
    bench.path("symptoms").write_text(content, encoding="utf-8")
    with pytest.raises(GraphError, match=r"needs a header of different column names, has \[\]"):
        build(bench.folder)


FORMER = [(table, old, new) for table, names in COLUMNS.items() for old, new in names.items()]


@pytest.mark.parametrize(("cell", "wrong"), [("much", "is no number"), ("", "the cell is empty"), (" 1", "a space")])
@pytest.mark.parametrize(("table", "old", "new"), FORMER)
def test_a_bad_cell_is_named_by_the_column_of_the_file(
    tmp_path: Path, table: str, old: str, new: str, cell: str, wrong: str
) -> None:
    bench = Workbench.at(tmp_path / "plant")
    bench.edit(table, lambda rows: [{**rows[0], new: cell}, *rows[1:]])
    with pytest.raises(GraphError, match=wrong) as today:
        build(bench.folder)
    assert new in str(today.value) and old not in str(today.value)
    text = bench.path(table).read_text(encoding="utf-8")
    bench.path(table).write_text(text.replace(f",{new},", f",{old},", 1), encoding="utf-8")
    with pytest.raises(GraphError, match=wrong) as before:
        build(bench.folder)
    assert f"{table}.csv row 2" in str(before.value) and f"{old} ({new})" in str(before.value)


def test_a_former_name_is_no_name_of_today() -> None:
    assert not any(old in HS for old in TERMS) and all(new in HS for new in TERMS.values())


def test_a_question_with_a_former_term_is_told_the_term_of_today(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph", "query", "cstr", "-e", "SELECT ?s WHERE { ?s hs:deadband ?d }"]) == 0
    assert capsys.readouterr().err == "homeostat: hs:deadband is called hs:threshold today; ask for that\n"
