"""The end of a run in words: what was done when, and which limits were not kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import Command
from homeostat.journal import Event
from homeostat.record.result import Exposure, Result, read_result
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary
from tests.plants.cstr.reactor import plant

PLANT = plant()
FIRST, LAST = (Command("F1.sp", 0.01, None),), (Command("F1.sp", 0.02, None),)


def released(commands: tuple[Command, ...]) -> RequestAnswered:
    """The guard's word for it; every set of commands is a request of its own."""
    return RequestAnswered(str(commands), "search", "d", "confirmed")


@pytest.fixture
def result(record: Path) -> Result:
    found = read_result(record)
    assert found is not None
    return found


def rows(result: Result, *events: tuple[Event, float]) -> dict[str, str]:
    story = Story(PLANT)
    for event, at_s in events:
        list(story.tell(event, at_s))
    lines = list(summary(result, story, PLANT, Path("run")))[1:]
    return {line[2:13].strip(): line[14:] for line in lines}


def test_what_was_done_is_told_with_its_own_time(result: Result) -> None:
    once = replace(result, actions=FIRST, released_s=2008.0)
    assert rows(once, (released(FIRST), 2008.0))["Done"] == "by the search: F1.sp to 0.01 L/s (at 2008 s)"
    again = replace(result, actions=LAST, released_s=2008.0)
    assert rows(again, (released(FIRST), 2008.0), (released(LAST), 4021.0))["Done"] == (
        "by the search: F1.sp to 0.02 L/s (at 4021 s; the first release was at 2008 s)"
    )


def test_what_is_held_produces_next_to_nothing_at_the_end_and_may_have_lost_little(result: Result) -> None:
    held = replace(result, outcome=Outcome.HELD, production_loss=0.059)
    headline = next(iter(summary(held, Story(PLANT), PLANT, Path("run"))))
    assert headline == "Held: the plant is safe, but at the end it produces next to nothing."
    assert rows(held)["Production"].startswith("5.9 % lost since")


@pytest.mark.parametrize(
    ("share", "told"), [(-0.3158, "31.6 % more since"), (0.304, "30.4 % lost since"), (-0.0002, "0.0 % lost since")]
)
def test_what_is_gained_is_not_lost(result: Result, share: float, told: str) -> None:
    assert rows(replace(result, production_loss=share))["Production"].startswith(told)


def test_a_fallback_is_told_with_its_own_time(result: Result) -> None:
    fell = replace(result, actor="fallback", actions=LAST, released_s=2008.0)
    events: list[tuple[Event, float]] = [
        (released(FIRST), 2008.0),
        (FallbackActivated("isolate", LAST, "too hot"), 2093.0),
    ]
    assert rows(fell, *events, (released(FIRST), 4000.0))["Done"] == (
        "by the fallback: F1.sp to 0.02 L/s (at 2093 s; the first release was at 2008 s)"
    )


def test_a_limit_that_was_not_kept_is_violated(result: Result) -> None:
    outside = replace(result, limit_exposure_s=(Exposure("LIM-T-HIGH", 3.0, 49.0),))
    assert rows(outside)["Limits"] == ("LIM-T-HIGH violated for 49 s, 3 s of them after the fault was detected")


def cost(*items: tuple[str, float], worth: float = 30.0) -> Cost:
    return Cost(tuple(CostItem(name, amount) for name, amount in items), worth)


def test_what_it_cost_is_told_with_its_share_and_the_items_that_are_most_of_it(result: Result) -> None:
    """A gain is in the sum and among no items; of more than four the dearest are named."""
    items = (("production", 3.02), ("release", 0.3), ("A", 0.1), ("B", 2.0), ("C", 1.5), ("gain", -0.92))
    told = rows(replace(result, cost=cost(*items), currency="EUR"))["Cost"]
    assert told == "6.0 EUR (20.0 % of what is made by design): production 3.0, B 2.0, C 1.5, release 0.3"
    assert rows(replace(result, cost=cost(), currency="EUR"))["Cost"] == (
        "0.0 EUR (0.0 % of what is made by design): nothing"
    )
    assert rows(replace(result, cost=cost(("release", 0.3), worth=0.0), currency="EUR"))["Cost"] == (
        "0.3 EUR: release 0.3"
    )


def test_a_result_without_a_cost_tells_none(result: Result) -> None:
    assert result.cost is not None and "Cost" in rows(result)
    assert "Cost" not in rows(replace(result, cost=None))
