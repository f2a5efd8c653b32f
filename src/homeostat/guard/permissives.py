"""Permissives: what must hold at the moment of a command, judged on one snapshot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from homeostat.domain.limits import Limit, LimitKind, Limits, Owner
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.stl.formula import Formula


def permissive_findings(snapshot: Snapshot, commands: Sequence[Command], limits: Limits) -> tuple[Finding, ...]:
    """The permissives on a snapshot as it would be right after the release of ``commands``.

    One that cannot be decided without a reading that is not usable is violated.
    """
    commanded = {c.tag for c in commands}
    values = {tag: value for tag, value in usable(snapshot).items() if tag not in commanded}
    values.update({c.tag: c.value for c in commands if c.value is not None})
    found = []
    for p in limits.of_kind(LimitKind.PERMISSIVE):
        try:
            margin = p.formula.margin_at(values)
        except Exception as error:  # a rule that is broken does not hold
            found.append(refusal(p.name, f"{p.formula.text!r} cannot be judged: {error} ({p.name})"))
            continue
        if math.isnan(margin):
            found.append(refusal(p.name, unjudged(p, values) or f"{p.formula.text!r} cannot be judged ({p.name})"))
        else:
            found.append(finding(p.name, Owner.ACTION, p.formula, p.description, margin, 0.0, 0))
    return tuple(found)


def usable(snapshot: Snapshot) -> dict[str, float]:
    """Tag -> value of the readings that are finite and not marked bad."""
    return {tag: value for tag, value in snapshot.values.items() if math.isfinite(value) and tag not in snapshot.bad}


def unjudged(limit: Limit, values: Mapping[str, float]) -> str | None:
    """Why ``limit`` cannot be judged from ``values``; None where it can. What is not known does not hold."""
    missing = ", ".join(repr(tag) for tag in sorted(limit.formula.tags - values.keys()))
    if not missing:
        return None
    return f"{limit.formula.text!r} cannot be judged without a usable value of {missing} ({limit.name})"


def finding(
    name: str, owner: Owner, formula: Formula, description: str, margin: float, at_s: float, member: int
) -> Finding:
    """What a formula's margin says, with a sentence for a person."""
    state = "holds" if margin >= 0 else "is violated"
    message = f"{description}: {formula.text!r} {state} by {abs(margin):.4g} {formula.unit} at {at_s:.0f} s ({name})"
    return Finding(name, owner, margin, formula.unit, at_s, member, message)


def refusal(name: str, message: str) -> Finding:
    """What no margin can cure: the check ``name`` refuses."""
    return Finding(name, Owner.ACTION, -float("inf"), "1", 0.0, 0, message)
