"""Networks of pipes, pumps and valves: flows that can be worked out by hand, and balances that always hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.process.blocks import Flowsheet, FlowsheetError, Vessel, number, term
from homeostat.process.blocks.agreement import StatedUnits, disagreements
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.hydraulics.laws import LAMINAR
from homeostat.process.blocks.hydraulics.piping import MOST_JUNCTIONS, Piping, throttled
from homeostat.process.blocks.hydraulics.solver import COLUMNS, ONE_WAY, PIPE, PUMP, room, solve_network
from tests.process.blocks.sheets import commanded, composed, run

Row = tuple[float, ...]


def pipe(start: float, end: float, heads: tuple[float, float], resistance: float, kind: float = PIPE) -> Row:
    """A branch between two junctions (or -1 for a head that is given)."""
    return (kind, start, end, *heads, resistance, 0.0, 0.0, 0.0)


def pump(start: float, end: float, heads: tuple[float, float], resistance: float, speed: float) -> Row:
    """One with the head curve 2.141 + 2.728 q, less what its resistance takes."""
    return (PUMP, start, end, *heads, resistance, 2.141, 2.728, speed)


def solved(junctions: int, *rows: Row) -> tuple[np.ndarray, np.ndarray, float]:
    """Heads [m], flows [L/s], and the largest surplus of a junction."""
    work = np.concatenate([np.ravel(rows), np.zeros(room(junctions, len(rows)) - COLUMNS * len(rows))])
    left = solve_network(work, 0, junctions, len(rows))
    at = COLUMNS * len(rows)
    return work[at : at + junctions], work[at + junctions : at + junctions + len(rows)], left


def flow(resistance: float, head: float) -> float:
    """The flow of one pipe by hand: K q^2 + R q = h."""
    return (-LAMINAR + math.sqrt(LAMINAR**2 + 4.0 * resistance * head)) / (2.0 * resistance)


def test_two_pipes_in_a_row_are_one_of_both_resistances() -> None:
    heads, flows, _ = solved(1, pipe(-1, 0, (2.0, 0.0), 30.0), pipe(0, -1, (0.0, 0.5), 70.0))
    assert flows[0] == pytest.approx(flows[1], abs=1e-12)
    # Each has the laminar part, so both together have it twice.
    q = (-2 * LAMINAR + math.sqrt(4 * LAMINAR**2 + 4.0 * 100.0 * 1.5)) / 200.0
    assert flows[0] == pytest.approx(q, abs=1e-12)
    assert heads[0] == pytest.approx(2.0 - 30.0 * q * q - LAMINAR * q, abs=1e-12)


def test_two_equal_branches_take_half_each() -> None:
    _, flows, _ = solved(1, pipe(-1, 0, (1.0, 0.0), 10.0), *[pipe(0, -1, (0.0, 0.0), 40.0)] * 2)
    assert flows[1] == flows[2] == pytest.approx(0.5 * flows[0], abs=1e-12)
    assert 10.0 * flows[0] ** 2 + 40.0 * flows[1] ** 2 + LAMINAR * 1.5 * flows[0] == pytest.approx(1.0, abs=1e-12)


def test_a_pump_without_lift_gives_what_its_curve_says() -> None:
    """1.739 + 2.459 q = 121.6 q^2 at 0.9013 of the speed: 0.130 L/s, and laminar friction on the whole way."""
    _, flows, _ = solved(1, pump(-1, 0, (0.0, 0.0), 28.82, 0.9013), pipe(0, -1, (0.0, 0.0), 92.8))
    q = flows[0]
    assert q == pytest.approx(0.130, abs=5e-4)
    n = 0.9013
    assert 2.141 * n * n + 2.728 * n * q - 121.62 * q * q - 2 * LAMINAR * q == pytest.approx(0.0, abs=1e-10)


def test_nothing_flows_back_through_a_check_valve_nor_through_a_pump_that_stands() -> None:
    high = (0.0, 3.0)
    for branch in (pipe(-1, 0, (0.0, 0.0), 10.0, ONE_WAY), pump(-1, 0, (0.0, 0.0), 28.82, 0.0)):
        _, flows, _ = solved(1, branch, pipe(0, -1, high, 10.0))
        assert abs(flows[0]) < 1e-6
    assert solved(1, pipe(-1, 0, (0.0, 0.0), 10.0), pipe(0, -1, high, 10.0))[1][0] == pytest.approx(
        -(-2 * LAMINAR + math.sqrt(4 * LAMINAR**2 + 4.0 * 20.0 * 3.0)) / 40.0, abs=1e-12
    )


RESISTANCE = st.one_of(st.floats(1.0, 1e4), st.sampled_from([1e12, 1e18]))
BRANCH = st.tuples(st.integers(-1, 3), st.integers(-1, 3), st.floats(-2.0, 5.0), RESISTANCE, st.integers(0, 2),
                   st.floats(0.0, 1.0))  # fmt: skip


@settings(max_examples=300)
@given(st.lists(BRANCH, max_size=10))
def test_what_flows_into_a_junction_flows_out_of_it(branches: list[tuple[int, int, float, float, int, float]]) -> None:
    """Whatever lies between four junctions, each of which has a pipe to somewhere."""
    rows = [pipe(-1, j, (float(j), 0.0), 50.0 * (j + 1)) for j in range(4)]
    for start, end, head, resistance, kind, speed in branches:
        if start != end:
            made = pump if kind == 2 else pipe
            last = speed if kind == 2 else (PIPE, ONE_WAY)[kind]
            rows.append(made(start, end, (head, head), min(resistance, 1e4) if kind == 2 else resistance, last))
    heads, flows, left = solved(4, *rows)
    assert left < 1e-9 and np.isfinite(heads).all()
    balance = np.zeros(4)
    for row, q in zip(rows, flows, strict=True):
        for place, sign in ((int(row[1]), -1.0), (int(row[2]), 1.0)):
            if place >= 0:
                balance[place] += sign * q
    assert np.abs(balance).max() < 1e-9


STATED = {"A": 10.0, "K": 50.0, "tau_V1": 0.1, "tau_P1": 0.1, "a": 2.141, "b": 2.728, "c": 28.82}


def plant() -> Flowsheet:
    """Two tanks on one pipe with a valve, from which a pump lifts into a third; there is 0.1 L to a centimetre."""
    s = Flowsheet()
    tanks = [Vessel(s, name, "L", start) for name, start in (("B1", 8.0), ("B2", 2.0), ("B3", 1.0))]
    heads = [tank.volume / "A" for tank in tanks]
    valve, pumping = s.actuator("V1"), s.actuator("P1")
    line = Piping(s, "line")
    suction = line.junction("suction")
    for i in (0, 1):
        opened = throttled("K", valve.position if i == 0 else 1.0)
        tanks[i].release(line.pipe(f"out{i + 1}", (heads[i], suction), opened))
    lifted = line.pump("lift", (suction, heads[2] + number(0.5, "m")), ("a", "b", "c"), pumping.position)
    tanks[2].feed(lifted)
    for i, tank in enumerate(tanks):
        s.sensor(f"L{i + 1}", tank.volume)
    return s


@pytest.fixture(scope="module")
def model() -> ComposedModel:
    return composed(plant(), STATED)


def test_tanks_on_one_pipe_level_out_and_nothing_is_lost(model: ComposedModel) -> None:
    found = run(model, STATED, commanded(model, V1_cmd=1.0, P1_cmd=0.0), 600)[1]
    assert found["B1_V"][-1] == pytest.approx(found["B2_V"][-1], abs=0.02)
    total = found["B1_V"] + found["B2_V"] + found["B3_V"]
    assert total == pytest.approx(11.0, abs=1e-6)
    assert found["line_out1"][5] == pytest.approx(-found["line_out2"][5], abs=1e-6)


def test_the_pump_takes_from_the_tank_whose_valve_is_open(model: ComposedModel) -> None:
    found = run(model, STATED, commanded(model, V1_cmd=0.0, P1_cmd=1.0), 20)[1]
    assert abs(found["line_out1"][-1]) < 1e-5 and found["line_out2"][-1] > 0.05
    assert found["line_lift"][-1] == pytest.approx(found["line_out2"][-1], abs=1e-5)


def test_the_first_state_has_heads_and_flows_of_its_own(model: ComposedModel) -> None:
    x = dict(
        zip(model.states, model.initial_state(np.array([STATED.get(n, 0.0) for n in model.parameters])), strict=True)
    )
    assert x["line_suction"] == pytest.approx(0.2, abs=1e-6) and abs(x["line_lift"]) < 1e-6


def test_units_of_a_network_are_checked() -> None:
    units = {"A": "L/m", "K": "m/(L/s)^2", "tau_V1": "s", "tau_P1": "s", "a": "m", "b": "m/(L/s)", "c": "m/(L/s)^2"}
    stated = {f"{what}_L{i}": "L" for what in ("bias", "sd") for i in (1, 2, 3)}
    variables = {f"L{i}": "L" for i in (1, 2, 3)} | {"V1_cmd": "1", "P1_cmd": "1"}
    assert disagreements(plant(), StatedUnits(units | stated, variables, {})) == ()
    wrong = disagreements(plant(), StatedUnits(units | stated | {"K": "m/(L/s)", "A": "L"}, variables, {}))
    assert any("resistance of line_out2" in each for each in wrong) and any(
        "a head of line_out1" in each for each in wrong
    )


def test_a_branch_has_a_junction_and_a_network_is_small() -> None:
    s = Flowsheet()
    line = Piping(s, "line")
    with pytest.raises(FlowsheetError, match="neither end is a junction"):
        line.pipe("a", (term(1.0), term(0.0)), "K")
    for k in range(MOST_JUNCTIONS):
        line.junction(f"j{k}")
    with pytest.raises(FlowsheetError, match="more than 12 junctions"):
        line.junction("one_more")
