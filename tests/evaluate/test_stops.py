"""Stops that are tried: an inlet is shut to see whether it is stuck, and a batch that was stopped goes on."""

from __future__ import annotations

import functools

import pytest

from homeostat.domain.events.recovery import Probed, ProbeEnded, Waited
from homeostat.domain.events.trips import FallbackActivated
from homeostat.evaluate import runner
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import departing, scenario_of
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant


@functools.cache
def module() -> Plant:
    return load_plant("mixing_module")


def batch(spec: str) -> Run:
    told = departing(module(), scenario_of(module(), [], 401, 600.0), (spec,), "plant")
    return runner.run(module(), told, MemoryTrace(), DeclaredClock(1.0))


def of(done: Run, kind: type) -> list[object]:
    return [entry.event for entry in done.record.entries if isinstance(entry.event, kind)]


@pytest.mark.slow
def test_a_weak_supply_is_told_from_an_inlet_that_is_stuck_by_shutting_it() -> None:
    """Under one of them the batch goes on, under the other every way through it overflows a tank."""
    done = batch("fill_rate * 0.6 from 15")
    (probed,) = of(done, Probed)
    assert isinstance(probed, Probed) and probed.state == "holding" and "stuck_open_VI201" in probed.apart
    states = [state for state, _ in done.record.states]
    assert states[-1] == "complete" and states.count("held") == 1 and not of(done, FallbackActivated)


@pytest.mark.slow
def test_a_batch_that_was_stopped_goes_on_although_nobody_can_say_that_it_comes_to_its_end() -> None:
    """After the test the twin says that the supply will fade to nothing, under which no batch is ever complete."""
    done = batch("fill_rate * 0.3 from 20 over 60")
    assert len(of(done, Probed)) == len(of(done, ProbeEnded)) == 1, "going back is no test"
    states = [state for state, _ in done.record.states]
    at = states.index("held")
    assert states[at + 1] == states[at - 2] == "filling_B202" and states[-1] == "complete"


@pytest.mark.slow
def test_where_a_stop_does_not_tell_it_is_looked_at_again_for_as_long_as_the_fallback_leaves_time() -> None:
    """For six seconds a supply that swings looks like an inlet that is stuck; some more show the level standing."""
    done = batch("fill_rate * 0.5 from 10 every 40")
    waits = [w.seconds for w in of(done, Waited) if isinstance(w, Waited)]
    assert waits and max(waits) < 5.0, "between a test and the fallback there are seconds"
    assert [state for state, _ in done.record.states][-1] == "complete" and not of(done, FallbackActivated)
