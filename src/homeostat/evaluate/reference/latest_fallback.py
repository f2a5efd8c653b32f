"""The latest fallback by hindsight: how soon after a fault a strategy had to act; no agent may see it."""

from __future__ import annotations

import math

from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.best_route import inside
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.plants.assembly import fallbacks, new_sequencer
from homeostat.plants.plant import Plant


def latest_fallback(plant: Plant, scenario: Scenario, longest_s: int = 60) -> int | None:
    """Latest whole second after the first onset up to which some strategy keeps the plant inside every hard limit.

    None where acting at the onset does not; at most ``longest_s``.
    """
    assert scenario.onset_s is not None
    found: int | None = None
    for after_s in range(longest_s + 1):
        if not any(_keeps(plant, scenario, s, scenario.onset_s + after_s) for s in fallbacks(plant)):
            return found
        found = after_s
    return found


def _keeps(plant: Plant, scenario: Scenario, strategy: FallbackStrategy, at_s: float) -> bool:
    """Whether ``strategy`` keeps every hard limit and criterion to the end if it acts at ``at_s`` [s]."""
    process = watch(open_process(plant, scenario), _FallingBack(new_sequencer(plant), strategy, at_s))
    return inside(process.truth(), plant.description.limits)


class _FallingBack:
    """Implements ``BasicControl``: the recipe, and one strategy from a time on."""

    def __init__(self, sequencer: Sequencer, strategy: FallbackStrategy, at_s: float) -> None:
        self._sequencer, self._strategy, self._at_s = sequencer, strategy, at_s

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """The recipe's commands, and once the strategy's instead."""
        if snapshot.at_s < self._at_s:
            return self._sequencer.sample(snapshot)
        self._at_s = math.inf
        self._sequencer.load(self._strategy.actions, snapshot.at_s, aborting=True)
        return self._strategy.actions.commands
