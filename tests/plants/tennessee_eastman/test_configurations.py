"""Configurations as states: what is frozen stands, what is switched does not jump, and each holds the plant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from homeostat.agents.search.candidates import design_commands
from homeostat.process.batch import Batch, simulate
from homeostat.process.types import Vec
from tests.plants.tennessee_eastman.eastman import eastman, model, stated
from tests.plants.tennessee_eastman.test_closed_loop import TICKS, first_trip

SHOWN = ("PR", "TR", "LR", "LS", "LC", "X11G", "F11")
ALSO = ("AC1_out", "AC2_out", "AC4_out", "UC11_out", "V5_position", "V7_cmd", "V8_cmd", "F4", "F2")
MACHINE = eastman().description.machine


def course(hours: int, states: Mapping[float, str], faults: Mapping[str, float] | None = None) -> dict[str, Vec]:
    """True values each minute without noise, in the states that begin at these hours, by design and at their rates.

    ``faults``: severities, from the first hour on.
    """
    inputs, at = np.tile(eastman().start, (TICKS * hours, 1)), model().inputs.index
    tags, variables = eastman().description.tags_by_name, eastman().description.variables
    for hour, name in states.items():
        k = round(hour * TICKS)
        for c in design_commands(MACHINE.state(name), tags):
            if c.value is None:
                inputs[k:, at(variables[c.tag])] = np.nan
                continue
            was, step = inputs[max(k - 1, 0), at(variables[c.tag])], (c.rate or np.inf) * 3600.0 / TICKS
            ramp = np.minimum(step * (1 + np.arange(len(inputs) - k)), abs(c.value - was))
            inputs[k:, at(variables[c.tag])] = was + np.sign(c.value - was) * ramp
    severity = np.array([[(faults or {}).get(name, 0.0) for name in model().faults]])
    record = (*(f"{name}_true" for name in SHOWN), *ALSO)
    batch = Batch(
        state=model().initial_state(stated())[None], parameters=stated()[None], severity=severity,
        onset_s=np.full_like(severity, 3600.0), inputs=inputs[None], input_of=np.zeros(1, int), start_s=0.0,
        steps=len(inputs), stride=1, record=tuple(map(model().states.index, record)), seeds=np.zeros(1, int),
        process_noise=np.zeros(1), sensor_noise=np.zeros(1),
    )  # fmt: skip
    found = simulate(model().kernel, batch, model().states.__getitem__, refuse=False).record[0]  # beyond its limits
    return dict(zip((*SHOWN, *ALSO), found.T, strict=True))


def test_every_configuration_is_an_answer_and_every_mode_an_order() -> None:
    target = MACHINE.recovery_event
    offered = {t.target for t in MACHINE.transitions if t.event == target and t.source == "normal"}
    assert offered == {"adjusted", "trims_held", "by_separator", "by_stripper"}
    ordered = {t.target for t in MACHINE.transitions if t.event == "ordered" and t.source == "normal"}
    assert ordered == {"mode_1", "mode_3", "mode_4", "mode_6", "regulatory"}
    ways = MACHINE.paths("regulatory", {}, target, blocked=())
    assert {way[-1].target for way in ways} == offered | {"normal"}


@pytest.mark.parametrize("state", ["trims_held", "by_separator", "by_stripper", "regulatory"])
def test_a_configuration_holds_the_base_case_and_is_left_again(state: str) -> None:
    found = course(30, {2.0: state, 20.0: "normal"})
    assert first_trip(found) == (np.inf, "")
    for name, base in {"PR": 2705.0, "LR": 75.0, "F11": 22.949, "LS": 50.0, "LC": 50.0}.items():
        assert found[name][19 * TICKS] == pytest.approx(base, rel=0.03), name
        assert found[name][-TICKS:].mean() == pytest.approx(base, rel=0.03), name
    for name in ("UC11_out", "V7_cmd", "V8_cmd"):  # nothing jumps: a usual tick moves each by less than that
        jumps = np.abs(np.diff(found[name]))
        assert max(jumps[2 * TICKS - 2 : 2 * TICKS + 2].max(), jumps[20 * TICKS - 2 : 20 * TICKS + 2].max()) < 0.01


def test_frozen_trims_stand_whatever_the_analysers_show() -> None:
    found = course(6, {2.0: "trims_held"}, {"A_poor": 0.03})
    for name in ("AC1_out", "AC2_out", "AC4_out"):
        assert np.unique(found[name][2 * TICKS :]).size == 1 and np.unique(found[name]).size > 1, name


def test_frozen_trims_are_the_answer_to_a_lost_feed_of_a() -> None:
    """With its trims the plant takes A from the A and C feed in place of the one that is lost, and has too little C."""
    assert first_trip(course(12, {}, {"A_lost": 1.0}))[1] == "LC"
    assert first_trip(course(24, {1.5: "trims_held"}, {"A_lost": 1.0})) == (np.inf, "")


def test_without_trims_and_overrides_a_poor_feed_trips_when_it_does_in_the_published_code() -> None:
    """The published code without trims: 4.65 h after the start of a run, one hour of it without the disturbance."""
    hour, by = first_trip(course(7, {0.0: "regulatory"}, {"A_poor": 0.03}))
    assert by == "PR" and hour == pytest.approx(4.6, rel=0.05)
    assert first_trip(course(24, {}, {"A_poor": 0.03})) == (np.inf, "")


@pytest.mark.parametrize(("fault", "size", "state"), [
    ("V7_stuck_closed", 0.60, "by_separator"), ("V8_stuck_closed", 0.55, "by_stripper"),
])  # fmt: skip
def test_a_valve_that_sticks_is_carried_by_another_pairing(fault: str, size: float, state: str) -> None:
    assert first_trip(course(8, {}, {fault: size}))[0] < 8.0
    assert first_trip(course(14, {1.5: state}, {fault: size})) == (np.inf, "")


def test_a_full_reactor_closes_the_recycle_valve_and_nothing_does_where_that_is_off() -> None:
    """Two per cent of opening for each per cent above 90."""
    inputs = np.tile(eastman().start, (6 * TICKS, 1))
    for on in (1.0, 0.0):
        inputs[:, model().inputs.index("LR_sp")] = 92.0
        inputs[:, model().inputs.index("LY8_on")] = on
        found = _of(inputs)
        above = np.maximum(found["LR"] - 90.0, 0.0).max() * 0.02
        assert above > 0.05
        assert found["V5_position"].min() == pytest.approx(0.2221 - on * above, abs=0.003)


@pytest.mark.parametrize(
    ("mode", "grade", "made"), [("mode_3", 90.09, 18.047), ("mode_4", 53.35, 25.244), ("mode_6", 90.09, 19.851)]
)
def test_a_published_mode_is_reached_from_the_base_case_and_kept(mode: str, grade: float, made: float) -> None:
    found = course(60, {1.0: mode})
    assert first_trip(found) == (np.inf, "")
    last = {name: values[-2 * TICKS :] for name, values in found.items()}
    assert last["X11G"].mean() == pytest.approx(grade, abs=0.5) and last["F11"].mean() == pytest.approx(made, rel=0.01)
    assert last["PR"].mean() == pytest.approx(2800.0, abs=3.0) and last["TR"].std() < 0.1


def _of(inputs: np.ndarray) -> dict[str, Vec]:
    none = np.zeros((1, len(model().faults)))
    names = ("LR", "V5_position")
    batch = Batch(
        state=model().initial_state(stated())[None], parameters=stated()[None], severity=none, onset_s=none,
        inputs=inputs[None], input_of=np.zeros(1, int), start_s=0.0, steps=len(inputs), stride=1,
        record=tuple(map(model().states.index, names)), seeds=np.zeros(1, int), process_noise=np.zeros(1),
        sensor_noise=np.zeros(1),
    )  # fmt: skip
    found = simulate(model().kernel, batch, model().states.__getitem__).record[0]
    return dict(zip(names, found.T, strict=True))
