"""What is read from the graph is what the tables say, wherever the graph is kept."""

from __future__ import annotations

import csv
from collections.abc import Callable

import pytest
from pyoxigraph import NamedNode, RdfFormat

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import Command
from homeostat.knowledge.description.behaviour import fallback_strategies, limits, state_machine
from homeostat.knowledge.description.diagnosis import faults, features, symptom_rules
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.description.structure import components, equations, loops, model_parameters, signals
from homeostat.knowledge.store.endpoint import SparqlEndpoint
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.vocabulary import HS
from homeostat.stl.constants import filled
from homeostat.stl.formula import Expression, Formula, parse, parse_expression
from homeostat.stl.text import render
from tests.knowledge.tables import SYSTEM, Rows, reactor, store_of
from tests.knowledge.whole import whole


def table(name: str) -> Rows:
    with (whole("cstr") / "engineering" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def number(cell: str) -> float | None:
    return float(cell) if cell else None


@pytest.fixture(scope="module")
def plant() -> PlantDescription:
    return read_plant(store_of(reactor()), SYSTEM)


def in_numbers(text: str, read: Callable[[str], Formula | Expression] = parse) -> str:
    """What a table says, with numbers in place of the parameters that it names."""
    values = {row["symbol"]: float(row["value"]) for row in table("parameters")}
    return render(filled(read(text).root, values)) if text and read(text).tags & values.keys() else text


def test_components_and_tags(plant: PlantDescription) -> None:
    assert {(c.name, str(c.kind), c.part_of or "", c.label) for c in plant.components} == {
        (row["id"], row["kind"], row["part_of"], row["label"]) for row in table("equipment")
    }
    assert {
        (t.name, str(t.role), t.unit, t.range.low, t.range.high, t.scale, t.rate_limit, t.increment, t.description)
        for t in plant.tags
    } == {
        (
            row["tag"], row["role"], row["unit"], float(row["low"]), float(row["high"]), float(row["scale"]),
            number(row["rate_limit"]), number(row["increment"]), row["description"],
        )
        for row in table("signals")
    }  # fmt: skip
    assert {(s.tag.name, s.component, str(s.relation), s.variable) for s in plant.signals} == {
        (row["tag"], row["component"], row["relation"], row["variable"]) for row in table("signals")
    }
    assert plant.name == next(row["id"] for row in table("equipment") if row["kind"] == "System")


def test_loops_and_equations(plant: PlantDescription) -> None:
    columns = ("id", "controller", "pv", "sp", "mv", "gain", "reset", "label")
    found = {
        (p.name, p.controller, p.process_variable, p.setpoint, p.manipulated_variable, p.gain, p.reset, p.label)
        for p in plant.loops
    }
    assert found == {tuple(row[column] for column in columns) for row in table("loops")}
    assert {(e.name, e.operator, e.result, e.expression.text, e.label) for e in plant.equations} == {
        (row["id"], row["operator"], row["result"], row["expression"], row["label"]) for row in table("equations")
    }


def test_the_state_machine(plant: PlantDescription) -> None:
    machine = plant.machine
    rows = {row["id"]: row for row in table("states")}
    assert {state.name for state in machine.states} == set(rows)
    for state in machine.states:
        row = rows[state.name]
        assert (state.label, state.risk, state.settled_when.text) == (
            row["label"],
            int(row["risk"]),
            row["settled_when"],
        )
        assert (state.initial, state.recovery_target) == (row["initial"] == "yes", row["recovery_target"] == "yes")
        assert state.requires == {
            need["component"] for need in table("state_requirements") if need["state"] == state.name
        }
        assert set(state.setpoints) == {
            SetpointRange(r["tag"], float(r["low"]), float(r["high"]), number(r["design"]))
            for r in table("setpoints")
            if r["state"] == state.name
        }
    assert {(t.name, t.source, t.target, t.event, t.guard.text) for t in machine.transitions} == {
        (row["id"], row["source"], row["target"], row["event"], row["guard"]) for row in table("transitions")
    }


def test_limits_and_criteria(plant: PlantDescription) -> None:
    assert {(x.name, str(x.kind), x.hard, x.formula.text, x.source, x.description) for x in plant.limits.limits} == {
        (row["id"], row["kind"], row["hard"] == "yes", in_numbers(row["formula"]), row["source"], row["description"])
        for row in table("limits")
    }
    assert {(x.name, str(x.owner), x.hard, x.formula.text, x.source, x.description) for x in plant.limits.criteria} == {
        (row["id"], row["owner"], row["hard"] == "yes", in_numbers(row["formula"]), row["source"], row["description"])
        for row in table("criteria")
    }
    assert all(limit.formula.unit for limit in plant.limits.limits), "formulas are read with the tags, so have a unit"


def test_prices(plant: PlantDescription) -> None:
    rows = table("prices")
    assert {(str(x.kind), x.subject, x.amount) for x in plant.prices} == {
        (row["kind"], row["item"], number(row["price"])) for row in rows
    }
    assert len(plant.prices) == len(rows)


def test_diagnosis(plant: PlantDescription) -> None:
    assert {
        (
            f.name, f.label, f.component, f.disables or "", f.severity_unit, f.severity_nominal,
            f.severity_range.low, f.severity_range.high, f.prior, f.description,
        )
        for f in plant.faults
    } == {
        (
            row["id"], row["label"], row["component"], row["disables"], row["severity_unit"], float(row["nominal"]),
            float(row["low"]), float(row["high"]), float(row["prior"]), row["description"],
        )
        for row in table("faults")
    }  # fmt: skip
    assert {
        (
            f.name, f.accumulation.text if f.accumulation else "", f.expression.text, f.window_s, f.filter_s, f.unit,
            f.component,
        )
        for f in plant.features
    } == {
        (
            row["id"], *(in_numbers(row[name], parse_expression) for name in ("accumulation", "expression")),
            float(row["window_s"]), float(row["filter_s"]),
            row["unit"], row["component"],
        )
        for row in table("features")
    }  # fmt: skip
    assert {
        (r.name, r.feature, str(r.direction), r.sigma, r.threshold, r.on_delay_s, r.description)
        for r in plant.symptom_rules
    } == {
        (
            row["id"], row["feature"], row["direction"], float(row["sigma"]), float(row["threshold"]),
            float(row["on_delay_s"]), row["description"],
        )
        for row in table("symptoms")
    }  # fmt: skip
    pairs = {(row["symptom"], row["fault"]) for row in table("symptom_faults")}
    assert {(rule.name, fault) for rule in plant.symptom_rules for fault in rule.faults} == pairs


def test_parameters_with_their_uncertainty(plant: PlantDescription) -> None:
    expected = {}
    for row in table("parameters"):
        value, sd = float(row["value"]), float(row["sd"])
        relative = row["spread"] == "relative"
        expected[row["symbol"]] = (value, row["unit"], abs(value) * sd if relative else sd, row["description"])
    found = {p.symbol: (p.value, p.unit, p.sd, p.description) for p in plant.parameters}
    for row in table("sensors"):
        value, unit, sd, _ = found.pop(row["parameter_bias"])
        assert (value, unit, sd) == (0.0, row["noise_unit"], float(row["bias_sd"]))
        shared = [r["component"] for r in table("sensors") if r["parameter_noise"] == row["parameter_noise"]]
        parameter = next(p for p in plant.parameters if p.symbol == row["parameter_noise"])
        assert (parameter.value, parameter.sd, parameter.component) == (float(row["noise_sd"]), 0.0, min(shared))
    assert {symbol: entry for symbol, entry in found.items() if symbol in expected} == expected
    assert len({p.symbol for p in plant.parameters}) == len(plant.parameters)


def test_fallbacks_in_the_order_of_their_steps(plant: PlantDescription) -> None:
    rates = {row["tag"]: number(row["rate_limit"]) for row in table("signals")}
    for strategy in plant.fallback_strategies:
        rows = [row for row in table("fallbacks") if row["strategy"] == strategy.name]
        rows.sort(key=lambda row: int(row["step"]))
        assert strategy.actions.commands == tuple(
            Command(row["tag"], number(row["value"]), number(row["rate"]) or rates[row["tag"]]) for row in rows
        )
        assert strategy.actions.target == "shutdown"
    assert {s.name for s in plant.fallback_strategies} == {row["strategy"] for row in table("fallbacks")}


def test_the_parts_are_the_whole(plant: PlantDescription) -> None:
    store = store_of(reactor())
    assert signals(store, SYSTEM) == plant.signals
    known = {signal.tag.name: signal.tag for signal in signals(store, SYSTEM)}
    assert tuple(known.values()) == plant.tags
    assert components(store, SYSTEM) == plant.components
    assert loops(store, SYSTEM) == plant.loops
    assert equations(store, SYSTEM) == plant.equations
    assert state_machine(store, SYSTEM, known) == plant.machine
    assert limits(store, SYSTEM, known) == plant.limits
    assert faults(store, SYSTEM) == plant.faults
    assert features(store, SYSTEM, known) == plant.features
    assert symptom_rules(store, SYSTEM) == plant.symptom_rules
    assert model_parameters(store, SYSTEM) == plant.parameters
    assert fallback_strategies(store, SYSTEM) == plant.fallback_strategies


def test_a_remote_store_tells_the_same(oxigraph: str, plant: PlantDescription) -> None:
    store = SparqlEndpoint.oxigraph(oxigraph)
    store.update("CLEAR ALL")
    store.load(reactor(), RdfFormat.TURTLE)
    assert read_plant(store, SYSTEM) == plant


def test_two_plants_in_one_store_do_not_mix(plant: PlantDescription) -> None:
    store = store_of(reactor())
    twin = reactor().replace(b"urn:homeostat:cstr#", b"urn:homeostat:other#").replace(b'"K"', b'"degC"')
    store.load(twin, RdfFormat.TURTLE)
    assert read_plant(store, SYSTEM) == plant
    other = read_plant(store, NamedNode("urn:homeostat:other#system"))
    assert other != plant and len(other.parameters) == len(plant.parameters)
    assert {tag.unit for tag in other.tags} & {"K", "degC"} == {"degC"}


def test_a_plant_that_is_not_there_is_named() -> None:
    with pytest.raises(GraphError, match=r"system 'urn:homeostat:cstr#sytem': is not in the graph") as caught:
        read_plant(store_of(reactor()), NamedNode("urn:homeostat:cstr#sytem"))
    assert caught.value.code is Code.MISSING_VALUE


@pytest.mark.parametrize("value", ['"INF"^^xsd:double', '"NaN"^^xsd:double', '"much"', "<urn:x>"])
def test_a_number_that_is_none_is_refused_whoever_wrote_the_graph(value: str) -> None:
    store = store_of(reactor())
    store.update(
        "PREFIX xsd: <http://www.w3.org/2001/XMLSchema#> "
        f"DELETE {{ ?s {HS.sigma} ?old }} INSERT {{ ?s {HS.sigma} {value} }} WHERE {{ ?s {HS.sigma} ?old }}"
    )
    with pytest.raises(GraphError, match="sigma"):
        symptom_rules(store, SYSTEM)
