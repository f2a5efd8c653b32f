"""Where an answer is a set of items, people are told what to look at; where it is one item, nothing."""

from __future__ import annotations

import pytest

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultProbability, FaultState, Hypothesis
from homeostat.domain.events.recovery import Diagnosed
from homeostat.record.story.apart import told_apart
from homeostat.record.story.story import Story
from tests.twin.followed import reactor

PLANT = reactor().description


def held(*said: tuple[str, float]) -> list[FaultProbability]:
    return [
        FaultProbability(tuple(FaultState(name, 1.0, 5.0) for name in names.split("+") if name), p) for names, p in said
    ]


@pytest.mark.parametrize(("said", "looks"), [
    ((("unknown_heat_R1", 0.6), ("temp_bias", 0.3)), "a look at R1, a second reading of T1"),
    ((("cool_stuck_closed", 0.5), ("temp_bias", 0.4)), "where V2 stands, a second reading of T1"),
    ((("cool_stuck_closed", 0.5), ("V2_stuck", 0.4)), ""),
    ((("temp_bias", 0.9), ("unknown_heat_R1", 0.04)), ""),
    ((("temp_bias", 0.5), ("", 0.5)), ""),
    ((("temp_bias", 0.5), (SOMETHING_ELSE, 0.5)), ""),
    ((("leak", 0.5), ("leak+level_bias", 0.4)), "a second reading of L1"),
    ((("of another plant", 0.5), ("temp_bias", 0.5)), ""),
    ((), ""),
], ids=["a balance or an instrument", "an actuator or an instrument", "one item, two names", "one is far likelier",
        "or nothing", "or something else", "beside what is sure", "an unknown name", "nothing was said"])  # fmt: skip
def test_each_item_that_may_be_meant_is_looked_at(said: tuple[tuple[str, float], ...], looks: str) -> None:
    assert told_apart(held(*said), PLANT) == looks


def test_the_story_says_it_behind_the_explanations() -> None:
    hypotheses = tuple(Hypothesis(b.faults, b.probability) for b in held(("unknown_heat_R1", 0.6), ("temp_bias", 0.4)))
    (line,) = Story(PLANT).tell(Diagnosed((), hypotheses), 900.0)
    assert line.text.endswith("; told apart by a look at R1, a second reading of T1")
