"""What a search tries, judged also with actuators that nobody has seen move where they are.

Only what moves one of them is tried once more, so that nothing is spent where none is at rest. See
:mod:`homeostat.agents.reliance` for what is released.
"""

from collections.abc import Sequence

import numpy as np

from homeostat.agents.reliance import keeping, leaves, unseen
from homeostat.agents.search.cost import Cost
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet
from homeostat.process.types import Flags, Table
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin


class Unseen:
    """Judges candidates of one state that have no later steps."""

    def __init__(self, machine: StateMachine, cost: Cost) -> None:
        """``machine`` says what its states command by design."""
        self._machine, self._cost = machine, cost

    def judge(self, twin: Twin, ensemble: Ensemble, some: Sequence[ActionSet]) -> Table:
        """What each of ``some`` comes to on ``ensemble``, with its hard margins as :meth:`Cost.where_held` has them."""
        resting = unseen(twin.resting, [self._machine.state(some[0].target)])
        signals, dt_s = twin.try_many(ensemble, twin.schedules(some, twin.horizon), False, bool(resting))
        rows = self._cost.judge(signals, dt_s, ensemble.weights, some)
        moved: Flags = np.zeros(len(some), dtype=np.bool_)
        for element in resting:
            moved |= leaves(element, signals, len(some))
        if not moved.any():
            return rows
        alone = ActionSet((), some[0].target)
        held = [keeping(a, resting) for a in (*(a for a, left in zip(some, moved, strict=True) if left), alone)]
        tried = twin.try_many(ensemble, twin.schedules(held, twin.horizon), False, every_tick=True)
        judged = self._cost.judge(*tried, ensemble.weights, held)
        rows[moved] = self._cost.where_held(rows[moved], judged[:-1], judged[-1])
        return rows
