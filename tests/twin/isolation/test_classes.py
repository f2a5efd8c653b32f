"""Classes: what may be said of explanations, and what is left for something else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultMode, FaultState, Hypothesis, with_a_twin
from homeostat.twin.carried import shares
from homeostat.twin.isolation.classes import LEAST_PROBABILITY, SPREAD_NATS, hypotheses
from homeostat.twin.isolation.search import Scored
from tests.twin.followed import reactor

MODES: dict[str, FaultMode] = {mode.name: mode for mode in reactor().description.fault_modes}


def scored(name: str, score: float) -> Scored:
    return Scored((FaultState(name, MODES[name].severity_nominal, 100.0),), score)


EXPLANATIONS = [scored("fouling", 0.0), scored("temp_bias", -1.0), scored("leak", -2.0), scored("pump_degrade", -9.0)]


def other(found: tuple[Hypothesis, ...]) -> float:
    return sum(h.probability for h in found if h.name == SOMETHING_ELSE)


@pytest.mark.parametrize("misled", [0.0, 0.05, 0.2])
def test_nothing_is_said_with_more_than_is_left(misled: float) -> None:
    found = hypotheses([scored("fouling", 0.0)], -50.0, MODES, misled=misled)
    assert found[0].name == "fouling" and found[0].probability == pytest.approx(1.0 - misled)
    assert other(found) == pytest.approx(misled)


@pytest.mark.parametrize("misled", [0.05, 0.2])
def test_all_that_is_said_comes_to_one_and_keeps_its_order(misled: float) -> None:
    plain, found = (hypotheses(EXPLANATIONS, -3.0, MODES, misled=share) for share in (0.0, misled))
    assert sum(h.probability for h in found) == pytest.approx(1.0)
    assert [h.name for h in with_a_twin(found)] == [h.name for h in with_a_twin(plain)]
    shares = [[h.probability for h in with_a_twin(each)] for each in (plain, found)]
    assert shares[1] == pytest.approx([p / sum(shares[0]) for p in shares[0]])


def test_what_is_not_worth_a_word_goes_to_something_else() -> None:
    """Each below 2 %, together more than that."""
    names = ["temp_bias", "leak", "pump_degrade", "level_bias", "cool_stuck_open"]
    faint = [scored(name, -4.1) for name in names]
    found = hypotheses([scored("fouling", 0.0), *faint], -50.0, MODES)
    assert {h.name for h in found} == {"fouling", SOMETHING_ELSE}
    assert LEAST_PROBABILITY < other(found) < 0.1 and sum(h.probability for h in found) == pytest.approx(1.0)


def test_where_nothing_fits_something_else_is_as_likely_as_not() -> None:
    found = hypotheses([replace(each) for each in EXPLANATIONS], -50.0, MODES, named=False, misled=0.1)
    assert other(found) == 0.5 and with_a_twin(found) == found


def test_a_bound_of_a_size_is_not_lost_to_the_last_bit() -> None:
    """It is as much worse as a bound may be, but for what comes of adding and dividing."""
    best = scored("fouling", 0.3)
    bound = Scored((FaultState("fouling", 2.0 * best.faults[0].severity, 100.0),), 0.3 - SPREAD_NATS - 1e-15)
    assert len(hypotheses([best, bound], -50.0, MODES)) == 2


def test_what_no_twin_can_carry_makes_no_risk_smaller() -> None:
    said = hypotheses(EXPLANATIONS, -50.0, MODES, named=False)
    drawn = shares(said)
    assert sum(p for h, p in zip(said, drawn, strict=True) if h.something_else) == 0.0
    assert drawn.sum() == pytest.approx(1.0)
    assert shares([h for h in said if h.something_else]).tolist() == [1.0]
