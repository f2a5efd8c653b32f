"""The Mixing Module's engine against a pinned batch of an integrator that shares no code with it."""

from __future__ import annotations

import json

import numpy as np

from tests.plants.mixing_module.module import batch, parameters, run, timed
from tests.reference.make_mixing_reference import COLUMNS, COMMANDS, END_S, EVERY_S, FILE, PARAMETERS, trajectory

REFERENCE = json.loads(FILE.read_text(encoding="utf-8"))
PINNED = np.array(list(REFERENCE["rows"].values()), dtype=float)
"""Heads are NaN where nothing can flow."""


def test_the_file_is_what_the_script_makes() -> None:
    assert REFERENCE["columns"] == list(COLUMNS) and REFERENCE["parameters"] == PARAMETERS
    made = trajectory()
    assert [int(t) for t in REFERENCE["rows"]] == list(made) == list(range(EVERY_S, END_S + 1, EVERY_S))
    np.testing.assert_allclose(PINNED, np.array(list(made.values()), dtype=float), rtol=1e-11, atol=1e-12)


def test_the_engine_follows_the_pinned_batch() -> None:
    """Volumes [L], flow [L/s] and heads [m] to 1e-9; reached are 1e-10 in volumes and 3e-11 m in heads."""
    u = timed(END_S, *((int(since), command) for since, command in COMMANDS))
    engine = run(batch(END_S, p=parameters(**PARAMETERS), u=u))
    for column, name in enumerate(COLUMNS):
        pinned = PINNED[:, column]
        told = np.isfinite(pinned)
        seen = engine.of(name)[EVERY_S - 1 :: EVERY_S]
        np.testing.assert_allclose(seen[told], pinned[told], rtol=0.0, atol=1e-9, err_msg=name)


def test_the_pinned_batch_uses_both_lines_and_every_valve() -> None:
    """A batch in which little happened would pin little: tanks filled and emptied, product delivered, litres kept."""
    v = PINNED[:, :4]
    assert (v[:, :3].max(axis=0) > 2.8).all() and (v[:, :3].min(axis=0)[:2] < 0.5).all()
    assert v[:, 3].max() > 9.0 and v[-1, 3] < 0.1 and PINNED[-1, 5] > 9.0
    head_main, head_discharge = PINNED[:, 7], PINNED[:, 8]
    assert np.nanmax(head_main - head_discharge) > 0.3, "main line"
    assert np.nanmin(head_main - head_discharge) < -0.3, "bypass, behind the closed non-return valve"
