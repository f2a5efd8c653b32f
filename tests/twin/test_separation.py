"""Separation: what is predicted to tell hypotheses apart does so, and what is not does not."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis, by_fault_set
from homeostat.domain.recovery import ActionSet, Command
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.twin.isolation.evidence import TEMPER
from homeostat.twin.separation import SIZE, _expected
from homeostat.twin.twin import Interruption, Twin
from tests.twin.followed import HEALTHY_S, LEARN_S, disturbed, follow, reactor

WAIT = ActionSet((), "normal")
LESS_FEED = ActionSet((Command("F1.sp", 0.0267, 0.005),), "reduced_load")
ALIKE = (
    Hypothesis((FaultState("T2_reads_high", 8.0, 1500.0),), 0.4),
    Hypothesis((FaultState("unknown_heat_R1", -1.1, 1500.0),), 0.3),
    Hypothesis((FaultState("unknown_heat_R1_UA", 104.0, 1500.0),), 0.3),
)
"""A feed that is said to be warmer than it is looks like a loss of heat, and like a better jacket."""
NOWHERE = np.zeros(2)
LIES = "T2 reads + 8 from 1500 over 40"
"""Slowly enough that the feed itself could do it: a step would say by itself whose it is."""


def test_the_worked_example() -> None:
    departed = np.array([[3.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    nats = _expected(departed, NOWHERE)
    assert nats[0, 1] == pytest.approx(9.0 / (2.0 * TEMPER)) and nats[0, 0] == nats[1, 1] == 0.0


def test_another_size_of_the_same_explains_what_it_can() -> None:
    departed = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 2.0]])
    nats = _expected(departed, np.zeros(3))
    by_hand = min(((2.0 - s) ** 2 + ((s - 1.0) / SIZE) ** 2) for s in np.linspace(0.0, 3.0, 30001)) / (2.0 * TEMPER)
    assert nats[0, 1] == pytest.approx(by_hand, rel=1e-6)
    assert nats[0, 1] < 1.0 / (2.0 * TEMPER) < nats[0, 2], "what points another way is explained by no size"


def test_what_the_model_is_wrong_by_counts_for_little() -> None:
    departed = np.array([[3.0, 0.0], [0.0, 0.0]])
    assert _expected(departed, np.array([6.0, 6.0]))[0, 1] == pytest.approx(0.25 * _expected(departed, NOWHERE)[0, 1])


@functools.cache
def lying_feed(moved: bool) -> Twin:
    """A twin of a plant whose feed thermometer comes to read 8 K high, 300 s after the feed was reduced, or was not."""
    plant, end_s = reactor(), 2050
    told = departing(plant, scenario(plant, "none", 1, end_s=float(end_s)), (LIES,), "plant")
    process = open_process(plant, told)
    link, twin = SimulatedLink(process), Twin(plant.model, plant.description, plant.twin, 0)
    for _ in range(end_s):
        snapshot = link.advance()
        twin.observe(snapshot)
        if snapshot.at_s == HEALTHY_S:
            twin.calibrate(LEARN_S)
        if moved and snapshot.at_s == 1750.0:
            process.command(LESS_FEED.commands)
    return twin


def nats(actions: ActionSet, seconds: int) -> np.ndarray:
    twin = follow(disturbed(1, 1750, LIES, mismatch="plant"))
    found, still = twin.separation(ALIKE, [WAIT, actions], seconds)
    assert found.shape == (2, 3, 3) and still.tolist() == [True, True]
    return found


def test_at_one_feed_they_stay_alike_whatever_is_waited_for() -> None:
    assert nats(LESS_FEED, 300)[0].max() < 0.1


def test_less_feed_is_predicted_to_tell_them_apart_and_the_more_the_longer() -> None:
    short, long = nats(LESS_FEED, 120)[1], nats(LESS_FEED, 300)[1]
    assert long[0, 2] > 0.5 and long[1, 2] > 0.5, "the jacket from both"
    assert (long >= short - 1e-9).all() and np.diag(long).max() == 0.0


def test_equal_questions_have_equal_answers() -> None:
    assert np.array_equal(nats(LESS_FEED, 120), nats(LESS_FEED, 120))


@pytest.mark.slow
def test_what_was_predicted_comes_true_after_the_move_and_not_without_it() -> None:
    every = [fault.name for fault in reactor().description.faults]
    likeliest = [by_fault_set(lying_feed(moved).explain(every, (), False, 1700.0)) for moved in (False, True)]
    assert {each.name for each in likeliest[0]} >= {"T2_reads_high", "unknown_heat_R1"}
    assert likeliest[0][0].probability < 0.75
    assert likeliest[1][0].name == "T2_reads_high" and likeliest[1][0].probability >= 0.6
    assert "unknown_heat_R1" not in {each.name for each in likeliest[1]}


def test_what_is_broken_off_is_rolled_out_with_what_ends_it() -> None:
    twin = follow(disturbed(1, 1750, LIES, mismatch="plant"))
    stop = ActionSet((Command("F1.sp", 0.0, None), Command("XV1.cmd", 0.0, None)), "holding")
    ended = twin.roll_out(LESS_FEED, ALIKE[:1], Interruption(60.0, stop))
    alone = twin.roll_out(LESS_FEED, ALIKE[:1])
    feed, lasting = ended.trajectory.signals["F1.sp"], alone.trajectory.signals["F1.sp"]
    assert ended.digest == LESS_FEED.digest and ended.trajectory.length == alone.trajectory.length
    assert np.array_equal(feed[:, :60], lasting[:, :60]) and (feed[:, 61:] == 0.0).all()
    early = {tag: values[:, :60] for tag, values in ended.trajectory.signals.items()}
    for tag, values in early.items():
        assert np.allclose(values, alone.trajectory.signals[tag][:, :60], equal_nan=True), tag


def test_what_ends_it_at_once_leaves_nothing_of_it() -> None:
    twin = follow(disturbed(1, 1750, LIES, mismatch="plant"))
    stop = replace(LESS_FEED, commands=(Command("F1.sp", 0.0, None),))
    ended = twin.roll_out(LESS_FEED, ALIKE[:1], Interruption(0.0, stop))
    assert (ended.trajectory.signals["F1.sp"][:, 1:] == 0.0).all()


def test_readings_of_an_analyser_promise_no_more_than_its_samples() -> None:
    plant = reactor()
    rule = replace(plant.description.qualities["T1"], every_s=20.0, frozen_s=60.0, fastest=None)
    description = replace(plant.description, qualities={**plant.description.qualities, "T1": rule})
    seldom, often = (Twin(plant.model, d, plant.twin, 0) for d in (description, plant.description))
    for snapshot in disturbed(1, 1600):
        seldom.observe(snapshot)
        often.observe(snapshot)
    promised, told = (each.separation(ALIKE, [WAIT, LESS_FEED], 300.0)[0] for each in (often, seldom))
    apart = promised > 1e-9
    assert np.all(told[apart] < promised[apart]) and np.all(told[apart] > promised[apart] / 20.0)
