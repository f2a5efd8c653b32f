"""Reprompting: from a verdict to typed advice."""

from __future__ import annotations

from collections.abc import Mapping

from homeostat.domain.limits import Owner
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Advice, Approve, Finding, Verdict

CURABLE = 0.5
"""A violation of up to this many scales is worth another try on the same path."""
STEP = 0.15
"""Least additional margin that is asked for, in scales [1]: asking for less gives the same proposal again."""
TRIES = 5
"""Attempts on one path before another one is asked for."""


class MarginReprompting:
    """Implements :class:`homeostat.agents.crew.Reprompting` by margins: small violations keep the path."""

    def __init__(self, scales: Mapping[str, float]) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self._scales = scales

    def advise(self, path: RecoveryPath, verdict: Verdict, before: Advice) -> Advice:
        """Ask for more margin where the path can be cured, for another path where it cannot."""
        if isinstance(verdict, Approve):
            return Advice()
        violated = verdict.violated
        tries = before.tries + 1
        hopeless = any(f.owner is Owner.PLANNING or self.relative(f) < -CURABLE for f in violated)
        if hopeless or tries >= TRIES:
            return Advice(findings=violated, refused_paths=(*before.refused_paths, path.states))
        wanted = dict(before.required)
        for f in violated:
            step = max(-1.3 * f.margin, STEP * self._scales.get(f.unit, 1.0))
            wanted[f.criterion] = wanted.get(f.criterion, 0.0) + step
        return Advice(violated, path, tries, before.refused_paths, tuple(sorted(wanted.items())))

    def relative(self, finding: Finding) -> float:
        """The finding's margin in scales of its unit [1]."""
        return finding.margin / self._scales.get(finding.unit, 1.0)
