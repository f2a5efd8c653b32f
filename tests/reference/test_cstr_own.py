"""The engine against pinned trajectories of an integrator that shares no code with it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.plants.cstr.reactor import MODEL, batch, inputs, parameters, run
from tests.reference.make_cstr_reference import COLUMNS, FILE, ONSET_S, PINS, Scenario, scenarios, trajectory

REFERENCE = json.loads(FILE.read_text(encoding="utf-8"))
TOLERANCE = {"T": 2e-7}
"""Reached: 5e-8 K in temperature, 3e-9 mol/L in concentrations, 3e-10 in the rest (the cooling water flow)."""


def test_the_file_has_every_scenario_and_nothing_stale() -> None:
    assert list(REFERENCE["cases"]) == [s.name for s in scenarios()]
    assert REFERENCE["columns"] == list(COLUMNS)
    for rows in REFERENCE["cases"].values():
        assert [int(t) for t in rows] == list(PINS)


def test_the_file_is_what_the_script_makes() -> None:
    pinned = REFERENCE["cases"]["normal"]
    for t, row in trajectory(scenarios()[0]):
        if str(t) in pinned:
            np.testing.assert_allclose(pinned[str(t)], row, rtol=1e-11)
        if t == 320:
            break


@pytest.mark.parametrize("scenario", scenarios(), ids=lambda s: s.name)
def test_the_engine_follows_the_pinned_trajectory(scenario: Scenario) -> None:
    u = np.tile(inputs(), (max(PINS), 1))
    for name, changes in scenario.operation.setpoints.items():
        for since, value in changes:
            u[int(since) :, MODEL.inputs.index(name)] = value
    faults = {name: (severity, ONSET_S) for name, severity in scenario.faults.items()}
    engine = run(batch(max(PINS), p=parameters(**scenario.changes), faults=faults, u=u))
    pinned = np.array(list(REFERENCE["cases"][scenario.name].values()))
    rows = np.array(PINS) - 1
    for column, name in enumerate(COLUMNS):
        reached = np.abs(engine.of(name)[rows] - pinned[:, column])
        assert reached.max() <= TOLERANCE.get(name, 1e-8), (name, PINS[int(reached.argmax())], reached.max())


def test_every_scenario_differs_from_normal() -> None:
    """A scenario that does nothing would pin nothing."""
    normal = np.array(list(REFERENCE["cases"]["normal"].values()))
    at = [COLUMNS.index(name) for name in ("V", "T")]
    for name, rows in REFERENCE["cases"].items():
        if name != "normal":
            assert np.abs(np.array(list(rows.values())) - normal)[:, at].max() > 0.01, name
