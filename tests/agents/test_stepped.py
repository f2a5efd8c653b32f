"""An instrument that is known to be wrong and reads otherwise at once: its next readings are waited for, and once."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.monitoring.stepped import AGAIN, READINGS, Stepped
from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate import runner
from homeostat.evaluate.scenario import Fault, departing, repaired, scenario_of
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from tests.agents.test_monitoring import healthy
from tests.twin.followed import reactor

PLANT = reactor()
LOW = (FaultState("level_bias", 2.8, 1900.0),)
TICK_S = PLANT.description.timing.tick_s


def read(at_s: float, level: float, **rest: float) -> Snapshot:
    return Snapshot(at_s, {"L1": level, "T1": 310.0, **rest})


def stepped(known: tuple[FaultState, ...] = LOW) -> tuple[Stepped, float | None]:
    """A level of 7.6 L that reads 10.4 L at once, while ``known`` is there."""
    found = Stepped(PLANT.description)
    assert found.take(read(100.0, 7.6), known) is None
    return found, found.take(read(101.0, 10.4), known)


def test_a_step_of_what_is_known_to_be_wrong_is_waited_for() -> None:
    found, until_s = stepped()
    assert until_s == 101.0 + READINGS * TICK_S
    assert found.waiting(101.0) == found.waiting(until_s - 0.5) == {"L1"} and not found.waiting(until_s)


@pytest.mark.parametrize("known", [(), (FaultState("temp_bias", 5.0, 1900.0),), (FaultState("fouling", 0.3, 1.0),)])
def test_a_step_of_what_nobody_doubts_is_news(known: tuple[FaultState, ...]) -> None:
    found, until_s = stepped(known)
    assert until_s is None and not found.waiting(101.0)


def test_one_that_steps_again_and_again_is_not_waited_for_each_time() -> None:
    found, until_s = stepped()
    assert until_s is not None
    waits = 0
    for k in range(1, 300):
        found.take(read(102.0 + k, 7.6 + 2.8 * (k % 2)), LOW)
        waits += bool(found.waiting(102.0 + k))
    assert waits <= (300 // (AGAIN * READINGS) + 1) * READINGS


@given(st.lists(st.floats(-0.29, 0.29), max_size=60))
def test_what_a_process_can_do_is_no_step(moves: list[float]) -> None:
    found, level = Stepped(PLANT.description), 8.0
    for k, move in enumerate(moves):
        level += move
        assert found.take(read(100.0 + k, level), LOW) is None


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_reading_that_is_none_is_no_step_nor_the_begin_of_one(value: float) -> None:
    found, _ = Stepped(PLANT.description), None
    for at_s, level in ((100.0, 7.6), (101.0, value), (102.0, 7.6)):
        assert found.take(read(at_s, level), LOW) is None
    bad = Snapshot(103.0, {"L1": 20.0}, frozenset({"L1"}))
    assert found.take(bad, LOW) is None
    assert Stepped(PLANT.description).take(Snapshot(0.0, {}), LOW) is None


def test_two_instruments_are_waited_for_each_by_itself() -> None:
    known = (*LOW, FaultState("temp_bias", 5.0, 1900.0))
    found, until_s = stepped(known)
    assert until_s is not None and found.take(read(105.0, 10.4), known) is None
    assert found.take(Snapshot(106.0, {"L1": 10.4, "T1": 330.0}), known) == 106.0 + READINGS * TICK_S
    assert found.waiting(107.0) == {"L1", "T1"} and found.waiting(113.0) == {"T1"}


def test_a_reading_that_comes_seldom_is_timed_by_when_it_was_taken() -> None:
    """Once in 60 s a level that rises by 0.1 L/s: 6 L at once, and no step."""
    found = Stepped(PLANT.description)
    for at_s in range(100, 400):
        taken_s = float(at_s - at_s % 60)
        shown = Snapshot(float(at_s), {"L1": 0.1 * taken_s}, taken_s={"L1": taken_s})
        assert found.take(shown, LOW) is None


def test_after_a_gap_a_process_may_have_moved() -> None:
    found = Stepped(PLANT.description)
    assert found.take(read(100.0, 7.6), LOW) is None and found.take(read(110.0, 10.4), LOW) is None


@pytest.mark.slow
def test_a_level_transmitter_that_is_mended_does_not_stop_the_plant() -> None:
    """It read 2.84 L low: taken off a reading that is right again, its vessel runs over, and a fallback acts."""
    told = scenario_of(PLANT, [Fault("level_bias", 2.8390113379949327, 1915.0)], 301, 3480.0)
    run = runner.run(PLANT, repaired(departing(PLANT, told, (), "plant"), 3415.0), MemoryTrace(), DeclaredClock(1.0))
    (over,) = [e for e in run.record.entries if e.event.kind == "faults-ended"]
    assert run.outcome.value == "recovered" and 3415.0 < over.at_s < 3440.0


class Instrument(Stepped):
    """Of a plant with one instrument, of ``x``, which the fault ``hot`` is about."""

    def __init__(self, fastest: float | None) -> None:
        super().__init__(PLANT.description)
        self._tags, self._rules = {"hot": frozenset({"x"})}, {"x": QualityRule("x", 5.0, fastest=fastest)}


@pytest.mark.parametrize(("fastest", "asks_after_s"), [(None, 3.0), (0.5, 1.0 + READINGS)])
def test_what_it_reads_asks_for_attention_once_that_says_what_it_is(fastest: float | None, asks_after_s: float) -> None:
    scene = healthy()
    assert scene.until_attention(10, x=2.0) is not None and scene.monitoring.diagnose().faulty
    scene.watch(300)
    scene.monitoring._stepped = Instrument(fastest)
    scene.watch(1)
    began_s = scene.at_s
    assert scene.until_attention(20, x=6.0) == began_s + asks_after_s


def test_what_others_read_asks_for_attention_all_the_same() -> None:
    scene = healthy()
    assert scene.until_attention(10, x=2.0) is not None and scene.monitoring.diagnose().faulty
    scene.watch(300)
    scene.monitoring._stepped = Instrument(0.5)
    scene.watch(1)
    began_s = scene.at_s
    assert scene.until_attention(20, x=6.0, y=6.0) == began_s + 3.0
