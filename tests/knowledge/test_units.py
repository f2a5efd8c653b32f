"""Units in QUDT: every symbol of the plants has one, questions go by kind of quantity, and an unknown one is said."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from pyoxigraph import Literal, NamedNode, RdfFormat, Triple

from homeostat.knowledge.build.build import main
from homeostat.knowledge.build.derive import complete
from homeostat.knowledge.build.statements import MAPPED, stated
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.checks.units import unknown_units
from homeostat.knowledge.context.documents import documents
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.vocabulary.units import known_units
from homeostat.knowledge.vocabulary.vocabulary import HS, OWN_UNITS, PREFIXES, QUDT, RDF
from tests.cli.command import homeostat
from tests.knowledge.tables import INSTALLED, Rows, Workbench, reactor, store_of
from tests.knowledge.whole import whole

PLANTS = sorted(path.parent for path in INSTALLED.glob("*/case.toml"))
PREAMBLE = "".join(f"PREFIX {prefix}: <{iri}>\n" for prefix, iri in PREFIXES)
UNITS = {
    "signals": "unit",
    "parameters": "unit",
    "sensors": "noise_unit",
    "faults": "severity_unit",
    "features": "unit",
}


def store_at(folder: Path) -> EmbeddedStore:
    store = EmbeddedStore()
    store.load((folder / "plant.ttl").read_bytes(), RdfFormat.TURTLE)
    return store


@pytest.mark.parametrize("folder", PLANTS, ids=lambda path: path.name)
def test_every_symbol_of_every_table_is_known(folder: Path) -> None:
    for table, column in UNITS.items():
        with (whole(folder.name) / "engineering" / f"{table}.csv").open(encoding="utf-8", newline="") as file:
            assert {row[column] for row in csv.DictReader(file)} <= known_units().keys(), table


@pytest.mark.parametrize("folder", PLANTS, ids=lambda path: path.name)
def test_every_tag_and_parameter_has_one_unit_of_qudt(folder: Path) -> None:
    store = store_at(folder)
    rows = store.select(f"SELECT ?x ?symbol ?unit {{ ?x {HS.unit} ?symbol OPTIONAL {{ ?x {QUDT.hasUnit} ?unit }} }}")
    assert len(rows) > 50 and len({row.iri("x") for row in rows}) == len(rows)
    for row in rows:
        assert row.iri("unit") == known_units()[row.text("symbol")].unit
    assert unknown_units(store) == () and lint(store) == () and check_shapes(store) == ()


def test_all_temperatures_are_found_by_their_kind() -> None:
    question = "SELECT ?name { ?tag a hs:Tag ; hs:name ?name ; qudt:hasQuantityKind quantitykind:Temperature }"
    found = {row.text("name") for row in store_of(reactor()).select(PREAMBLE + question)}
    assert found == {"T1", "T2", "T3", "T1.sp", "T1.err"}


def test_a_unit_that_qudt_has_not_is_described_in_the_graph() -> None:
    question = (
        "SELECT ?symbol ?code { cp: qudt:hasUnit ?u . ?u a qudt:Unit ; rdfs:label ?symbol ; qudt:ucumCode ?code }"
    )
    asked = question.replace("cp:", "<urn:homeostat:cstr#parameter_cp>")
    (row,) = store_of(reactor()).select(PREAMBLE + asked)
    assert (row.text("symbol"), row.text("code")) == ("J/(L K)", "J.L-1.K-1")


def test_the_table_of_units_has_each_symbol_once_and_says_what_is_our_own() -> None:
    with (INSTALLED.parent / "knowledge" / "vocabulary" / "units.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(known_units()) > 40 and all(None not in row.values() for row in rows)
    units = known_units().values()
    assert len({unit.unit for unit in units}) == len(units)
    assert all(unit.unit.value.startswith((OWN_UNITS, "http://qudt.org/vocab/unit/")) for unit in units)
    assert all(unit.own or not unit.ucum for unit in units)
    kinds = [unit.kind.value for unit in units if unit.kind is not None]
    assert all(kind.startswith("http://qudt.org/vocab/quantitykind/") for kind in kinds) and len(kinds) > 20


def test_concentrations_by_mass_are_units_of_qudt() -> None:
    assert {"g/L", "mg/L", "kg/m3"} <= known_units().keys()


def test_units_follow_from_what_is_stated_and_are_not_stated() -> None:
    said = stated(PLANTS[0], MAPPED)
    assert not any(triple.predicate in QUDT for triple in said)
    assert {t for t in complete(said) if t.predicate == QUDT.hasUnit}
    tag = NamedNode("urn:p#tag")
    made = complete([Triple(tag, RDF.type, HS.Tag), Triple(tag, HS.unit, Literal("furlong"))])
    assert not any(triple.predicate in QUDT for triple in made)


def test_documents_say_units_as_they_did() -> None:
    told = " ".join(document.text for document in documents(store_of(reactor()), "urn:homeostat:cstr#"))
    assert "quantity" not in told.casefold() and "MOL-PER" not in told and "L/s" in told


def in_furlongs(rows: Rows) -> Rows:
    return [row | {"unit": "kPA"} if row["symbol"] in ("tau_V1", "tau_P1") else row for row in rows]


def test_an_unknown_unit_is_a_warning_with_the_nearest_symbol_and_refuses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Workbench.at(tmp_path / "cstr")
    bench.edit("parameters", in_furlongs)
    assert main([str(bench.folder)]) == 0
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "warning: unit 'kPA': 'parameter_tau_P1' and 1 more have it" in said
    assert "did you mean 'kPa'" in said or "'kPa'" in said
    done = homeostat("graph", "check", "--graph", str(bench.folder / "plant.ttl"), cwd=tmp_path)
    assert done.status == 0 and done.out.splitlines()[-1].endswith("plant.ttl: no problem, 1 unknown unit")
    assert done.out.count("warning: unit 'kPA'") == 1


def test_whoever_names_the_unit_in_qudt_needs_no_row() -> None:
    store = EmbeddedStore()
    store.update(f"{PREAMBLE} INSERT DATA {{ <urn:p#x> a hs:Tag ; hs:unit 'ft' ; qudt:hasUnit unit:FT }}")
    assert unknown_units(store) == ()
    store.update(f"INSERT DATA {{ <urn:p#y> {HS.unit} 'ft' }}")
    (line,) = unknown_units(store)
    assert line.startswith("unit 'ft': 'y' has it")
