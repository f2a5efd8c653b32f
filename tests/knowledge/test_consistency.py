"""Every table, broken in every way that was thought of, is refused with the name of the mistake."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Limits
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.checks.consistency import ModelInterface, inconsistencies, refuse_inconsistent
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.plant import load_plant
from homeostat.stl.formula import parse
from tests.knowledge.mistakes import BROKEN, Change, nothing
from tests.knowledge.tables import SYSTEM, TABLES, Workbench, reactor, store_of


def _model() -> ModelInterface:
    model = load_plant("cstr", learned=False).model
    readings = model.readings(np.zeros(len(model.states)), np.zeros(len(model.inputs)))
    return ModelInterface(
        parameters=frozenset(model.parameters),
        variables=frozenset(readings) | frozenset(model.states) | frozenset(model.inputs),
        faults=frozenset(model.faults),
        horizon_s=3600.0,
    )


MODEL = _model()


@pytest.fixture
def bench(tmp_path: Path) -> Workbench:
    return Workbench.at(tmp_path / "plant")


@pytest.fixture(scope="module")
def plant() -> PlantDescription:
    return read_plant(store_of(reactor()), SYSTEM)


def _mistakes(bench: Workbench) -> set[Code]:
    """What building, reading, comparing and the shapes say, in that order, up to the first that says something."""
    try:
        store = store_of(bench.graph())
        plant = read_plant(store, SYSTEM)
    except GraphError as error:
        assert "\n" not in str(error) and error.thing
        return {error.code}
    found = inconsistencies(plant, MODEL)
    if found:
        assert all("\n" not in str(item) and item.thing for item in found)
        return {item.code for item in found}
    return {Code.BAD_SHAPE} if check_shapes(store) else set()


ALIKE = [each for k, each in enumerate(BROKEN) if k % 3]
FIRST = {key: each for each in reversed(ALIKE) for key in (each[0], each[3])}
"""Table, and mistake -> the first of the ways to make it that are much as others are."""


@pytest.mark.parametrize(
    ("table", "how", "change", "code"),
    [
        pytest.param(*each, marks=pytest.mark.wide if each in ALIKE and each not in FIRST.values() else [])
        for each in BROKEN
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_broken_table_is_refused_with_the_name_of_the_mistake(
    bench: Workbench, table: str, how: str, change: Change, code: Code
) -> None:
    bench.edit(table, change)
    assert code in _mistakes(bench)


def test_a_plant_without_a_fallback_is_refused(bench: Workbench) -> None:
    bench.edit("fallbacks", nothing)
    bench.edit("fallback_limits", nothing)
    assert Code.NO_FALLBACK in _mistakes(bench)


def test_every_table_is_broken_here_and_the_tables_as_they_are_are_not(bench: Workbench) -> None:
    assert {table for table, *_ in BROKEN} == set(TABLES)
    assert _mistakes(bench) == set()


def test_every_code_is_met_by_some_test() -> None:
    elsewhere = {
        Code.BAD_MAPPING, Code.STALE_GRAPH, Code.MISSING_FAULT, Code.ALTERED, Code.BAD_BASELINE, Code.UNKNOWN_SYMPTOM,
        Code.NO_FALLBACK,
    }  # fmt: skip
    # What only a graph that was not built from tables can have: `test_lint` and `test_reference_graphs`.
    of_any_graph = {
        Code.DANGLING_REFERENCE, Code.UNKNOWN_TERM, Code.UNREACHED_COMPONENT, Code.TRANSITION_WITHOUT_CONDITION,
        Code.SWAPPED_PREFIX,
    }  # fmt: skip
    assert set(Code) - {code for *_, code in BROKEN} == elsewhere | of_any_graph


def test_refusing_names_the_first_and_counts_the_rest(plant: PlantDescription) -> None:
    refuse_inconsistent(plant, MODEL)
    with pytest.raises(GraphError, match=r"^\[missing-parameter\] parameter 'Zx': [^()]*$"):
        refuse_inconsistent(plant, replace(MODEL, parameters=MODEL.parameters | {"Zx"}))
    other = ModelInterface(MODEL.parameters | {"Zx"}, MODEL.variables, MODEL.faults | {"gremlin"}, MODEL.horizon_s)
    assert [item.code for item in inconsistencies(plant, other)] == [Code.MISSING_PARAMETER, Code.MISSING_FAULT]
    with pytest.raises(GraphError, match=r"^\[missing-parameter\] parameter 'Zx': .* \(and 1 more\)$"):
        refuse_inconsistent(plant, other)


@pytest.mark.parametrize(
    ("formula", "needs_s"),
    [
        ("always (T1 <= 310)", 0.0),
        ("always[30,60] (T1 <= 310)", 60.0),
        ("eventually[0,50] always[0,60] (T1 <= 310)", 110.0),
        ("eventually[0,50] always (T1 <= 310)", 50.0),
        ("always[0,20] (T1 <= 310) and always[0,70] (T1 >= 300)", 70.0),
        ("always[0,70] (T1 <= 310) and always[0,20] (T1 >= 300)", 70.0),
        ("(T1 <= 310) until[0,40] (T1 >= 300)", 40.0),
        ("eventually (always[0,15] (T1 <= 310))", 15.0),
    ],
)
def test_a_criterion_must_fit_into_the_rollout(plant: PlantDescription, formula: str, needs_s: float) -> None:
    rule = replace(plant.limits.criteria[0], formula=parse(formula, {tag.name: tag for tag in plant.tags}))
    described = replace(plant, limits=Limits(plant.limits.limits, (rule,)), prices=())
    fits, short = (replace(MODEL, horizon_s=horizon) for horizon in (needs_s, math.nextafter(needs_s, -1.0)))
    assert inconsistencies(described, fits) == ()
    assert [item.code for item in inconsistencies(described, short)] == [Code.CRITERION_WINDOW_BEYOND_HORIZON]
