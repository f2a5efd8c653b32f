"""Reprompting for a search: from a verdict to typed advice, by margins, and by how many members they are violated in.

A small violation is worth another try on the same path, which asks for what was missing and a little more beyond what
the search's own members had: the worst of many members is worse than that of few. A large one is not, but where few
members fall off a cliff while all of the search's own stay on it: a step more margin may keep them there. How far they
fall says nothing about how much is missing. So a step more is asked for than the search's own members had, and with
each try one of :data:`GROWTH` times its size; a path that cannot give it is closed. Where the fall became as much less
as the search's own margin became more, it is no cliff, and what is missing is asked for.

Hand check: four of 24 members overflow by 20 scales, and the search's own stay 3 scales below the brim. 3.15 scales
are asked for; where these have them and one member overflows still, 0.6 more than they have. Where twelve overflow, or
one of those that the search saw, the path is closed at once.
"""

import math
from collections.abc import Callable, Mapping, Sequence

from homeostat.agents.checks import target_name
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet, RecoveryPath, open_setpoints
from homeostat.domain.verdict import REPEATED, Approve, Finding, circumstantial

CURABLE = 0.5
"""A violation of up to this many scales is worth another try on the same path."""
FEW = 0.4
"""So is a larger one in up to this share of the members' weight, where the search's own members held [1]."""
STEP = 0.15
"""Least additional margin that is asked for, in scales [1]: asking for less gives the same proposal again."""
GROWTH = 2.0
"""Each try after a fall asks for a step of so many times the size of the one before [1]."""
IN_STEP = 0.5
"""What is violated follows the search's own margin where it changes by this share of it at least [1]."""
TRIES = 5
"""Attempts on one path before another one is asked for."""


def _unknown(actions: ActionSet) -> Mapping[str, float]:
    return {}


class MarginReprompting:
    """Implements :class:`homeostat.agents.roles.Reprompting` by margins: small violations keep the path."""

    def __init__(
        self, scales: Mapping[str, float], seen: Callable[[ActionSet], Mapping[str, float]] = _unknown
    ) -> None:
        """``scales``: unit -> what counts as one unit of margin in it.

        ``seen``: name of everything that forbids -> its margin, in its unit, in the worst of the members on which the
        search itself tried commands; empty where that is not known.
        """
        self._scales, self._seen = scales, seen

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """Ask for more margin where the path can be cured, for another path where it cannot.

        NoAdmissiblePlan where what refused it would have refused anything else: the path is as good as it was.
        """
        if isinstance(attempt.verdict, Approve):
            return Advice()
        violated = attempt.verdict.violated
        if circumstantial(violated):  # another path would meet them as well, and only cost more
            raise NoAdmissiblePlan(f"nothing is said of what was proposed: {violated[0].message}")
        again = any(f.criterion == REPEATED for f in violated)
        if again:
            violated = before.findings  # what it violated the first time, asked for more strongly
        seen = self._seen(attempt.actions) if attempt.actions is not None else {}
        tries = before.tries + 1
        if attempt.path is None or tries >= TRIES or self._hopeless(attempt.path, violated, seen, again):
            refused = () if attempt.path is None else (attempt.path.commanded,)
            return Advice(findings=violated, refused_paths=(*before.refused_paths, *refused))
        wanted = dict(before.required)
        for f in violated:
            wanted[f.criterion] = self._wanted(f, before, seen)
        return Advice(violated, Owner.ACTION, attempt.path, tries, before.refused_paths, tuple(sorted(wanted.items())))

    def _hopeless(
        self, path: RecoveryPath, violated: Sequence[Finding], seen: Mapping[str, float], again: bool
    ) -> bool:
        """Whether more margin cures nothing: much is violated, or what another path cures, and not in few members.

        ``again``: the search had nothing else to say when it was asked for more.
        """
        much = [f for f in violated if f.owner is Owner.PLANNING or self._is_large(f)]
        if not much:
            return False
        if not all(math.isfinite(f.margin) and f.violating is not None and f.violating.share <= FEW for f in much):
            return True
        if again or not open_setpoints(path.commanded_states) or not all(m >= 0.0 for m in seen.values()):
            return True
        # A search is asked for margin of what forbids, and of no state that is to be reached.
        reached = target_name(path.machine.state(path.target))
        return all(f.criterion == reached for f in violated)

    def _wanted(self, finding: Finding, before: Advice, seen: Mapping[str, float]) -> float:
        """Margin that is asked for, in the finding's unit, after the tries ``before``."""
        step, had = STEP * self._scales.get(finding.unit, 1.0), seen.get(finding.criterion, 0.0)
        asked, had = dict(before.required).get(finding.criterion, 0.0), had if math.isfinite(had) else 0.0
        missing = max(-1.3 * finding.margin, step)
        if not self._is_large(finding):
            return max(asked, had) + missing
        last = next((f for f in before.findings if f.criterion == finding.criterion), None)
        own = had - (asked - step * GROWTH ** (before.tries - 1))  # that was asked for beyond what they had then
        if last is not None and own > 0.0 and finding.margin - last.margin >= IN_STEP * own:
            return max(asked, had) + missing
        return max(asked, had) + step * GROWTH**before.tries

    def _is_large(self, finding: Finding) -> bool:
        return finding.relative(self._scales) < -CURABLE
