"""Looking back: how far a replay goes that is to say where the plant stands now."""

from collections.abc import Sequence

from homeostat.domain.diagnosis import Hypothesis
from homeostat.twin.carried import Carrier
from homeostat.twin.settings import TwinSettings

LEAST = 5
"""Readings that say where a plant stands, at least."""


def looked_back_s(
    hypotheses: Sequence[Hypothesis],
    carrier: Carrier,
    settings: TwinSettings,
    now_s: float,
    over_s: float,
    tick_s: float,
) -> float:
    """How long a replay goes back that ends at ``now_s`` [s].

    What a stuck instrument showed nobody has seen since, and what moved meanwhile is what the model says: it goes back
    to before the first of them was. Otherwise it does not go back to before ``over_s``, when something ended that
    nobody assumes any more: a valve that was stuck until then has moved the plant as no healthy one would have [s].
    """
    stuck_s = [f.onset_s for h in hypotheses for f in h.faults if carrier.is_stuck(f)]
    if stuck_s:
        return max(settings.synchronise_s, now_s - min(stuck_s) + (settings.settle_rows + 1) * tick_s)
    return min(settings.synchronise_s, max(now_s - over_s, LEAST * tick_s))
