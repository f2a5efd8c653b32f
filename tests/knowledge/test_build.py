"""From tables to the graph: statements, RML, rules, equations, sorted Turtle."""

from __future__ import annotations

import random
import re
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import BlankNode, Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.knowledge.build import build as module
from homeostat.knowledge.build import statements
from homeostat.knowledge.build.build import build, main, refuse_difference, refuse_incomplete
from homeostat.knowledge.build.provenance import MAPPING, is_sealed, namespace_of, sha256, stale_tables
from homeostat.knowledge.build.statements import MAPPED, SCRATCH, stated
from homeostat.knowledge.build.tables.schemas import EVERY, SCHEMAS
from homeostat.knowledge.build.timing import timing_of
from homeostat.knowledge.build.turtle import write_turtle
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.openmath import equation
from homeostat.knowledge.vocabulary.tbox import ontologies
from homeostat.knowledge.vocabulary.vocabulary import HS, PREFIXES, RDF, CPSMod, M
from homeostat.stl.formula import parse_expression
from tests.knowledge.tables import INSTALLED, SYSTEM, TABLES, Rows, Workbench, reactor, store_of
from tests.knowledge.whole import whole

PLANTS = sorted(path.parent for path in INSTALLED.glob("*/case.toml"))
SHIPPED = Path(module.__file__).with_name(MAPPING)
ENGINEERING = sorted((whole("cstr") / "engineering").glob("*.csv"))
MORPH = INSTALLED.parents[2] / ".rml-venv" / "bin" / "python"


def triples_of(graph: bytes) -> frozenset[Triple]:
    return frozenset(quad.triple for quad in parse(graph, format=RdfFormat.TURTLE))


@pytest.fixture
def bench(tmp_path: Path) -> Workbench:
    return Workbench.at(tmp_path / "plant")


@pytest.mark.parametrize("folder", PLANTS, ids=lambda path: path.name)
def test_a_committed_graph_is_what_its_tables_make(folder: Path) -> None:
    assert build(folder) == (folder / "plant.ttl").read_bytes(), f"run 'make graph': {folder}/plant.ttl is out of date"


@pytest.mark.slow
@pytest.mark.parametrize("folder", PLANTS, ids=lambda path: path.name)
def test_an_rml_processor_makes_the_same_triples_of_the_mapping(folder: Path, tmp_path: Path) -> None:
    """Of the tables with every row stated: an RML processor reads what is there."""
    folder = whole(folder.name)
    if not MORPH.is_file():
        pytest.skip("morph-kgc is not installed; 'make graph' installs it and compares")
    text = (
        f"[CONFIGURATION]\nna_values: ,\noutput_file: {tmp_path}/x.nt\noutput_format: N-TRIPLES\n"
        f"logging_level: ERROR\nnumber_of_processes: 1\n[plant]\nmappings: {SHIPPED}\n"
    )
    (tmp_path / "config.ini").write_text(text)
    subprocess.run([MORPH, "-m", "morph_kgc", tmp_path / "config.ini"], cwd=folder, check=True, timeout=240)
    other = frozenset(quad.triple for quad in parse(path=tmp_path / "x.nt", format=RdfFormat.N_TRIPLES))
    own = stated(folder, MAPPED)
    assert own == other and len(own) > 100


def test_the_mapping_and_the_statements_read_every_column_of_every_table_and_no_other() -> None:
    columns = {(name, column) for name, (model, _) in SCHEMAS.items() for column in model.model_fields}
    place = re.compile(r"\{(\w+)\}")
    lines = Path(statements.__file__).with_name("statements.csv").read_text().splitlines()[1:]
    assert {(line.partition(",")[0], column) for line in lines for column in place.findall(line)} == columns
    read = set()
    for part in SHIPPED.read_text().split("rml:logicalSource")[1:]:
        found = re.search(r'rml:source "engineering/(\w+)\.csv"', part)
        assert found
        for column in place.findall(part) + re.findall(r'rml:reference "(\w+)"', part):
            read.add((found[1], column))
    assert read == columns


def test_the_order_of_rows_does_not_matter(bench: Workbench) -> None:
    before = bench.graph()
    rng = random.Random(7)
    for table in TABLES:
        bench.edit(table, lambda rows: rng.sample(rows, len(rows)))
    changed = triples_of(bench.graph()) ^ triples_of(before)
    assert {triple.predicate for triple in changed} == {HS.sha256}


def test_line_ends_do_not_matter(bench: Workbench) -> None:
    before = bench.graph()
    for table in TABLES:
        path = bench.path(table)
        path.write_bytes(path.read_bytes().replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"))
    assert bench.graph() == before


def test_the_graph_uses_defined_terms_and_stable_names_only() -> None:
    triples = triples_of(reactor())
    defined = {quad.subject for _, text in ontologies() for quad in parse(text, format=RdfFormat.TURTLE)}
    namespaces = tuple(iri for _, iri in PREFIXES if "hsu" in iri or "openmath" in iri or "homeostat" in iri)
    for triple in triples:
        used = [triple.predicate] + ([triple.object] if triple.predicate == RDF.type else [])
        for term in used:
            assert isinstance(term, NamedNode)
            assert not term.value.startswith(namespaces) or term in defined, f"{term} is in no ontology"
        assert not isinstance(triple.subject, BlankNode) and not isinstance(triple.object, BlankNode)
        assert SCRATCH not in str(triple)
        assert "sameAs" not in triple.predicate.value


def test_every_table_is_named_as_a_source(bench: Workbench) -> None:
    names = {t.object.value for t in triples_of(bench.graph()) if t.predicate == HS.fileName}
    assert names == {MAPPING, *(f"engineering/{table}.csv" for table in TABLES)}
    assert stale_tables(bench.folder, bench.graph()) == ()


def test_a_changed_or_lost_or_added_source_makes_the_graph_stale(bench: Workbench) -> None:
    graph = bench.graph()
    bench.edit(TABLES[0], lambda rows: rows[1:])
    assert stale_tables(bench.folder, graph) == (f"engineering/{TABLES[0]}.csv",)
    bench.path(TABLES[1]).unlink()
    (bench.folder / "engineering" / "zz.csv").write_text("id\n")
    changed = (*(f"engineering/{name}.csv" for name in TABLES[:2]), "engineering/zz.csv")
    assert stale_tables(bench.folder, graph) == changed


def test_another_mapping_and_another_name_make_the_graph_stale(bench: Workbench) -> None:
    graph = bench.graph()
    assert stale_tables(bench.folder, graph.replace(sha256(SHIPPED.read_bytes()).encode(), b"0" * 64)) == (MAPPING,)
    bench.call("urn:homeostat:other#system")
    assert stale_tables(bench.folder, graph) == ("case.toml",)
    assert stale_tables(bench.folder, bench.graph()) == ()


def test_a_graph_is_sealed_whatever_its_line_ends(bench: Workbench) -> None:
    graph = bench.graph()
    assert is_sealed(graph) and is_sealed(graph.replace(b"\n", b"\r\n"))
    other = graph.replace(b"hs:formula", b"hs:formulb", 1)
    for altered in (b"", graph[:-1], graph + b"\n", graph.rpartition(b"#")[0], other):
        assert not is_sealed(altered)


def test_another_plant_needs_another_name_in_its_settings_and_nothing_else(bench: Workbench) -> None:
    bench.call("urn:homeostat:other#system")
    graph = bench.graph()
    refuse_incomplete(graph)
    assert b"cstr#" not in graph and b"@prefix other: <urn:homeostat:other#> ." in graph
    plant = read_plant(store_of(graph), NamedNode("urn:homeostat:other#system"))
    assert plant.machine.name == "other"
    machine = replace(plant.machine, name="cstr")
    assert replace(plant, machine=machine) == read_plant(store_of(reactor()), SYSTEM)


def test_a_plant_without_settings_is_called_after_its_folder(bench: Workbench) -> None:
    (bench.folder / "case.toml").unlink()
    read_plant(store_of(bench.graph()), NamedNode("urn:homeostat:plant#system"))


def test_no_table_and_no_column_is_left_out_silently(bench: Workbench) -> None:
    bench.edit("signals", lambda rows: rows)
    (bench.folder / "engineering" / "extra.csv").write_text("a\n1\n")
    with pytest.raises(GraphError, match=r"extra.csv: is no table of a plant; the mapping does not read it"):
        build(bench.folder)
    (bench.folder / "engineering" / "extra.csv").unlink()
    path = bench.path("loops")
    path.write_text("\n".join(line + ",note" for line in path.read_text().splitlines()) + "\n")
    with pytest.raises(GraphError, match=r"loops.csv row 1: column 'note' is not known"):
        build(bench.folder)
    path.unlink()
    with pytest.raises(GraphError, match=r"loops.csv: cannot be read"):
        build(bench.folder)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("V9,Actuator,M_Feed", "row 2: needs 4 cells"),
        ("V9,Actuator,M_Feed,a,b", "row 2: needs 4 cells"),
        ("V9 ,Actuator,M_Feed,a", "column 'id' begins or ends with a space"),
        (",Actuator,M_Feed,a", "column 'id' is empty, but names the row"),
        ('"V9,Actuator,M_Feed,a', "cannot be read"),
    ],
)
def test_a_broken_row_is_named(bench: Workbench, line: str, says: str) -> None:
    path = bench.path("equipment")
    header, *rest = path.read_text().splitlines()
    path.write_text("\n".join([header, line, *rest]) + "\n")
    with pytest.raises(GraphError, match=says) as caught:
        bench.graph()
    assert caught.value.code is Code.BAD_TABLE


def test_a_row_without_its_key_is_refused(bench: Workbench) -> None:
    bench.edit("equipment", lambda rows: [rows[0] | {"id": ""}, *rows[1:]])
    with pytest.raises(GraphError, match=r"equipment\.csv row 2 .*id: the cell is empty; fill it") as caught:
        build(bench.folder)
    assert caught.value.code is Code.MISSING_VALUE


def test_a_table_that_is_not_utf8_is_refused(bench: Workbench) -> None:
    path = bench.path("equipment")
    path.write_bytes(path.read_bytes() + b"X9,Sensor,CSTR,\xff\xfe\n")
    with pytest.raises(GraphError, match="cannot be read"):
        bench.graph()


def test_a_row_that_says_nothing_is_refused(bench: Workbench) -> None:
    def emptied(rows: Rows) -> Rows:
        return [*rows, {"symptom": rows[0]["symptom"], "fault": ""}]

    bench.edit("symptom_faults", emptied)
    with pytest.raises(GraphError, match="fault: the cell is empty; fill it"):
        build(bench.folder)


@pytest.mark.parametrize("cell", ["abc", "1e999", "nan", "-inf", "1_000", "1,5"])
def test_a_number_that_is_none_is_named(bench: Workbench, cell: str) -> None:
    bench.edit("parameters", lambda rows: [rows[0] | {"value": cell}, *rows[1:]])
    with pytest.raises(GraphError) as caught:
        bench.graph()
    assert caught.value.code is Code.BAD_NUMBER and bench.rows("parameters")[0]["symbol"] in caught.value.thing


def test_a_difference_from_what_the_mapping_makes_is_refused(bench: Workbench) -> None:
    own = stated(bench.folder, MAPPED)
    refuse_difference(bench.folder, own)
    with pytest.raises(GraphError, match=r"1 triples differ; only mapping\.rml\.ttl makes"):
        refuse_difference(bench.folder, own | {Triple(HS.Tag, HS.name, Literal("x"))})
    with pytest.raises(GraphError, match=r"1 triples differ; only statements\.csv makes"):
        refuse_difference(bench.folder, own - {min(own, key=str)})


def test_the_command_writes_a_complete_graph_and_refuses_a_broken_one(
    bench: Workbench, capsys: pytest.CaptureFixture[str]
) -> None:
    target = bench.folder / module.GRAPH
    assert main([str(bench.folder)]) == 0
    assert target.read_bytes() == bench.graph()
    bench.edit("operators", lambda rows: [rows[0] | {"resource": "nowhere"}, *rows[1:]])
    target.unlink()
    assert main([str(bench.folder)]) == 1
    assert not target.exists()
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "[unknown-component] operators.csv row 2" in said


def test_a_file_that_the_command_cannot_use_is_one_line(
    bench: Workbench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "made.nt").write_text("no triple\n")
    for options in (
        ("--out", str(tmp_path)),
        ("--out", str(tmp_path / "none" / "plant.ttl")),
        ("--triples", str(tmp_path / "none.nt")),
        ("--triples", str(tmp_path / "made.nt")),
        ("--whole", str(tmp_path / "made.nt")),
    ):
        assert main([str(bench.folder), *options]) == 1
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and str(tmp_path) in said


@pytest.mark.parametrize("stated_there", ["deep = " + 5000 * "[" + 5000 * "]", "[time]\ntick_s = 1" + 400 * "0"])
def test_settings_that_cannot_be_read_are_told_by_who_needs_them_and_end_no_build(
    bench: Workbench, stated_there: str
) -> None:
    before = timing_of(bench.folder)
    (bench.folder / "case.toml").write_text(stated_there)
    assert timing_of(bench.folder).tick_s == before.tick_s
    assert namespace_of(bench.folder) == f"urn:homeostat:{bench.folder.name}#"


def test_a_complete_graph_passes_and_an_empty_one_has_no_plant(bench: Workbench) -> None:
    refuse_incomplete(bench.graph())
    without = write_turtle([t for t in triples_of(reactor()) if t.predicate != HS.unit], "cstr", "urn:homeostat:cstr#")
    with pytest.raises(GraphError, match="unit"):
        refuse_incomplete(without)


# ---------------------------------------------------------------- Turtle

TEXTS = st.text(alphabet=st.characters(codec="utf-8"), max_size=12)
NAMES = st.sampled_from(["urn:homeostat:cstr#", HS.iri, "urn:other:"]).flatmap(
    lambda base: st.lists(st.sampled_from([*"aZ0_.-~é", "%41"]), min_size=1, max_size=6).map(
        lambda local: NamedNode(base + "".join(local))
    )
)
LITERALS = st.one_of(
    TEXTS.map(Literal),
    TEXTS.map(lambda text: Literal(text, language="en")),
    st.floats(allow_nan=False, allow_infinity=False).map(Literal),
    st.integers(-(10**15), 10**15).map(Literal),
    st.booleans().map(Literal),
    st.just(Literal("07", datatype=NamedNode("http://www.w3.org/2001/XMLSchema#integer"))),
)


@given(st.lists(st.builds(Triple, NAMES, NAMES | st.just(RDF.type), NAMES | LITERALS), max_size=12), st.randoms())
@settings(max_examples=200)
def test_turtle_says_the_same_whatever_the_order(triples: list[Triple], rng: random.Random) -> None:
    text = write_turtle(triples, "cstr", "urn:homeostat:cstr#")
    assert triples_of(text) == frozenset(triples)
    shuffled = triples + triples[:3]
    rng.shuffle(shuffled)
    assert write_turtle(shuffled, "cstr", "urn:homeostat:cstr#") == text


def test_turtle_refuses_a_blank_node() -> None:
    with pytest.raises(ValueError, match="no stable name"):
        write_turtle([Triple(BlankNode("a"), HS.name, Literal("x"))], "p", "urn:p#")
    with pytest.raises(ValueError, match="no stable name"):
        write_turtle([Triple(HS.Tag, HS.denotes, BlankNode("a"))], "p", "urn:p#")


# ---------------------------------------------------------------- OpenMath

LEAVES = st.sampled_from(["T1", "V2.pos", "UA", "3", "0.25", "1e-3"])
EXPRESSIONS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda x: f"-({x})"),
        inner.map(lambda x: f"abs({x})"),
        st.tuples(inner, inner).map(lambda t: f"min({t[0]}, {t[1]})"),
        st.tuples(inner, inner).map(lambda t: f"max({t[0]}, {t[1]})"),
        inner.map(lambda x: f"({x}) / 7"),
    ),
    max_leaves=10,
)
VALUES = {"T1": 310.5, "V2.pos": 0.3, "UA": 500.0}


def _evaluate(node: NamedNode, graph: Mapping[tuple[NamedNode, NamedNode], NamedNode | Literal]) -> float:
    """The value of an OpenMath object in a graph, by the meaning of the content dictionaries."""
    kind = graph[node, RDF.type]
    if kind == M.Variable:
        return VALUES[graph[node, M.name].value]
    if kind == M.Literal:
        return float(graph[node, M.value].value)
    arguments, cell = [], graph[node, M.arguments]
    while cell != RDF.nil:
        assert isinstance(cell, NamedNode)
        item = graph[cell, RDF.first]
        assert isinstance(item, NamedNode)
        arguments.append(_evaluate(item, graph))
        cell = graph[cell, RDF.rest]
    operations = {
        "arith1#plus": lambda a, b: a + b,
        "arith1#minus": lambda a, b: a - b,
        "arith1#times": lambda a, b: a * b,
        "arith1#divide": lambda a, b: a / b,
        "arith1#unary_minus": lambda a: -a,
        "arith1#abs": abs,
        "minmax1#min": min,
        "minmax1#max": max,
    }
    return operations[graph[node, M.operator].value.removeprefix("http://www.openmath.org/cd/")](*arguments)


@given(EXPRESSIONS)
@settings(max_examples=150)
def test_the_tree_of_an_equation_computes_what_its_text_does(text: str) -> None:
    node = NamedNode("urn:p#E")
    triples = list(equation(node, f"Q = {text}", {"T1": NamedNode("urn:p#tag_T1")}))
    graph = {(t.subject, t.predicate): t.object for t in triples}
    assert len(graph) == len(set(triples)), "a node says two things about one property"
    right = graph[graph[graph[node, M.arguments], RDF.rest], RDF.first]
    assert _evaluate(right, graph) == pytest.approx(parse_expression(text).value(VALUES), rel=1e-12)
    assert ("T1" not in text) or graph[NamedNode("urn:p#variable_T1"), HS.denotes] == NamedNode("urn:p#tag_T1")


def test_a_rate_is_a_derivative() -> None:
    node = NamedNode("urn:p#E")
    graph = {(t.subject, t.predicate): t.object for t in equation(node, "dV/dt = F1 - F2", {})}
    left = graph[graph[node, M.arguments], RDF.first]
    assert graph[left, M.operator] == NamedNode("http://www.openmath.org/cd/calculus1#diff")
    assert graph[graph[left, M.arguments], RDF.first] == NamedNode("urn:p#variable_V")


@pytest.mark.parametrize("text", ["V", "V = ", " = F1", "V == F1", "V = F1 +"])
def test_an_equation_without_two_sides_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"equation|formula|expression"):
        list(equation(NamedNode("urn:p#E"), text, {}))


def test_an_operator_realises_its_equations_and_the_tree_points_at_tags_and_parameters() -> None:
    store = store_of(reactor())
    found = store.select(
        f"SELECT ?equation (COUNT(?meaning) AS ?n) {{ ?operator {CPSMod.processRealizesBehavior} ?equation . "
        f"?equation {M.arguments} ?list . ?list (!<urn:nothing>)* ?variable . ?variable {HS.denotes} ?meaning }} "
        "GROUP BY ?equation"
    )
    assert found and all(row.number("n") >= 1 for row in found)


def test_the_guide_explains_every_column_and_no_other() -> None:
    guide = (INSTALLED.parents[2] / "docs" / "how-to" / "add-a-plant.md").read_text("utf-8")
    explained: dict[str, set[str]] = {}
    table = ""
    for line in guide.splitlines():
        if heading := re.match(r"### `(\w+)\.csv`:|\| column of `(\w+)\.csv` \|", line):
            table = heading[1] or heading[2]
        elif line.startswith("## "):
            table = ""  # what another section lists is no column
        elif table and line.startswith("| `"):
            explained.setdefault(table, set()).update(re.findall(r"`(\w+)`", line.split("|")[1]))
    assert explained == {name: set(model.model_fields) for name, (model, _) in EVERY.items()}
    for path in ENGINEERING:
        assert explained[path.stem] == set(path.read_text("utf-8").splitlines()[0].split(","))
