"""Recurring: what has come and gone by itself is left alone, and nothing else is."""

from __future__ import annotations

import math

import pytest

from homeostat.agents.monitoring.recurring import Recurring
from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.diagnosis import Direction, FaultState, SymptomRule
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.snapshot import Snapshot

RULE = SymptomRule("S-HOT", "F-HEAT", Direction.HIGH, 0.0, 1.0, 0.0, (), "")
COLD = SymptomRule("S-COLD", "F-HEAT", Direction.LOW, 0.0, 1.0, 0.0, (), "")


class Plant:
    """One feature, a setpoint and a manual output, a tick a second."""

    def __init__(self) -> None:
        baseline = Baseline("F-HEAT", 0.0, 0.1, 0.0, -0.2, -0.1, 0.0, 0.1, 0.2)
        self.watches = [SymptomWatch(rule, baseline) for rule in (RULE, COLD)]
        self.recurring = Recurring(self.watches, {"T.sp": 40.0, "V.man": 1.0}, tick_s=1.0)
        self.now_s = 0.0
        self.outgrew = False

    def shows(self, value: float | None, for_s: int = 50, setpoint: float = 310.0, manual: float = math.nan) -> None:
        for _ in range(for_s):
            self.now_s += 1.0
            for watch in self.watches:
                if value is not None:
                    watch.update(value, self.now_s)
            self.recurring.take(Snapshot(self.now_s, {"T.sp": setpoint, "V.man": manual}), {"F-HEAT": value})
            self.outgrew = self.outgrew or self.recurring.outgrew

    def comes_and_goes(self, times: int, size: float = 2.0, setpoint: float = 310.0) -> None:
        for _ in range(times):
            self.shows(size, setpoint=setpoint)
            self.shows(0.0, setpoint=setpoint)

    @property
    def recurs(self) -> bool:
        return self.recurring.of(self.now_s, others=False) is not None


@pytest.fixture
def plant() -> Plant:
    return Plant()


def test_what_came_and_went_twice_is_expected_to_go_again(plant: Plant) -> None:
    plant.comes_and_goes(2)
    plant.shows(2.0, 30)
    found = plant.recurring.of(plant.now_s, others=False)
    assert found is not None and (found.rules, found.times) == (("S-HOT",), 2)
    assert "S-HOT came up to 2 times" in found.text
    plant.shows(0.0, 10)
    assert plant.recurs, "between two of its times, too: whatever explains the last one, it is gone"


@pytest.mark.parametrize("times", [0, 1])
def test_once_is_not_enough(plant: Plant, times: int) -> None:
    plant.comes_and_goes(times)
    plant.shows(2.0, 30)
    assert not plant.recurs


def test_what_grows_larger_is_called_at_once_and_once(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(2.4, 10)
    assert plant.recurs and not plant.outgrew
    plant.shows(2.6, 1)
    assert not plant.recurs and plant.recurring.outgrew
    plant.shows(2.6, 1)
    assert not plant.recurring.outgrew


def test_what_stands_longer_is_called(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(2.0, 70)
    assert plant.recurs
    plant.shows(2.0, 10)
    assert not plant.recurs and plant.outgrew


def test_what_is_on_the_other_side_for_the_first_time_is_not_as_before(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(-2.0, 10)
    assert not plant.recurs


def test_the_other_side_counts_once_it_came_and_went_as_well(plant: Plant) -> None:
    for size in (2.0, -2.0, 2.0, -2.0):
        plant.shows(size)
        plant.shows(0.0, 5)
    plant.shows(-2.0, 10)
    assert plant.recurs


def test_what_went_while_something_was_moved_did_not_go_by_itself(plant: Plant) -> None:
    for setpoint in (309.0, 310.0, 309.0):
        plant.shows(2.0, 25, setpoint=setpoint + 0.5)
        plant.shows(2.0, 25, setpoint=setpoint)
        plant.shows(0.0, setpoint=setpoint)
    plant.shows(2.0, 10, setpoint=309.0)
    assert not plant.recurs
    plant.recurring.over(0.0)
    plant.shows(2.0, 1, setpoint=309.0)
    assert plant.recurs, "what was wrong was over each time, whatever was done about it"


def test_what_came_under_other_commands_says_nothing(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(0.0, 5, setpoint=300.0)
    plant.shows(2.0, 10, setpoint=300.0)
    assert not plant.recurs
    plant.shows(0.0, 10, setpoint=300.0)
    plant.shows(0.0, 5, manual=0.5)
    plant.shows(2.0, 10, manual=0.5)
    assert not plant.recurs, "a loop that is by hand is another plant"


def test_what_has_not_come_for_long_is_no_swing_any_more(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(0.0, 500)
    assert not plant.recurs
    plant.shows(2.0, 10)
    assert not plant.recurs


def test_a_symptom_of_which_nobody_knows_how_often_it_came_is_in_the_way(plant: Plant) -> None:
    plant.comes_and_goes(3)
    plant.shows(2.0, 10)
    assert plant.recurs and plant.recurring.of(plant.now_s, others=True) is None


def test_a_value_that_is_not_known_neither_ends_nor_begins_one(plant: Plant) -> None:
    plant.comes_and_goes(2)
    plant.shows(2.0, 10)
    plant.shows(None, 10)
    assert plant.recurs
    plant.shows(None, 60)
    assert not plant.recurs, "it stands longer than before, as far as anybody knows"


def test_what_stood_before_or_was_answered_is_looked_at_as_ever(plant: Plant) -> None:
    plant.shows(0.0, 200)
    plant.comes_and_goes(3)
    plant.shows(2.0, 10)
    new, old = FaultState("leak", 0.01, 250.0), FaultState("fouling", 0.3, 100.0)
    assert plant.recurring.of(plant.now_s, False, (new,), ["S-HOT"]) is not None
    assert plant.recurring.of(plant.now_s, False, (new, old), ["S-HOT"]) is None
    plant.recurring.released_s = 300.0
    assert plant.recurring.of(plant.now_s, False, (new,), ["S-HOT"]) is None


def test_what_another_symptom_led_to_is_looked_at_as_ever(plant: Plant) -> None:
    """Its symptom has gone because a loop makes up for it; what swings beside it says nothing of it."""
    plant.comes_and_goes(3)
    leak = FaultState("leak", 0.01, plant.now_s)
    assert plant.recurring.of(plant.now_s, False, (leak,), ["S-HOT"]) is not None
    assert plant.recurring.of(plant.now_s, False, (leak,), ["S-MASS-LOSS"]) is None


def test_what_is_over_may_end_the_swing_it_was_part_of(plant: Plant) -> None:
    """Times that count anew may be nearer to one another: then it is none that is due."""
    plant.comes_and_goes(1)
    plant.shows(2.0, 25, setpoint=310.5)
    plant.shows(2.0, 25)
    plant.shows(0.0)
    plant.comes_and_goes(1)
    plant.shows(0.0, 180)
    assert plant.recurs
    plant.recurring.over(0.0)
    assert plant.recurring.of(plant.now_s, False) is None


def test_a_time_that_nobody_saw_the_end_of_says_nothing(plant: Plant) -> None:
    plant.shows(2.0, 20)
    plant.shows(None, 3000)
    plant.shows(2.0, 1)
    plant.shows(0.0)
    plant.comes_and_goes(2)
    plant.shows(2.0, 70)
    assert plant.recurs
    plant.shows(2.0, 10)
    assert not plant.recurs, "an hour without a reading is no hour that it stood"
