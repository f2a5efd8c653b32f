"""The output of a split range is known from all that follows it, whichever part moves and whatever the others show."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from homeostat.process.blocks import Flowsheet, Vessel, limited, linear_valve
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Leaf, Term, evaluate
from homeostat.process.types import Vec
from tests.process.blocks.sheets import composed, row

STATED = {
    "V0": 10.0, "F_in": 0.4, "tau_V1": 1.0, "tau_V2": 1.0, "tau_V3": 1.0,
    "Kp_LIC": 0.5, "Ki_LIC": 0.01, "Kp_FIC": 1.0, "Ki_FIC": 0.2,
}  # fmt: skip
ROWS = 12
FLOW = Term(Leaf.PARAMETER, value="F_in")


class Split(NamedTuple):
    """A split range: name of the actuator -> what the output commands it, and the setpoint of an inner loop."""

    valves: Mapping[str, Callable[[Term], Term]]
    inner: Callable[[Term], Term] | None = None


def part(of: Term, first: float, last: float) -> Term:
    """From 0 to 1 while ``of`` goes from ``first`` to ``last``."""
    return limited((of - first) / (last - first), 0.0, 1.0)


SPLITS: Mapping[str, Split] = {
    "two": Split({"V1": lambda o: part(o, 0.5, 1.0), "V2": lambda o: part(o, 0.5, 0.0)}),
    "two, the other first": Split({"V1": lambda o: part(o, 0.5, 0.0), "V2": lambda o: part(o, 0.5, 1.0)}),
    "both rise": Split({"V1": lambda o: part(o, 0.0, 0.4), "V2": lambda o: part(o, 0.4, 1.0)}),
    "both fall": Split({"V1": lambda o: part(o, 1.0, 0.4), "V2": lambda o: part(o, 0.4, 0.0)}),
    "they overlap": Split({"V1": lambda o: part(o, 0.4, 1.0), "V2": lambda o: part(o, 0.6, 0.0)}),
    "three": Split(
        {"V1": lambda o: part(o, 0.3, 0.0), "V2": lambda o: part(o, 0.3, 0.6), "V3": lambda o: part(o, 0.6, 1.0)}
    ),
    "a cascade above": Split({"V1": lambda o: part(o, 0.5, 0.0)}, lambda o: part(o, 0.5, 1.0)),
    "a cascade below": Split({"V1": lambda o: part(o, 0.5, 1.0)}, lambda o: part(o, 0.5, 0.0)),
    "a cascade of three": Split(
        {"V1": lambda o: part(o, 0.3, 0.0), "V2": lambda o: part(o, 0.6, 1.0)}, lambda o: part(o, 0.3, 0.6)
    ),
}
each_split = pytest.mark.parametrize("split", SPLITS)


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler for each of these would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@lru_cache
def made(split: str) -> ComposedModel:
    """A tank whose level has a split range; its inner loop sets the flow of a further valve, V9."""
    s, (valves, inner) = Flowsheet(), SPLITS[split]
    b = Vessel(s, "B", "L", "V0")
    s.sensor("L", b.volume)
    out = s.controller("LIC", "L", acts=-1).output
    for name, commands in valves.items():
        b.feed(linear_valve("F_in", s.actuator(name, commands(out)).opening))
    if inner is not None:
        flow = s.controller("FIC", "F", acts=-1, setpoint=inner(out) * "F_in")
        f = linear_valve("F_in", s.actuator("V9", flow.output).opening)
        s.sensor("F", f)
        b.feed(f)
    return composed(s, {**STATED, "tau_V9": 1.0})


def recorded(model: ComposedModel, outputs: Vec, level: float) -> dict[str, Vec]:
    """What would be read where the output of the level's controller was ``outputs``, shape (rows,)."""
    sheet, n = model.flowsheet, len(outputs)
    read = {name: np.full(n, np.nan) for name in model.inputs}
    read |= {"L": np.full(n, level), "L_sp": np.full(n, 10.0), "L_err": np.full(n, level - 10.0)}
    known = {sheet.controllers["LIC"].output: outputs, FLOW: STATED["F_in"]}
    for a in sheet.actuators.values():
        if a.name != "V9" and a.automatic is not None:
            read[a.command] = np.asarray(evaluate(a.automatic, known), dtype=np.float64)
    if "FIC" in sheet.controllers:
        setpoint = sheet.controllers["FIC"].setpoint
        assert setpoint is not None
        read["F"] = np.full(n, 0.1)
        read["F_err"] = read["F"] - evaluate(setpoint, known)
        read["V9_cmd"] = np.full(n, 0.4)
    return read


def resumed(split: str, read: Mapping[str, Vec]) -> tuple[float, float]:
    """Output and integral term [1] of the level's controller that goes on from ``read``."""
    model = made(split)
    state = model.initial_state(row(model, STATED))[None]
    model.resume(state, read, row(model, STATED)[None])
    return float(state[0, model.states.index("LIC_out")]), float(state[0, model.states.index("LIC_integral")])


def goes_on(output: float, level: float) -> float:
    """The integral term [1] after a tick in which the output was ``output``."""
    error = 10.0 - level
    return output - STATED["Kp_LIC"] * error + STATED["Ki_LIC"] * error


def courses(last: float) -> Vec:
    """Outputs that wander over all parts and end with ``last``, shape (ROWS,)."""
    return np.append(np.linspace(0.9, 0.1, ROWS - 1), last)


@each_split
@given(output=st.floats(0.0, 1.0), level=st.floats(9.8, 10.2))
@settings(max_examples=25, deadline=None)
def test_any_output_goes_on_as_it_was(split: str, output: float, level: float) -> None:
    found, integral = resumed(split, recorded(made(split), courses(output), level))
    assert found == pytest.approx(output, abs=1e-6)
    if 1e-6 < output < 1.0 - 1e-6:  # at its limits the integral term may have been anywhere beyond
        assert integral == pytest.approx(goes_on(output, level), abs=1e-6)


@each_split
@pytest.mark.parametrize("output", [0.0, 0.3, 0.4, 0.5, 0.6, 1.0])
def test_where_one_part_ends_and_the_next_begins(split: str, output: float) -> None:
    found, _ = resumed(split, recorded(made(split), np.full(ROWS, output), 10.1))
    assert found == pytest.approx(output, abs=1e-6)


@each_split
@given(output=st.floats(0.02, 0.98), seed=st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_a_part_that_rests_and_shows_a_little_is_not_taken_for_the_one_that_moves(
    split: str, output: float, seed: int
) -> None:
    """A command that is read back through a converter is a little off; a setpoint is as noisy as its reading."""
    model, generator = made(split), np.random.default_rng(seed)
    read = recorded(model, courses(output), 10.1)
    commands = [name for name in read if name.endswith("_cmd")]
    read |= {name: np.clip(read[name] + generator.uniform(-5e-4, 5e-4, ROWS), 0.0, 1.0) for name in commands}
    if "F" in read:
        read["F"] = read["F"] + generator.normal(0.0, 1e-4, ROWS)  # its error was worked out from another one
    assert resumed(split, read)[0] == pytest.approx(output, abs=0.005)


@each_split
@given(output=st.floats(0.02, 0.98), stands=st.floats(0.0, 1.0))
@example(output=0.5, stands=1.0)
@example(output=0.3, stands=1.0)
@example(output=0.4, stands=0.0)
@settings(max_examples=25, deadline=None)
def test_a_part_by_hand_says_nothing_while_another_moves(split: str, output: float, stands: float) -> None:
    model = made(split)
    read = recorded(model, courses(output), 10.1)
    sheet = model.flowsheet
    free = [of.automatic for name, of in sheet.actuators.items() if name not in ("V1", "V9")]
    free += [each.setpoint / "F_in" for each in sheet.controllers.values() if each.setpoint is not None]
    known = {sheet.controllers["LIC"].output: output, FLOW: STATED["F_in"]}
    moves = any(1e-6 < evaluate(of, known) < 1.0 - 1e-6 for of in free if of is not None)
    read["V1_man"] = read["V1_cmd"] = np.full(ROWS, stands)
    found, integral = resumed(split, read)
    if moves:
        assert found == pytest.approx(output, abs=1e-6)
        assert integral == pytest.approx(goes_on(output, 10.1), abs=1e-6)
    else:  # what is free commands the same as it did
        again = recorded(model, np.full(2, found), 10.1)
        for name in again:
            if name.endswith("_cmd") and name not in ("V1_cmd", "V9_cmd"):
                assert again[name][-1] == pytest.approx(read[name][-1], abs=1e-6), name


@pytest.mark.parametrize(
    ("split", "output"),
    [("a cascade above", 0.1), ("a cascade below", 0.9), ("a cascade of three", 0.1), ("a cascade of three", 0.9)],
)
def test_a_setpoint_by_hand_says_nothing_while_a_valve_moves(split: str, output: float) -> None:
    read = recorded(made(split), courses(output), 10.1)
    read["F_sp"] = np.full(ROWS, 0.17)
    read["F_err"] = read["F"] - 0.17
    assert resumed(split, read)[0] == pytest.approx(output, abs=1e-6)


@each_split
@pytest.mark.parametrize("rows", [[ROWS - 1], [2, 3], list(range(ROWS))])
@pytest.mark.parametrize("lost", ["V1_cmd", "L"])
def test_what_was_not_read_leaves_numbers(split: str, rows: list[int], lost: str) -> None:
    read = recorded(made(split), np.full(ROWS, 0.45), 10.1)
    read[lost] = read[lost].copy()
    read[lost][rows] = np.nan
    found, integral = resumed(split, read)
    assert 0.0 <= found <= 1.0 and -1.0 <= integral <= 1.0


def test_between_two_parts_the_integral_goes_on_from_where_it_was_known() -> None:
    """A gap between the parts: nothing moves while the output is in it, and it is followed from its error."""
    s = Flowsheet()
    b = Vessel(s, "B", "L", "V0")
    s.sensor("L", b.volume)
    out = s.controller("LIC", "L", acts=-1).output
    b.feed(linear_valve("F_in", s.actuator("V1", part(out, 0.6, 1.0)).opening))
    b.draw(linear_valve("F_in", s.actuator("V2", part(out, 0.4, 0.0)).opening))
    model = composed(s, STATED)
    level, start = 9.9, 0.39
    outputs = start + STATED["Ki_LIC"] * (10.0 - level) * np.arange(40.0)
    state = model.initial_state(row(model, STATED))[None]
    model.resume(state, recorded(model, outputs, level), row(model, STATED)[None])
    assert outputs[-1] > 0.42
    assert state[0, model.states.index("LIC_integral")] == pytest.approx(goes_on(outputs[-1], level), abs=1e-6)
