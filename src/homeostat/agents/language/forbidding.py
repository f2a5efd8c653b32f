"""What forbids, in words: formulas of limits, and permissives with their meaning, for whoever chooses a path."""

from collections.abc import Mapping, Sequence
from typing import Final

from homeostat.agents.language.situation import worst_first
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.quotation import quote
from homeostat.domain.verdict import Finding
from homeostat.llm.tokens import estimate

MOST_TOLD: Final = 320
"""Tokens of all of it [1]; what does not fit is counted."""
TITLE: Final = "What must hold, whatever is done:"
"""Stands before it."""


def forbidding_text(plant: PlantDescription, idle: Sequence[Finding], most: int = MOST_TOLD) -> str:
    """What must hold, a line each: first what ``idle`` violates, worst first, then limits, permissives and criteria.

    ``most``: tokens that there are for it; :data:`MOST_TOLD` at most.
    """
    criteria, limits = plant.limits.watched.forbidding
    ordered: list[Criterion | Limit] = [*sorted(limits, key=_is_permissive), *criteria]
    rules: Mapping[str, Criterion | Limit] = {rule.name: rule for rule in ordered}
    violated = [f.criterion for f in worst_first(idle, plant.scales) if f.criterion in rules]
    lines, left = list[str](), list(dict.fromkeys((*violated, *rules)))
    if not left:
        return ""
    for name in tuple(left):
        text = "\n".join((TITLE, *lines, _told(rules[name]), *_more(len(left) - 1)))
        if estimate(text) > min(most, MOST_TOLD):
            break
        lines.append(_told(rules[name]))
        left.remove(name)
    return "\n".join((TITLE, *lines, *_more(len(left))))


def _more(count: int) -> tuple[str, ...]:
    return (f"and {count} more",) if count else ()


def _is_permissive(rule: Criterion | Limit) -> bool:
    return isinstance(rule, Limit) and rule.kind is LimitKind.PERMISSIVE


def _told(rule: Criterion | Limit) -> str:
    """``- PRM-COOL at a release: T1 >= 300 («Cooling only when warm»)``."""
    if _is_permissive(rule):
        return f"- {rule.name} at a release: {rule.formula.text} ({quote(rule.description, 80)})"
    return f"- {rule.name}: {rule.formula.text}"
