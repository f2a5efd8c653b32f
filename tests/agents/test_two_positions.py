"""What opens or closes is commanded to one end or the other: by the search, and by nobody else past the guard."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.checks import command_findings
from homeostat.agents.probing.moves import _stands_in
from homeostat.agents.search.candidates import SearchSpace
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.domain.recovery import ActionSet, Command
from homeostat.guard.requests.verification import command_finding
from homeostat.knowledge.checks.consistency_commands import _leads_across
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.guarding import rules_of
from tests.evaluate.two_tanks import change, tanks

HEATER = "H1.man"
POSITIONS = (None, 0.0, 1.0)
"""What a heater that is switched may be commanded, automatic included."""


def switched(where: Path) -> Path:
    """The two tanks with a heater that is on or off by hand."""
    folder = tanks(where)
    (folder / "engineering" / "signals.csv").write_text(f"tag,increment\n{HEATER},1\n")
    return folder


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    return load_plant(str(switched(tmp_path_factory.mktemp("switched"))), learned=False)


@pytest.fixture(scope="module")
def space(plant: Plant) -> SearchSpace:
    return SearchSpace(plant.description.machine.state("adjusted"), plant.description.tags_by_name)


@given(st.floats(-1.0, 2.0), st.sampled_from([None, 0.01, 0.5, 0.99]))
def test_what_is_nearest_can_be_commanded(value: float, increment: float | None) -> None:
    valve = Tag("XV1.cmd", Role.MV, "1", Range(0.0, 1.0), 1.0, increment=1.0)
    assert valve.two_position and valve.nearest(value) == float(value >= 0.5)
    throttled = replace(valve, increment=increment)
    assert not throttled.two_position and throttled.nearest(value) == value


def test_a_setpoint_with_a_coarse_step_has_no_two_positions() -> None:
    assert not Tag("T1.sp", Role.SP, "degC", Range(0.0, 5.0), 1.0, increment=10.0).two_position


def test_it_steps_and_its_command_is_told_from_its_position(plant: Plant) -> None:
    d = plant.description
    assert d.tag(HEATER).two_position and d.tag(HEATER).rate_limit is None
    assert d.writables[HEATER].tolerance == pytest.approx(0.005)


@given(values=st.dictionaries(st.just(HEATER), st.floats(-0.5, 1.5)), fraction=st.floats(1e-4, 0.5))
def test_a_search_tries_both_positions_and_nothing_between(
    space: SearchSpace, values: dict[str, float], fraction: float
) -> None:
    k = [r.tag for r in space.ranges].index(HEATER)
    present = space.present(values)
    first = space.first(present)
    on = (*present[:k], 1.0, *present[k + 1 :])
    around = [*space.around(space.design, fraction), *space.around(on, fraction)]
    assert {point[k] for point in first} == set(POSITIONS) and {point[k] for point in around} == set(POSITIONS)
    assert not any(command_findings(space.actions(point), space.state, space.tags) for point in (*first, *around))


@pytest.mark.parametrize("value", [0.4, 0.999, 1e-6])
def test_nobody_commands_what_is_between(plant: Plant, space: SearchSpace, value: float) -> None:
    command, rules = Command(HEATER, value, None), rules_of(plant)
    by_guard = command_finding(command, space.state.setpoint(HEATER), space.state.name, rules)
    (by_agents,) = command_findings(ActionSet((command,), space.state.name), space.state, space.tags)
    for found in (by_guard, by_agents):
        assert found is not None and found.criterion == "CHK-RANGE" and "it has two positions, 0 and 1" in found.message
    for ends in (0.0, 1.0):
        ending = replace(command, value=ends)
        assert command_finding(ending, space.state.setpoint(HEATER), space.state.name, rules) is None


@pytest.mark.parametrize(
    ("table", "before", "after"),
    [
        ("setpoints", "adjusted,H1.man,0,1,", "adjusted,H1.man,0,0.5,"),
        ("setpoints", "adjusted,H1.man,0,1,", "adjusted,H1.man,0,1,0.5"),
        ("fallbacks", "stop,,H1.man,0", "stop,,H1.man,0.2"),
    ],
)
def test_tables_state_positions(tmp_path: Path, table: str, before: str, after: str) -> None:
    folder = switched(tmp_path)
    change(folder, f"engineering/{table}.csv", before, after)
    with pytest.raises(GraphError, match="is neither of its two positions, 0 and 1") as refused:
        load_plant(str(folder), learned=False)
    assert "signals.csv" in str(refused.value)


def test_a_guard_that_ramps_needs_what_is_between(tmp_path: Path) -> None:
    folder = switched(tmp_path)
    (folder / "engineering" / "signals.csv").write_text(f"tag,increment,rate_limit\n{HEATER},1,0.05\n")
    (folder / "engineering" / "writables.csv").write_text(f"tag,ramped_by\n{HEATER},guard\n")
    with pytest.raises(GraphError, match="has two positions and is ramped by the guard"):
        load_plant(str(folder), learned=False)


@pytest.mark.parametrize(
    ("low", "high", "increment", "across"),
    [(0.0, 1.0, 1.0, True), (0.0, 100.0, 100.0, True), (-1.0, 1.0, 2.0, False), (20.0, 100.0, 80.0, False)],
)
def test_a_step_leads_from_one_end_to_the_other(low: float, high: float, increment: float, across: bool) -> None:
    """What a language model says is a whole multiple of the step."""
    tag = Tag("XV1.cmd", Role.MV, "1", Range(low, high), 1.0, increment=increment)
    assert tag.two_position and _leads_across(tag) is across


def test_a_step_of_one_per_cent_keeps_its_rate(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    (folder / "engineering" / "signals.csv").write_text(f"tag,low,high,increment\n{HEATER},0,100,1\n")
    for state in ("holding", "adjusted"):
        change(folder, "engineering/setpoints.csv", f"{state},H1.man,0,1,", f"{state},H1.man,0,100,")
    tag = load_plant(str(folder), learned=False).description.tag(HEATER)
    assert not tag.two_position and tag.rate_limit is not None


def test_from_between_nothing_is_tried(space: SearchSpace) -> None:
    point = [None if r.design is None else r.design for r in space.ranges]
    point[[r.tag for r in space.ranges].index(HEATER)] = 1.0
    standing = {r.tag: v for r, v in zip(space.ranges, point, strict=True) if v is not None}
    assert _stands_in(space, tuple(point), standing)
    assert not _stands_in(space, tuple(point), standing | {HEATER: 0.95})
