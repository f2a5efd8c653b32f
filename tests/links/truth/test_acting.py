"""Courses that chance gives: within the size, from nothing, smooth, and the same however often they are looked at."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.disturbance import Disturbance
from homeostat.links.truth.acting import Acting, acting
from homeostat.links.truth.members import Members
from homeostat.links.truth.process import Departed, PlantConfiguration, TrueProcess
from homeostat.plants.plant import load_plant
from homeostat.plants.truth import true_model

SEEDS = st.integers(0, 2**63 - 1)
INTERVALS = st.sampled_from(["every 40", "every 10..300", "every 1800..12600"])
ROUNDED = 1e-12


def one(text: str, seed: int = 1) -> Acting:
    (found,) = acting([Disturbance.parse(text)], seed)
    return found


def shares(of: Acting, times_s: list[float]) -> list[float]:
    return [of.share(at_s) for at_s in times_s]


RANDOM = st.sampled_from(["wandering", "bursting"])
ASKED = st.lists(st.floats(0.0, 40_000.0), min_size=1, max_size=20)


@given(SEEDS, RANDOM, INTERVALS, ASKED)
def test_it_begins_with_nothing_and_stays_within_its_size(seed: int, shape: str, every: str, at_s: list[float]) -> None:
    found = one(f"T_coolant + 3 {shape} {every} from 100", seed)
    assert found.share(100.0) == 0.0 and found.share(99.0) == 0.0
    lowest = -1.0 if shape == "wandering" else 0.0
    assert all(lowest - ROUNDED <= share <= 1.0 + ROUNDED for share in shares(found, at_s))
    assert all(abs(found.applied(350.0, each) - 350.0) <= 3.0 + 1e-9 for each in at_s)


@given(SEEDS, st.floats(5.0, 500.0), st.floats(1.0, 500.0), st.floats(0.0, 40_000.0))
def test_what_wanders_has_neither_jumps_nor_kinks(seed: int, least: float, more: float, at_s: float) -> None:
    """By hand: from -1 to 1 within T the steepest slope is 3 / T and the largest curvature 12 / T^2."""
    found, step = one(f"T_coolant + 1 wandering every {least}..{least + more}", seed), 1e-3 * least
    before, now, after = shares(found, [at_s, at_s + step, at_s + 2.0 * step])
    assert abs(now - before) <= 3.0 * step / least + 1e-9
    assert abs(after - 2.0 * now + before) <= 12.0 * (step / least) ** 2 + 1e-9


@given(SEEDS, RANDOM, INTERVALS, ASKED)
def test_it_is_the_same_however_it_is_looked_at(seed: int, shape: str, every: str, at_s: list[float]) -> None:
    """In any order, in any steps, again from the start, by somebody who comes later, and beside something else."""
    text = f"UA * 0.7 {shape} {every} from 50 over 200"
    first = dict(zip(at_s, shares(one(text, seed), at_s), strict=True))
    forward = one(text, seed)
    for fine in np.linspace(0.0, max(at_s), 300):
        forward.share(float(fine))
    assert {each: forward.share(each) for each in sorted(at_s)} == first
    assert {each: one(text, seed).share(each) for each in at_s} == first
    beside = acting([Disturbance.parse("T_feed + 1 wandering every 7"), Disturbance.parse(text)], seed)[1]
    assert {each: beside.share(each) for each in at_s} == first


@given(SEEDS, RANDOM)
def test_other_seeds_names_and_ranks_have_other_courses(seed: int, shape: str) -> None:
    texts = [f"{name} * 0.9 {shape} every 20..60" for name in ("UA", "F3_max", "UA")]
    alike = acting([Disturbance.parse(text) for text in texts], seed)
    alike += acting([Disturbance.parse(texts[0])], seed + 1)
    times_s = [11.0, 222.0, 3333.0]
    assert len({tuple(shares(each, times_s)) for each in alike}) == 4


@given(SEEDS, st.integers(1, 200))
def test_values_are_shares_after_intervals_of_the_stated_length(seed: int, every: int) -> None:
    """With one length each value is where its interval ends, and half-way it is the mean of two."""
    found = one(f"T_coolant + 1 wandering every {every}", seed)
    ends = shares(found, [float(k * every) for k in range(40)])
    middles = shares(found, [(k + 0.5) * every for k in range(39)])
    assert middles == pytest.approx([(a + b) / 2.0 for a, b in pairwise(ends)], abs=1e-9)


def test_values_are_spread_evenly_and_so_are_intervals() -> None:
    found = one("T_coolant + 1 wandering every 10")
    values = np.array(shares(found, [10.0 * k for k in range(1, 5001)]))
    assert np.mean(values) == pytest.approx(0.0, abs=0.04)  # by hand: 5 standard errors of 0.577 / 5000^0.5
    assert np.std(values) == pytest.approx(1.0 / 3.0**0.5, rel=0.05)
    bursts = one("T_coolant + 1 bursting every 10..30 back 5")
    course = np.array(shares(bursts, [0.5 * k for k in range(200_000)]))
    tops = np.flatnonzero((course[1:-1] > course[:-2]) & (course[1:-1] >= course[2:]))
    lasted = 0.5 * np.diff(tops) - 5.0
    assert lasted.min() > 9.0 and lasted.max() < 31.0
    assert np.mean(lasted) == pytest.approx(20.0, rel=0.03) and np.std(lasted) == pytest.approx(5.77, rel=0.05)


@pytest.mark.parametrize(
    ("at_s", "share"),
    [(50.0, 0.25), (99.999, 1.0), (100.0, 1.0), (110.0, 0.5), (105.0, 0.84375), (120.0, 0.0), (170.0, 0.25)],
)
def test_a_burst_by_hand(at_s: float, share: float) -> None:
    assert one("UA * 0.65 bursting every 100 back 20").share(at_s) == pytest.approx(share, abs=1e-4)


def test_without_a_time_to_go_back_a_burst_ends_at_once() -> None:
    found = one("UA * 0.5 bursting every 100")
    assert found.applied(2.0, 99.99) == pytest.approx(1.0, abs=1e-3) and found.applied(2.0, 100.0) == 2.0


def configured(*texts: str, seed: int) -> PlantConfiguration:
    plant = load_plant("cstr")
    truth = true_model(plant.model)
    assert truth is not None
    happens = tuple(map(Disturbance.parse, texts))
    departed = Departed(truth, np.array(truth.departures.neutral()), happens, seed)
    return PlantConfiguration(plant.true_parameters(5), plant.start, (), 1e6, 11, 0.0, departed)


def test_a_plant_follows_its_course_and_so_do_its_copies() -> None:
    """Intervals are long beside the five ticks in which copies hold a parameter."""
    plant, text = load_plant("cstr"), "UA * 0.5 wandering every 100..150 from 10"
    configuration = configured(text, seed=3)
    process = TrueProcess(plant.model, plant.description, configuration)
    usual, course = process._parameters.copy(), one(text, 3)
    column = plant.model.parameters.index("UA")
    for second in range(400):
        process.advance()
        assert process._parameters[0, column] == course.applied(usual[0, column], float(second))
    members, schedules = Members(plant.model, plant.description, configuration), np.tile(plant.start, (2, 400, 1))
    record = members.simulate(np.tile(members.start(), (2, 1)), schedules, 0.0, 400, 1).record
    copied, true = plant.model.truth(record[:1], schedules[:1])["T1"], process.truth().signals["T1"]
    assert copied == pytest.approx(true, abs=0.2) and np.ptp(true) > 1.0


def test_people_move_a_setpoint_along_a_course() -> None:
    plant, text = load_plant("cstr"), "T1.sp + 2 wandering every 30..60 from 20"
    process = TrueProcess(plant.model, plant.description, configured(text, seed=4))
    course = one(text, 4)
    for second in range(200):
        shown = process.advance()["T1.sp"]
        assert shown == pytest.approx(course.applied(310.0, float(second)), abs=1e-6)
