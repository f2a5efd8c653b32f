"""What a part is given: a number where one is needed at once, and whatever it is, a refusal that names the argument."""

from collections.abc import Callable
from typing import Any

import pytest

from homeostat.process.blocks import Exchanger, Flowsheet, FlowsheetError, Vessel, term
from homeostat.process.blocks.hydraulics.piping import Piping

LEVEL = term("level")
Build = Callable[[Flowsheet, Any], object]

NUMBERS: dict[str, tuple[str, Build]] = {
    "delay": ("delay d: seconds", lambda s, v: s.delay("d", LEVEL, v)),
    "analyser": ("sensor A: every_s", lambda s, v: s.sensor("A", LEVEL, every_s=v)),
    "rounding": ("sensor A: step", lambda s, v: s.sensor("A", LEVEL, step=v)),
    "opening": ("actuator V: start", lambda s, v: s.actuator("V", start=v)),
    "latch": ("memory m: start", lambda s, v: s.memory("m", lambda was: was, start=v)),
    "latch found": ("memory m: usual", lambda s, v: s.memory("m", lambda was: was, usual=v)),
    "least": ("state x: least", lambda s, v: s.state("x", "1", 0.0, least=v)),
    "heel": ("vessel B: heel", lambda s, v: Vessel(s, "B", "L", 1.0, heel=v)),
    "cells": ("exchanger E: cells", lambda s, v: Exchanger(s, "E", 1.0, 300.0, cells=v)),
    "parts": ("flowsheet: parts", lambda s, v: Flowsheet(parts=v)),
    "fastest": ("flowsheet: fastest_s", lambda s, v: Flowsheet(fastest_s=v)),
}
"""What takes a number alone: how a refusal calls it, and who gives it."""
TERMS: dict[str, tuple[str, Build]] = {
    "start": ("state x: start", lambda s, v: s.state("x", "1", v)),
    "usual": ("state x: usual", lambda s, v: s.state("x", "1", 0.0, usual=v)),
    "lag": ("lag y: tau", lambda s, v: s.lag("y", LEVEL, v)),
    "lagged": ("lag y: of", lambda s, v: s.lag("y", v, 2.0)),
    "delayed": ("delay d: of", lambda s, v: s.delay("d", v, 2.0)),
    "kept": ("hold h: of", lambda s, v: s.hold("h", v)),
    "quantity": ("quantity q: of", lambda s, v: s.quantity("q", v)),
    "actuator": ("actuator V: lag", lambda s, v: s.actuator("V", lags=(v,))),
    "withheld": ("actuator V: withheld", lambda s, v: s.actuator("V", withheld=v)),
    "automatic": ("actuator V: automatic", lambda s, v: s.actuator("V", automatic=v)),
    "forward": ("controller C: forward", lambda s, v: s.controller("C", "L", 1, forward=v)),
    "setpoint": ("controller C: setpoint", lambda s, v: s.controller("C", "L", 1, setpoint=v)),
    "off": ("sensor A: off", lambda s, v: s.sensor("A", LEVEL, off=v)),
    "spread": ("disturbance T: sd", lambda s, v: s.disturbance("T", v, 3.0)),
    "filter": ("disturbance T: tau", lambda s, v: s.disturbance("T", 1.0, v)),
    "growing": ("fault f: tau", lambda s, v: s.growing("f", v)),
    "feed": ("vessel B: flow", lambda s, v: Vessel(s, "B", "L", 1.0).feed(v)),
    "draw": ("vessel B: flow", lambda s, v: Vessel(s, "B", "L", 1.0).draw(v)),
    "heat": ("vessel B: power", lambda s, v: Vessel(s, "B", "L", 1.0).heat(v)),
    "reaction": ("vessel B: rate", lambda s, v: Vessel(s, "B", "L", 1.0).react(v)),
    "exchanger": ("exchanger E: flow", lambda s, v: Exchanger(s, "E", 1.0, 300.0).hot(v, 300.0, 1.0)),
    "head": ("branch p: end", lambda s, v: (n := Piping(s, "N")).pipe("p", (n.junction("j"), v), 1.0)),
}
"""What takes a term, a number or a symbol: the same."""
TIMES = ("lag", "actuator", "filter", "growing")


@pytest.mark.parametrize("given", ["dead_A3", term("dead_A3"), float("nan"), float("inf"), True, [1.0], 1j])
@pytest.mark.parametrize("case", NUMBERS)
def test_what_is_no_number_is_refused_by_its_argument(case: str, given: object) -> None:
    told, build = NUMBERS[case]
    with pytest.raises(FlowsheetError, match=f"^{told} .*; write ") as refused:
        build(Flowsheet(), given)
    if isinstance(given, str):
        assert "the symbol 'dead_A3', and is needed before parameters have values" in str(refused.value)


@pytest.mark.parametrize("case", [each for each in NUMBERS if each not in ("latch", "latch found", "least")])
def test_a_negative_number_is_refused_where_none_may_be(case: str) -> None:
    with pytest.raises(FlowsheetError, match="-3"):
        NUMBERS[case][1](Flowsheet(), -3.0)


@pytest.mark.parametrize("case", ["cells", "parts"])
def test_half_a_cell_is_none(case: str) -> None:
    with pytest.raises(FlowsheetError, match=r"= 2\.5"):
        NUMBERS[case][1](Flowsheet(), 2.5)


@pytest.mark.parametrize("given", [float("nan"), [1.0], 1j])
@pytest.mark.parametrize("case", TERMS)
def test_what_is_no_term_is_refused_by_its_argument(case: str, given: object) -> None:
    told, build = TERMS[case]
    with pytest.raises(FlowsheetError, match=f"^{told} = .* is no term; give a term"):
        build(Flowsheet(), given)


@pytest.mark.parametrize("given", ["some", term("some"), 2.0])
@pytest.mark.parametrize("case", TERMS)
def test_a_symbol_a_term_and_a_number_are_taken(case: str, given: object) -> None:
    TERMS[case][1](Flowsheet(), given)


@pytest.mark.parametrize("given", [0.0, -2.0])
@pytest.mark.parametrize("case", TIMES)
def test_a_time_constant_is_more_than_nothing(case: str, given: float) -> None:
    told, build = TERMS[case]
    with pytest.raises(FlowsheetError, match=f"^{told} = {given:g} must be more than 0"):
        build(Flowsheet(), given)


def test_one_lag_need_not_stand_in_a_tuple() -> None:
    sheet = Flowsheet()
    made = sheet.actuator("V1", lags="tau_both")  # type: ignore[arg-type]
    assert made.lags == (term("tau_both"),)
