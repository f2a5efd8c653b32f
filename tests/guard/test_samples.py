"""What shows a sample now and then is judged by its samples, and a limit that rests on it alone is handled."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.guard import QualityChanged, ReadingJumped
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.quality import QualityWatch
from tests.guard.test_unseen import LONG, acted, ruled
from tests.guard.vessel import QUALITIES, TAGS, World, running

pytestmark = pytest.mark.quick

SAMPLES, LOST, FRESH_S = 3, 2, 5
"""As the tables have it that state a sampling time only."""
EVERY = st.integers(2, 40)
VALUES = st.lists(st.floats(300.0, 310.0, allow_nan=False), min_size=3, max_size=12, unique=True)


class Analyser:
    """A transmitter that shows a sample every ``every`` ticks, judged tick by tick."""

    def __init__(self, every: int, held: bool, fastest: float | None = None) -> None:
        self.every, self.held = every, held
        rule = QualityRule(
            "T", FRESH_S + LOST * every, 0.5, float(SAMPLES * every), fastest, FRESH_S, every_s=float(every)
        )
        self.noted: list[GuardEvent] = []
        self.watch = QualityWatch({"T": rule}, TAGS, lambda event, at_s: self.noted.append(event))
        self.now_s = 0

    def shows(self, value: float, taken_s: int, ticks: int) -> Snapshot:
        """The same for some ticks; where it is not held, with the time of the sample."""
        for _ in range(ticks):
            self.now_s += 1
            stamps = {} if self.held else {"T": float(taken_s)}
            seen = self.watch.assess(self.now_s, Snapshot(self.now_s, {"T": value}, taken_s=stamps))
        assert seen is not None
        return seen

    def samples(self, values: list[float], late: int = 0) -> None:
        for value in values:
            self.shows(value, max(self.now_s + 1 - late, 0), self.every)


@given(EVERY, VALUES, st.booleans(), st.data())
def test_between_its_samples_it_is_never_frozen_old_or_too_fast(
    every: int, values: list[float], held: bool, data: st.DataObject
) -> None:
    """As fast as the process can move it in the time of a sample, and told as late as a sample takes."""
    analyser = Analyser(every, held, fastest=10.0 / every)
    analyser.samples(values, late=data.draw(st.integers(0, every)))
    assert analyser.noted == []


@given(EVERY, VALUES)
def test_two_samples_in_a_row_may_be_lost_where_the_last_one_is_shown_for_them(every: int, values: list[float]) -> None:
    analyser = Analyser(every, held=True)
    for value in values:
        analyser.shows(value, 0, SAMPLES * every)
    assert analyser.noted == []


@given(EVERY, VALUES, st.booleans())
def test_one_that_freezes_is_bad_with_the_third_sample_that_is_the_same(
    every: int, values: list[float], held: bool
) -> None:
    analyser = Analyser(every, held)
    analyser.samples(values)
    analyser.samples(values[-1:] * (SAMPLES - 1))
    assert analyser.noted == []
    seen = analyser.shows(values[-1], analyser.now_s + 1, 1)
    (said,) = analyser.noted
    assert isinstance(said, QualityChanged) and "frozen" in said.reason and math.isnan(seen.values["T"])
    assert seen.frozen_s == {"T": 1 + (len(values) - 1) * every}
    assert not analyser.shows(values[-1] + 0.5, analyser.now_s + 1, 1).bad, "it shows something new"


@given(EVERY, VALUES)
def test_one_that_sends_nothing_is_old_and_not_frozen(every: int, values: list[float]) -> None:
    analyser = Analyser(every, held=False)
    analyser.samples(values)
    taken_s = analyser.now_s + 1 - every
    seen = analyser.shows(values[-1], taken_s, (LOST - 1) * every + FRESH_S + 2)
    (said,) = analyser.noted
    assert isinstance(said, QualityChanged) and "old" in said.reason
    assert seen.bad == {"T"} and seen.frozen_s == {}


def test_a_sample_that_is_further_off_than_the_process_moves_is_doubted() -> None:
    analyser = Analyser(30, held=True, fastest=0.01)
    analyser.samples([305.0, 305.2])
    analyser.shows(300.0, 0, 1)
    assert [type(event) for event in analyser.noted] == [ReadingJumped, QualityChanged]


@given(EVERY)
def test_others_are_no_older_because_an_analyser_may_be(every: int) -> None:
    """What a plant holds, and what has no rule of its own, is as old as before where no sample comes."""
    rules = {"T": QualityRule("T", 600.0, every_s=float(every)), "L": QualityRule("L", 5.0)}
    watch = QualityWatch(rules, TAGS, lambda event, at_s: None)
    watch.assess(1.0, Snapshot(1.0, {"T": 305.0, "L": 8.0, "Tx": 305.0}, accepted={"F.sp": 0.0}))
    seen = watch.assess(8.0, None)
    assert seen is not None and seen.bad == {"L", "Tx"} and seen.accepted == {} and seen.values["T"] == 305.0


def analysed() -> World:
    """A vessel whose level is told every 30 s, and limited by that alone."""
    rules = ruled()
    level = replace(QUALITIES["L"], stale_s=65.0, noise=0.1, frozen_s=90.0, every_s=30.0)
    return running(rules=replace(rules, qualities={**rules.qualities, "L": level}))


def shown(world: World, samples: int) -> None:
    for k in range(samples):
        world.vessel.wiggle = 0.0
        world.tick(30, L=8.0 + 0.01 * (k + 1))


def test_a_limit_on_an_analyser_that_works_is_left_alone() -> None:
    world = analysed()
    shown(world, 20)
    assert acted(world) == [] and "reading:L" not in world.alarms


def test_an_analyser_that_freezes_is_told_and_its_limit_has_a_fallback_within_a_few_samples() -> None:
    world = analysed()
    shown(world, 5)
    world.tick(30 * (SAMPLES - 1), L=8.05)
    assert acted(world) == []
    world.tick(30, L=8.05)
    assert acted(world) == ["drain"] and "reading:L" in world.alarms
    (reason,) = {e.reason for e in world.journal.of(FallbackActivated)}
    assert "frozen since" in reason
    world.tick(LONG, L=8.05)
    assert acted(world) == ["drain"], "a limit that only cannot be judged has no other fallback follow"
