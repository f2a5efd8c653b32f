"""Equal seeds with declared thinking give equal runs: the plant, the guard, recovery and its thread, event by event."""

from __future__ import annotations

from functools import cache

import pytest

from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import Event, MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant

pytestmark = pytest.mark.slow

RUNS = {
    "cstr": ("cool_stuck_closed", 900.0, 1010.0),
    "mixing_module": ("stuck_closed_VI202", 60.0, 110.0),
}
"""Plant -> a fault to which there is an answer, its onset [s], and when the run ends [s]."""


@cache
def plant(name: str) -> Plant:
    return load_plant(name)


def events(name: str, seed: int) -> tuple[str, list[tuple[float, Event]]]:
    """The end of a run's chain, and what happened in it, with its times; what the wall clock says is left out."""
    fault, onset_s, end_s = RUNS[name]
    trace = MemoryTrace()
    run(plant(name), scenario(plant(name), fault, seed, onset_s=onset_s, end_s=end_s), trace, DeclaredClock(1.0))
    return trace.last, [(entry.at_s, entry.event) for entry in trace.entries]


@pytest.mark.parametrize("name", [pytest.param("cstr", marks=pytest.mark.wide), "mixing_module"])
def test_a_whole_run_is_the_same_a_second_time(name: str) -> None:
    first = events(name, 1)
    assert {"diagnosed", "attempted"} <= {event.kind for _, event in first[1]}
    assert events(name, 1) == first
    assert events(name, 2) != first
