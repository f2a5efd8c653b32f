"""Checks: pure functions from (actions, rollout, limits) to findings with signed margins."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.behaviour import State
from homeostat.domain.formula import Formula
from homeostat.domain.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.tag import Tag
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, RolloutResult, Verdict


def judge(actions: ActionSet, rollout: Rollout, limits: Limits, target: State, tags: Mapping[str, Tag]) -> Verdict:
    """Approve ``actions`` only if every check holds in every member of ``rollout``; default is to refuse."""
    if rollout.digest != actions.digest:
        return Revise((_refusal("CHK-DIGEST", "the rollout belongs to another action set; roll this one out first"),))
    if rollout.result is not RolloutResult.COMPLETED:
        return Revise((_refusal("CHK-ROLLOUT", f"{rollout.result.value} {rollout.note}"),))
    findings = (
        *command_findings(actions, target, tags),
        *rollout_findings(rollout, limits.criteria, limits.limits),
        target_finding(rollout, target),
    )
    if all(f.satisfied for f in findings):
        return Approve(actions.digest, findings)
    return Revise(findings)


def judge_safety(actions: ActionSet, rollout: Rollout, limits: Limits) -> Verdict:
    """Judge a fallback: only what protects the plant counts."""
    if rollout.digest != actions.digest or rollout.result is not RolloutResult.COMPLETED:
        return Revise((_refusal("CHK-ROLLOUT", f"{rollout.result.value} {rollout.note}"),))
    findings = rollout_findings(rollout, [c for c in limits.criteria if c.hard], limits.hard)
    return Approve(actions.digest, findings) if all(f.satisfied for f in findings) else Revise(findings)


def rollout_findings(
    rollout: Rollout, criteria: Iterable[Criterion], limits: Iterable[Limit]
) -> tuple[Finding, ...]:
    """One finding per criterion and limit: the worst member's margin and its time.

    Interlocks and envelopes must hold throughout, permissives at the moment of release.
    """
    signals, dt_s = rollout.trajectory.signals, rollout.trajectory.dt_s
    found = [worst(c.name, c.owner, c.formula, c.description, signals, dt_s) for c in criteria]
    for limit in limits:
        margins = limit.formula.margins(signals, dt_s)
        if limit.kind is LimitKind.PERMISSIVE:
            margins = margins[:, :1]
        member, row = np.unravel_index(int(np.argmin(margins)), margins.shape)
        found.append(
            _finding(limit.name, Owner.ACTION, limit.formula, limit.description, float(margins[member, row]),
                     float(row) * dt_s, int(member))
        )  # fmt: skip
    return tuple(found)


def worst(
    name: str, owner: Owner, formula: Formula, description: str, signals: Mapping[str, NDArray[np.float64]], dt_s: float
) -> Finding:
    """The finding of one formula on a rollout: its least margin over the members."""
    margin = formula.evaluate(signals, dt_s)
    member = int(np.argmin(margin.value))
    return _finding(
        name, owner, formula, description, float(margin.value[member]), float(margin.worst_at_s[member]), member
    )


def target_finding(rollout: Rollout, target: State) -> Finding:
    """Whether every member has reached the target state at the end of the rollout."""
    last = {tag: values[:, -1:] for tag, values in rollout.trajectory.signals.items()}
    margins = np.broadcast_to(target.settled_when.margins(last, rollout.trajectory.dt_s), (max(1, len(rollout.weights)), 1))
    member = int(np.argmin(margins[:, 0]))
    end_s = (rollout.trajectory.length - 1) * rollout.trajectory.dt_s
    return _finding(
        f"TARGET-{target.name}", Owner.PLANNING, target.settled_when, f"State {target.name!r} is reached",
        float(margins[member, 0]), end_s, member,
    )  # fmt: skip


def command_findings(actions: ActionSet, target: State, tags: Mapping[str, Tag]) -> tuple[Finding, ...]:
    """What is wrong with the commands: not admissible in the target state, outside its range, or too fast."""
    found = []
    for c in actions.commands:
        admitted = target.setpoint(c.tag)
        if admitted is None or c.tag not in tags:
            found.append(_refusal("CHK-ADMISSIBLE", f"{c.tag!r} may not be commanded in state {target.name!r}"))
            continue
        if c.value is None:
            continue
        tag, rate = tags[c.tag], float("inf") if c.rate is None else c.rate
        slack = 1e-9 * max(abs(admitted.low), abs(admitted.high), 1.0)
        excess = max(admitted.low - c.value, c.value - admitted.high)
        if excess > slack:
            text = f"{c.tag!r} = {c.value:.6g} {tag.unit} in state {target.name!r}; admitted are"
            text = f"{text} {admitted.low:.6g} to {admitted.high:.6g} {tag.unit}"
            found.append(Finding("CHK-RANGE", Owner.ACTION, -excess, tag.unit, 0.0, 0, text))
        if tag.rate_limit is not None and rate > tag.rate_limit:
            text = f"{c.tag!r} ramps at {rate:.6g} {tag.unit}/s; limit {tag.rate_limit:.6g} {tag.unit}/s"
            found.append(Finding("CHK-RATE", Owner.ACTION, tag.rate_limit - rate, f"{tag.unit}/s", 0.0, 0, text))
    return tuple(found)


def permissive_findings(snapshot: Snapshot, actions: ActionSet, limits: Limits) -> tuple[Finding, ...]:
    """The permissives on a snapshot as it would be right after the release of ``actions``."""
    values = dict(snapshot.values)
    values.update({c.tag: c.value for c in actions.commands if c.value is not None})
    return tuple(
        _finding(p.name, Owner.ACTION, p.formula, p.description, p.formula.margin_at(values), 0.0, 0)
        for p in limits.of_kind(LimitKind.PERMISSIVE)
    )


def _finding(
    name: str, owner: Owner, formula: Formula, description: str, margin: float, at_s: float, member: int
) -> Finding:
    state = "holds" if margin >= 0 else "is violated"
    message = f"{description}: {formula.text!r} {state} by {abs(margin):.4g} {formula.unit} at {at_s:.0f} s ({name})"
    return Finding(name, owner, margin, formula.unit, at_s, member, message)


def _refusal(name: str, message: str) -> Finding:
    return Finding(name, Owner.ACTION, -float("inf"), "1", 0.0, 0, message)
