"""The latest fallback by hindsight: how soon after a fault a strategy had to act; no agent may see it."""

from __future__ import annotations

from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.best_route import inside
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import fallbacks, new_sequencer


def latest_fallback(plant: Plant, scenario: Scenario, longest_s: int = 60) -> int | None:
    """Latest second after the first onset (to ``longest_s``) at which a fallback keeps every hard limit; or None."""
    assert scenario.onset_s is not None
    found: int | None = None
    for after_s in range(longest_s + 1):
        if not any(_keeps(plant, scenario, s, scenario.onset_s + after_s) for s in fallbacks(plant)):
            return found
        found = after_s
    return found


def _keeps(plant: Plant, scenario: Scenario, strategy: FallbackStrategy, at_s: float) -> bool:
    """Whether ``strategy`` keeps every hard limit and criterion to the end if it acts at ``at_s`` [s]."""
    sequencer, begun = new_sequencer(plant), False

    def recipe(snapshot: Snapshot) -> tuple[Command, ...]:
        nonlocal begun
        if begun or snapshot.at_s < at_s:
            return sequencer.sample(snapshot)
        begun = True
        sequencer.load(strategy.actions, snapshot.at_s, aborting=True)
        return strategy.actions.commands

    return inside(watch(open_process(plant, scenario), recipe).truth(), plant.description.limits)
