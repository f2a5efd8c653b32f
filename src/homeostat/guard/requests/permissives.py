"""Permissives: what must hold at the moment of a command, judged on one snapshot."""

import math
from collections.abc import Mapping, Sequence

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding, Violating
from homeostat.stl.deciding import Deciding, decided


def permissive_findings(snapshot: Snapshot, commands: Sequence[Command], limits: Limits) -> tuple[Finding, ...]:
    """The permissives on a snapshot as it would be right after ``commands``; one that is undecided is violated.

    By hand, the command of an actuator is what its manual output is commanded to.
    """
    commanded = {c.tag for c in commands}
    kept = {tag: value for tag, value in usable(snapshot).items() if tag not in commanded}
    given = {c.tag: c.value for c in commands if c.value is not None}
    found = []
    for p in limits.of_kind(LimitKind.PERMISSIVE):
        values = kept | p.following(given)
        blind = unjudged(p, values)
        if blind is None:
            margin = p.formula.margin_at(values)
            found.append(finding(p, margin, by=decided(p.formula, values, margin)))
        else:
            found.append(refusal(p.name, blind))
    return tuple(found)


def usable(snapshot: Snapshot) -> dict[str, float]:
    """Tag -> value of the readings that are finite and not marked bad."""
    return {tag: value for tag, value in snapshot.values.items() if math.isfinite(value) and tag not in snapshot.bad}


def unjudged(limit: Limit, values: Mapping[str, float]) -> str | None:
    """Why ``values`` leave ``limit`` undecided; None where they decide it. What is not known does not hold."""
    if not math.isnan(limit.formula.margin_at(values)):
        return None
    missing = ", ".join(repr(tag) for tag in sorted(limit.formula.tags - values.keys()))
    reason = f"cannot be judged without a usable value of {missing}" if missing else "has no value at these readings"
    return f"{limit.formula.text!r} {reason} ({limit.name})"


def finding(
    rule: Limit | Criterion,
    margin: float,
    at_s: float = 0.0,
    member: int = 0,
    by: Deciding | None = None,
    violating: Violating | None = None,
) -> Finding:
    """What the margin of a limit or criterion says, with a sentence for a person.

    ``margin`` [its unit] is the worst one, of ``member``, ``at_s`` [s] after the snapshot; NaN where it is undecided,
    which is violated without limit; ``by`` is the comparison that decides it, where it has no unit of its own, and
    ``violating`` how many members violate it. Whoever proposes commands can cure a limit.
    """
    owner = rule.owner if isinstance(rule, Criterion) else Owner.ACTION
    said, unit = f"{rule.description}: {rule.formula.text!r}", rule.formula.unit
    if math.isnan(margin):
        message = f"{said} cannot be judged, a value that it needs is not known ({rule.name})"
        return Finding(rule.name, owner, -math.inf, unit, 0.0, member, message, None, violating)
    state = "holds" if margin >= 0 else "is violated"
    size, of_size = (by.margin, by.unit) if by is not None and by.unit else (margin, unit)
    whose = "" if violating is None else f" in {violating}"
    message = f"{said} {state} by {abs(size):.4g} {of_size} at {at_s:.0f} s{whose} ({rule.name})"
    return Finding(rule.name, owner, margin, unit, at_s, member, message, by, violating)


def refusal(name: str, message: str, owner: Owner = Owner.ACTION) -> Finding:
    """What no margin can cure: the check ``name`` refuses; ``owner`` can propose something else."""
    return Finding(name, owner, -math.inf, "1", 0.0, 0, message)
