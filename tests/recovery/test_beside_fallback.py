"""Beside the fallback: a limit that is violated at once whatever is done is no reason to stop the plant."""

from __future__ import annotations

from homeostat.domain.events.recovery import Attempted, Compared
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import AT_ONCE, Recovery, ticks
from tests.recovery.line import GOOD, feed

HOT = 313.2
"""Above the limit of 313 K already, whatever is done [K]."""
LESS = feed(0.01, "reduced")
"""A third of the feed cools by 0.03 K/s, where none cools by 0.1 K/s."""


def line(*answers: object, bounds: Bounds = AT_ONCE, last: int = 20) -> Recovery:
    return Recovery(ticks(1, last, HOT), action=ScriptedAction(*answers), bounds=bounds)  # type: ignore[arg-type]


def test_what_does_as_well_as_the_fallback_is_released_instead() -> None:
    done = line(LESS).run()
    assert done.handed_over == [] and len(done.released) == 1
    refused, approved = [e.approved for e in done.trace.of(Attempted)][:2]
    assert (refused, approved) == (False, True)
    (compared,) = done.trace.of(Compared)[:1]
    assert compared.chosen


def test_what_stays_longer_outside_is_not() -> None:
    done = line(GOOD).run()  # half feed holds the temperature
    assert done.handed_over and done.released == []


def test_the_plant_is_looked_at_again_soon_after_it() -> None:
    soon = Bounds(intervention=InterventionBounds(waits=0, back_s=7.0))
    done = line(LESS, LESS, bounds=soon, last=40).run()
    first = done.released[0]
    assert any(first + 7.0 <= at_s <= first + 9.0 for at_s in done.when(Compared))
