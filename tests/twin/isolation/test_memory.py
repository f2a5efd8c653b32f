"""What agreeing with what was said before is worth: on which side of the first reading that began decides nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.carried import Carrier
from homeostat.twin.isolation.claims import Claims, forgotten
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.isolation import DOUBT
from homeostat.twin.isolation.memory import REPAIRED_NATS, Memory, remembered
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.search import DECIMALS, Scored, Search
from tests.twin.followed import follow, reactor, readings

FIRST_S, END_S = 500.0, 1500.0
ONE, OTHER, THIRD = "level_bias", "fouling", "temp_bias"
SOON = st.floats(450.0, 550.0)


@pytest.fixture(scope="module")
def compared() -> Iterator[tuple[Evidence, Prior]]:
    plant, twin = reactor(), follow(readings(4, 1500), 4)
    carrier, window = Carrier(plant.model, plant.description), twin._history.window(400)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    evidence = Evidence(plant.model, carrier, window, twin._posterior, accuracy)
    yield evidence, Prior(plant.description.faults, window, evidence.variables, {})


def told(compared: tuple[Evidence, Prior], said: Mapping[FaultState, float], *asked: FaultState) -> list[float]:
    """What each single fault ``asked`` for is worth to a memory of those ``said``, with what it costs itself [nats]."""
    evidence, prior = compared
    modes = evidence.carrier.modes
    before = [Hypothesis((fault,), probability) for fault, probability in said.items()]
    memory = Memory(
        remembered((), before, FIRST_S, DOUBT), modes, prior, END_S, Claims((), (), evidence, FIRST_S, forgotten)
    )
    every = memory.told([Scored((fault,), prior.of_mode(modes[fault.fault])) for fault in asked])
    return [each.score for each in every]


@given(one_s=SOON, other_s=SOON)
def test_which_side_of_the_first_reading_equals_began_on_tells_them_no_further_apart(
    compared: tuple[Evidence, Prior], one_s: float, other_s: float
) -> None:
    one, other = FaultState(ONE, 1.0, one_s), FaultState(OTHER, 0.5, other_s)
    first, second = told(compared, {one: 0.5, other: 0.5}, one, other)
    modes, prior = compared[0].carrier.modes, compared[1]
    apart = abs(prior.of_mode(modes[ONE]) - prior.of_mode(modes[OTHER]))
    assert abs(first - second) <= apart + 1e-9, "no more than where both began in the readings"


def test_of_equals_what_began_before_the_readings_pays_what_the_other_pays(compared: tuple[Evidence, Prior]) -> None:
    old, young = FaultState(ONE, 1.0, 400.0), FaultState(OTHER, 0.5, 600.0)
    first, second = told(compared, {old: 0.5, young: 0.5}, old, young)
    assert first == pytest.approx(second) == compared[1].of_mode(compared[0].carrier.modes[OTHER])


@given(likelier=st.floats(0.5, 0.98))
def test_what_was_likelier_stays_so_by_as_much_at_least(compared: tuple[Evidence, Prior], likelier: float) -> None:
    old, young = FaultState(ONE, 1.0, 400.0), FaultState(OTHER, 0.5, 600.0)
    first, second = told(compared, {old: likelier, young: 1.0 - likelier}, old, young)
    nats = [each.nats for each in remembered((), said(old, young, likelier), FIRST_S, DOUBT)]
    assert first - second >= max(nats) - min(nats) - 1e-9


def test_what_was_known_alone_is_kept_for_nothing_and_its_loss_costs_a_repair(compared: tuple[Evidence, Prior]) -> None:
    old, new = FaultState(ONE, 1.0, 400.0), FaultState(THIRD, 1.0, 600.0)
    kept, instead = told(compared, {old: 1.0}, old, new)
    assert kept == 0.0
    assert instead == pytest.approx(compared[1].of_mode(compared[0].carrier.modes[THIRD]) - REPAIRED_NATS)


def said(old: FaultState, young: FaultState, likelier: float) -> list[Hypothesis]:
    return [Hypothesis((old,), likelier), Hypothesis((young,), 1.0 - likelier)]


def test_explanations_that_no_reading_tells_apart_score_alike_wherever_they_stand(
    compared: tuple[Evidence, Prior],
) -> None:
    evidence, prior = compared
    search = Search(evidence, evidence.carrier.modes, prior)
    never = FaultState("pump_degrade", 0.2, evidence.window.end_s)  # begins with the last reading: none shows it
    others = [FaultState(ONE, 0.1 * k, evidence.window.start_s + 7.0 * k) for k in range(1, 41)]
    scores = search.score([(each,) for other in others for each in (never, other)])[::2]
    assert len(set(scores.tolist())) == 1
    assert scores[0] == round(float(scores[0]), DECIMALS)
