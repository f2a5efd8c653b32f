"""Reprompting for a search: from a verdict to typed advice, by margins."""

from collections.abc import Mapping

from homeostat.agents.roles import Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.limits import Owner
from homeostat.domain.verdict import REPEATED, Approve

CURABLE = 0.5
"""A violation of up to this many scales is worth another try on the same path."""
STEP = 0.15
"""Least additional margin that is asked for, in scales [1]: asking for less gives the same proposal again."""
TRIES = 5
"""Attempts on one path before another one is asked for."""


class MarginReprompting:
    """Implements :class:`homeostat.agents.roles.Reprompting` by margins: small violations keep the path."""

    def __init__(self, scales: Mapping[str, float]) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self._scales = scales

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """Ask for more margin where the path can be cured, for another path where it cannot."""
        if isinstance(attempt.verdict, Approve):
            return Advice()
        violated = attempt.verdict.violated
        if any(f.criterion == REPEATED for f in violated):
            violated = before.findings  # what it violated the first time, asked for more strongly
        tries = before.tries + 1
        hopeless = any(f.owner is Owner.PLANNING or f.relative(self._scales) < -CURABLE for f in violated)
        if attempt.path is None or hopeless or tries >= TRIES:
            refused = () if attempt.path is None else (attempt.path.commanded,)
            return Advice(findings=violated, refused_paths=(*before.refused_paths, *refused))
        wanted = dict(before.required)
        for f in violated:
            step = max(-1.3 * f.margin, STEP * self._scales.get(f.unit, 1.0))
            wanted[f.criterion] = wanted.get(f.criterion, 0.0) + step
        return Advice(violated, Owner.ACTION, attempt.path, tries, before.refused_paths, tuple(sorted(wanted.items())))
