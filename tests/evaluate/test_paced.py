"""What happens in a run does not depend on its pace."""

from __future__ import annotations

import threading
import time

import pytest

from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.observation import Observation
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.journal.memory import Entry
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant
from homeostat.recovery.exchange.pacing import FASTEST, Pacing

pytestmark = pytest.mark.slow

END_S = 130.0


def happened(operation: Operation) -> list[Entry]:
    plant, trace, found = load_plant("mixing_module"), MemoryTrace(), []
    trace.subscribe(lambda event, at_s: found.append(Entry(at_s, event)))
    run(plant, scenario(plant, "stuck_closed_VI202", 1, end_s=END_S), trace, DeclaredClock(1.0), operation=operation)
    return found


def test_equal_seeds_give_equal_runs_at_any_pace_and_after_any_pause() -> None:
    pacing, pauses = Pacing(FASTEST), [20.0, 75.0]

    def onlooker(seen: Observation) -> None:
        if pauses and seen.now_s >= pauses[0]:
            pauses.pop(0)
            pacing.pause()

    def person() -> None:
        while (pace := pacing.now) is not None:
            if pace.stands:
                time.sleep(0.2)
                pacing.choose(300.0)
                pacing.go_on()
            time.sleep(0.005)

    looking = threading.Thread(target=person)
    looking.start()
    paced = happened(Operation(pacing=pacing, onlooker=onlooker))
    looking.join(30.0)
    assert pauses == [] and any(isinstance(entry.event, ReleasedActions) for entry in paced)
    assert paced == happened(Operation())
