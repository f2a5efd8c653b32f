"""The true plant of a simulated run: the published one where its own laws are neutral, and those laws by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from homeostat.plants.tennessee_eastman.true.plant import DEPARTURES, TRUE, Truly
from homeostat.plants.truth import find_mismatch
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.term import Leaf, Term, evaluate
from tests.plants.tennessee_eastman.eastman import DESIGN, SHEET, leaves_at, model, rates, stated

U = Term(Leaf.STATE, value="u")


def at(draws: int = 20) -> dict[Term, Any]:
    """States near the base case."""
    rng = np.random.default_rng(1)
    x = model().initial_state(stated())
    near = {name: x[model().layout.column[name]] * rng.uniform(0.98, 1.02, draws) for name in SHEET.states}
    return leaves_at(near, np.array(DESIGN) * rng.uniform(0.9, 1.1, (draws, 12)), {})


def true_rates(values: dict[Term, Any], **own: float) -> dict[str, Any]:
    """State -> its change per hour in the true plant with ``own`` parameters; the others are neutral."""
    layout = Layout.true(TRUE.sheet, model().layout, DEPARTURES)
    given = {layout.leaf[Leaf.PARAMETER][name]: own.get(name, 0.0) for name in DEPARTURES.structure}
    return {name: 3600.0 * evaluate(rate, values | given) for name, rate in layout.rates.items()}


def test_neutral_laws_are_the_model_to_the_bit() -> None:
    values = at()
    found = true_rates(values)
    for name, rate in rates(values).items():
        assert np.array_equal(found[name], rate), name


def test_laws_by_hand() -> None:
    laws = Truly()

    def value(of: Term, u: float, **own: float) -> float:
        return float(evaluate(of, {U: u} | {Term(Leaf.PARAMETER, value=name): number for name, number in own.items()}))

    assert value(laws.opened(U), 0.4, valve_bend=0.1) == pytest.approx(0.424)
    assert value(laws.opened(U), 1.0, valve_bend=0.1) == 1.0
    assert value(laws.film("R", U), 0.5, R_film=0.2) == pytest.approx(0.5**0.2)
    assert value(laws.given_off("S", U), 80.0, S_loss=2.0) == pytest.approx(110.0)


@pytest.mark.parametrize(
    ("own", "moved"),
    [("valve_bend", "H_A"), ("R_film", "R_T"), ("S_film", "S_T"), ("R_loss", "R_T"), ("S_loss", "S_T")],
)
def test_each_law_moves_what_it_is_of(own: str, moved: str) -> None:
    values = at(5)
    changed = true_rates(values, **{own: 0.5})
    assert np.all(changed[moved] != rates(values)[moved])


def test_the_published_figures_have_a_mismatch_to_be_made_with() -> None:
    found = find_mismatch(model(), "plant")
    assert found is not None and found.spread == 2.5 and found.drifts
    at_rest = dict(zip(DEPARTURES.parameters, found.parameters.tolist(), strict=True))
    assert at_rest["valve_bend"] == 0.1 and at_rest["S_loss"] == 1.0
