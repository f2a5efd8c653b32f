"""Flowsheets of many states: their source stays short, and what they are is what it would be with few."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from homeostat.process.blocks import Flowsheet, layout
from homeostat.process.blocks.code.writing import function
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Leaf, Term, evaluate, exp, leaves
from tests.process.blocks.sheets import commanded, composed, run

X = Term(Leaf.STATE, value="x")
COUNT = 30
"""More states than have variables of their own."""


def doubled(times: int) -> Term:
    """A term that has twice as many parts with each of ``times``, and is a tree of a few objects."""
    made = X
    for _ in range(times):
        made = made * exp(-1.0 * made)
    return made


def test_the_same_tree_is_the_same_object_also_from_a_file() -> None:
    assert (X + 1.0) * X is (X + 1.0) * X and (X + 1.0) is not (X + 2.0)
    assert pickle.loads(pickle.dumps(doubled(20))) is doubled(20)


def test_a_term_whose_parts_are_shared_is_walked_once() -> None:
    term = doubled(200)  # 2 ** 200 parts, each looked at once: another way would not end
    lines, given = function("slopes", [X], [term])
    assert len(lines) < 1000 and not given and leaves(term) == {X}
    assert evaluate(doubled(2), {X: 1.0}) == pytest.approx(np.exp(-1.0) * np.exp(-np.exp(-1.0)))


def chain() -> Flowsheet:
    """Cells in a row through which a wave runs, and a valve on the first."""
    s = Flowsheet(parts=3)
    valve = s.loop("LIC", measured="L", drives="V", acts=-1)
    before = valve.opening
    cells = [s.state(f"x{i:02}", "1", 0.1 * i, least=0.0) for i in range(COUNT)]
    for cell in cells:
        s.rate(cell, ("speed" * before - "speed" * cell) * (1.0 + 0.1 * cell * cell))
        before = cell
    s.sensor("L", cells[-1])
    s.sensor("middle", cells[COUNT // 2], relative=True)
    return s


STATED = {"speed": 0.4, "tau_V": 2.0, "Kp_LIC": 0.5, "Ki_LIC": 0.05}


def followed(model: ComposedModel) -> np.ndarray:
    return run(model, STATED, commanded(model, L_sp=0.7), 60)[0].record


@pytest.mark.slow
def test_many_states_are_integrated_in_place_to_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    in_place = composed(chain(), STATED)
    assert in_place.layout.room_of_states is not None and "slopes(work" in str(in_place.kernel._source)  # type: ignore[attr-defined]
    monkeypatch.setattr(layout, "MOST_APART", COUNT)
    apart = composed(chain(), STATED)
    assert apart.layout.room_of_states is None
    assert np.array_equal(followed(in_place), followed(apart))
