"""Checks: pure functions from (actions, rollout, limits) to findings with signed margins."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import (
    REPEATED,
    Approve,
    Finding,
    Revise,
    Rollout,
    RolloutResult,
    Verdict,
    Violating,
)
from homeostat.guard.requests.permissives import finding, refusal
from homeostat.stl.deciding import Deciding, deciding

Tags: TypeAlias = Mapping[str, Tag]
"""Name -> tag."""
ROUTE = "CHK-ROUTE"
"""Name of the refusal of steps that do not follow the path."""
CLOSED = "CHK-OPEN"
"""Name of the refusal of a path that closed while its commands were thought about."""


def judge(
    actions: ActionSet, rollout: Rollout, limits: Limits, target: State, tags: Tags, path: RecoveryPath | None = None
) -> Verdict:
    """Approve ``actions`` only if all that forbids holds in every member of ``rollout``; default is to refuse.

    ``target`` is the state in which they end; ``path`` leads there and must be given where there are later steps. What
    only costs is not judged: see :mod:`homeostat.agents.pricing`.
    """
    if actions.end != target.name:
        text = f"the action set leads to {actions.end!r}; judge it for that state, not for {target.name!r}"
        return Revise((refusal("CHK-TARGET", text),))
    criteria, needed = limits.watched.forbidding
    unfit = _unfit(actions, rollout, {*target.settled_when.tags, *_read(criteria), *_read(needed)})
    if unfit is None and actions.then:
        unfit = _astray(actions, path)
    if unfit is not None:
        return Revise((unfit,))
    findings = (
        *_commands_by_step(actions, target, tags, path),
        *rollout_findings(rollout, criteria, needed, actions),
        target_finding(rollout, target),
    )
    if all(f.satisfied for f in findings):
        return Approve(actions.digest, findings)
    return Revise(findings)


def judge_passing(
    actions: ActionSet, rollout: Rollout, limits: Limits, tags: Tags, path: RecoveryPath | None
) -> Verdict:
    """Judge what goes on for a while only: its commands, and what protects the plant, as long as ``rollout`` lasts.

    ``path`` is what it takes; None where nothing is commanded. How well the plant is recovered by it does not count.
    """
    criteria, needed = limits.watched.forbidding
    if path is None:
        needed = limits.watched.hard
    unfit = _unfit(actions, rollout, _read(criteria) | _read(needed))
    if unfit is None and actions.then and path is not None:
        unfit = _astray(actions, path)
    if unfit is not None:
        return Revise((unfit,))
    commanded = () if path is None else _commands_by_step(actions, path.machine.state(path.target), tags, path)
    findings = (*commanded, *rollout_findings(rollout, criteria, needed, actions))
    return Approve(actions.digest, findings) if all(f.satisfied for f in findings) else Revise(findings)


@dataclass(frozen=True, slots=True)
class Part:
    """One of two action sets that follow each other."""

    actions: ActionSet
    """What is commanded."""
    path: RecoveryPath | None = None
    """The path that it takes; None where the tables say what is commanded."""
    needs: bool = True
    """Whether permissives must hold when it is written: not where nothing is, and not for a fallback."""


def judge_parts(
    first: Part, then: Part, rollout: Rollout, after_s: float, limits: Limits, tags: Tags, target: State | None = None
) -> Verdict:
    """Judge all that forbids throughout a ``rollout`` of ``first`` for ``after_s`` [s] and of what comes ``then``.

    Permissives hold when each part is written, guards when the later path begins; ``target``: the state to be reached
    in the end, None where safety is all that counts. The approval is that of the first part.
    """
    criteria, needed = limits.watched.forbidding
    if target is None:  # a fallback follows, which begins where a limit trips and keeps the limit itself
        needed = limits.hard
    reached = set() if target is None else set(target.settled_when.tags)
    unfit = _unfit(first.actions, rollout, reached | _read(criteria) | _read(needed))
    if unfit is not None:
        return Revise((unfit,))
    row = math.ceil(after_s / rollout.trajectory.dt_s) - 1
    permissives = [x for x in needed if x.kind is LimitKind.PERMISSIVE]
    throughout = [x for x in needed if x.kind is not LimitKind.PERMISSIVE]
    found = [*rollout_findings(rollout, criteria, throughout, first.actions)]
    if target is None:
        sooner = [x for x in limits.watched.hard if x not in limits.hard]
        found += rollout_findings(_begun(rollout, row), (), sooner, first.actions) if sooner else ()
    for part, at in ((first, 0), (then, row)):
        if part.path is not None:
            end = part.path.machine.state(part.path.target)
            found += _commands_by_step(part.actions, end, tags, part.path)
            found += _guard_findings(part.path, rollout, at) if at else []  # now, readings say whether it is open
        if part.needs:
            found += [_needed(x, rollout, part.actions, at) for x in permissives]
    if target is not None:
        found.append(target_finding(rollout, target))
    return Approve(first.actions.digest, tuple(found)) if all(f.satisfied for f in found) else Revise(tuple(found))


def _begun(rollout: Rollout, row: int) -> Rollout:
    """The first part of ``rollout``, at least its first sample, up to ``row``."""
    signals = {tag: each[:, : max(row, 1)] for tag, each in rollout.trajectory.signals.items()}
    return replace(rollout, trajectory=replace(rollout.trajectory, signals=signals))


def _guard_findings(path: RecoveryPath, rollout: Rollout, row: int) -> list[Finding]:
    """Whether the guards of what is decided on ``path`` hold in every member when it begins."""
    values = {tag: each[:, row : row + 1] for tag, each in rollout.trajectory.signals.items()}
    found = []
    for t in path.decisions[:1]:
        margins = np.atleast_2d(t.guard.margins(values, 1.0))
        member = _worst(margins[:, 0])
        rule = Criterion(f"GUARD-{t.name}", Owner.PLANNING, t.guard, True, "", f"Guard of {t.name!r}")
        told = violating(margins, rollout.weights)
        found.append(finding(rule, float(margins[member, 0]), float(row), member, violating=told))
    return found


def _needed(limit: Limit, rollout: Rollout, actions: ActionSet, row: int) -> Finding:
    """A permissive when ``actions`` are written, in the worst member."""
    margins = _permissive_margins(limit, rollout.trajectory.signals, actions, row)
    member = _worst(margins[:, 0])
    told = violating(margins, rollout.weights)
    return finding(limit, float(margins[member, 0]), float(row) * rollout.trajectory.dt_s, member, violating=told)


def judge_safety(actions: ActionSet, rollout: Rollout, limits: Limits) -> Verdict:
    """Judge a fallback: only what protects the plant counts."""
    criteria, _ = limits.forbidding
    unfit = _unfit(actions, rollout, _read(criteria) | _read(limits.hard))
    if unfit is not None:
        return Revise((unfit,))
    findings = rollout_findings(rollout, criteria, limits.hard, actions)
    return Approve(actions.digest, findings) if all(f.satisfied for f in findings) else Revise(findings)


def rollout_findings(
    rollout: Rollout, criteria: Iterable[Criterion], limits: Iterable[Limit], actions: ActionSet
) -> tuple[Finding, ...]:
    """One finding per criterion and limit: the worst member's margin and its time; an undecided member is the worst.

    Trip limits and envelopes must hold throughout; permissives at the moment of release, with every commanded tag at
    the value that it is commanded to, then with what each later step commands.
    """
    signals, dt_s = rollout.trajectory.signals, rollout.trajectory.dt_s
    covered_s = rollout.trajectory.length * dt_s
    found = [_too_short(c, covered_s) or worst(c, signals, dt_s, rollout.weights) for c in criteria]
    for limit in limits:
        permissive = limit.kind is LimitKind.PERMISSIVE
        if permissive:
            margins = _permissive_margins(limit, signals, actions)
        else:
            margins = np.atleast_2d(limit.formula.margins(signals, dt_s))
        member, row = np.unravel_index(_worst(margins), margins.shape)
        margin, at = float(margins[member, row]), (int(member), int(row))
        by = None if permissive else _by(limit, signals, margin, *at)
        told = violating(margins, rollout.weights)
        found.append(finding(limit, margin, float(row) * dt_s, int(member), by, told))
    return tuple(found)


def violating(margins: NDArray[np.float64], weights: Sequence[float]) -> Violating | None:
    """Who violates something, by its ``margins``, shape (members,) or (members, times); None where nobody does.

    What is undecided is violated. ``weights``: of the members, shape (members,); None where they are not known.
    """
    held = np.atleast_1d(np.asarray(margins >= 0.0))
    each = ~held.reshape(held.shape[0], -1).all(axis=1)
    if not each.any() or each.size not in (1, len(weights)):
        return None
    each = np.broadcast_to(each, len(weights))  # what reads commands alone is the same in every member
    weight = np.asarray(weights, dtype=np.float64)
    return Violating(int(each.sum()), len(weights), float(weight[each].sum() / weight.sum()))


def _permissive_margins(
    limit: Limit, signals: Mapping[str, NDArray[np.float64]], actions: ActionSet, row: int = 0
) -> NDArray[np.float64]:
    """Least margin of a permissive over the steps of ``actions`` that are written at ``row``, shape (members, 1)."""
    commanded: dict[str, NDArray[np.float64]] = {}
    found = []
    for commands in (actions.commands, *(s.commands for s in actions.then)):
        commanded.update({c.tag: np.asarray(c.value) for c in commands if c.value is not None})
        given = limit.following(commanded)
        values = {tag: given.get(tag, each[:, row : row + 1]) for tag, each in signals.items()}
        found.append(np.atleast_2d(limit.formula.margins(values, 1.0)))
    return np.asarray(np.minimum.reduce(np.broadcast_arrays(*found)))


def worst(
    criterion: Criterion, signals: Mapping[str, NDArray[np.float64]], dt_s: float, weights: Sequence[float] = ()
) -> Finding:
    """The finding of one criterion on a rollout: its least margin over the members; ``weights``: theirs, if known."""
    margin = criterion.formula.evaluate(signals, dt_s)
    member = _worst(margin.value)
    least, at_s = float(margin.value[member]), float(margin.worst_at_s[member])
    by = None if math.isnan(at_s) else _by(criterion, signals, least, member, round(at_s / dt_s))
    return finding(criterion, least, at_s, member, by, violating(margin.value, weights))


def _by(
    rule: Criterion | Limit, signals: Mapping[str, NDArray[np.float64]], margin: float, member: int, row: int
) -> Deciding | None:
    """The comparison that gives ``rule`` its ``margin`` at ``row`` of ``member``, where that is not all of ``rule``."""
    if rule.formula.unit != "1" and rule.formula.is_one_comparison:  # nothing is read for nothing
        return None
    each = {tag: np.atleast_2d(signals[tag]) for tag in rule.formula.tags}
    values = {tag: float(found[min(member, len(found) - 1), row]) for tag, found in each.items()}
    return deciding(rule.formula, values, margin)


def _worst(margins: NDArray[np.float64]) -> int:
    """Flat index of the first undecided margin, otherwise of the least one."""
    return int(np.argmin(np.where(np.isnan(margins), -np.inf, margins)))


def target_name(target: State) -> str:
    """Name of the finding on whether ``target`` is reached."""
    return f"TARGET-{target.name}"


def target_finding(rollout: Rollout, target: State) -> Finding:
    """Whether every member has taken every step and reached the target state at the end of the rollout."""
    left = max(rollout.steps_left, default=0)
    if left > 0:
        slow = rollout.steps_left.index(left)
        text = f"State {target.name!r} is not entered: {left} of the steps are still waited for at the end"
        told = violating(-np.asarray(rollout.steps_left, dtype=np.float64), rollout.weights)
        return Finding(target_name(target), Owner.PLANNING, -float(left), "steps", 0.0, slow, text, None, told)
    last = {tag: values[:, -1:] for tag, values in rollout.trajectory.signals.items()}
    margins = target.settled_when.margins(last, rollout.trajectory.dt_s)
    member = _worst(margins[:, 0])
    end_s = (rollout.trajectory.length - 1) * rollout.trajectory.dt_s
    reached = f"State {target.name!r} is reached"
    criterion = Criterion(target_name(target), Owner.PLANNING, target.settled_when, False, "", reached)
    told = violating(margins, rollout.weights)
    return finding(criterion, float(margins[member, 0]), end_s, member, violating=told)


def command_findings(actions: ActionSet, target: State, tags: Tags) -> tuple[Finding, ...]:
    """What is wrong with the commands: not admissible in the target state, outside its range, or too fast."""
    found = []
    for c in actions.commands:
        admitted = target.setpoint(c.tag)
        if admitted is None or c.tag not in tags:
            found.append(refusal("CHK-ADMISSIBLE", f"{c.tag!r} may not be commanded in state {target.name!r}"))
            continue
        if c.value is None:
            if admitted.design is not None:
                found.append(refusal("CHK-AUTOMATIC", f"{c.tag!r} has no automatic mode in state {target.name!r}"))
            continue
        tag, rate = tags[c.tag], float("inf") if c.rate is None else c.rate
        slack = 1e-9 * max(abs(admitted.low), abs(admitted.high), 1.0)
        excess = max(admitted.low - c.value, c.value - admitted.high)
        if excess > slack:
            text = f"{c.tag!r} = {c.value:.6g} {tag.unit} in state {target.name!r}; admitted are"
            text = f"{text} {admitted.low:.6g} to {admitted.high:.6g} {tag.unit}"
            found.append(Finding("CHK-RANGE", Owner.ACTION, -excess, tag.unit, 0.0, 0, text))
        if (off := abs(c.value - tag.nearest(c.value))) > slack:
            ends = f"{tag.range.low:g} and {tag.range.high:g}"
            text = f"{c.tag!r} = {c.value:.6g} {tag.unit}; it has two positions, {ends}"
            found.append(Finding("CHK-RANGE", Owner.ACTION, -off, tag.unit, 0.0, 0, text))
        if tag.rate_limit is not None and rate > tag.rate_limit:
            text = f"{c.tag!r} ramps at {rate:.6g} {tag.unit}/s; limit {tag.rate_limit:.6g} {tag.unit}/s"
            found.append(Finding("CHK-RATE", Owner.ACTION, tag.rate_limit - rate, f"{tag.unit}/s", 0.0, 0, text))
    return tuple(found)


def _commands_by_step(actions: ActionSet, target: State, tags: Tags, path: RecoveryPath | None) -> tuple[Finding, ...]:
    """Findings on the commands of every step, each in its own state."""
    if path is None or not actions.then:
        return command_findings(actions, target, tags)
    found: list[Finding] = []
    for commands, name in zip((actions.commands, *(s.commands for s in actions.then)), actions.states, strict=True):
        found += command_findings(ActionSet(commands, name), path.machine.state(name), tags)
    return tuple(found)


def _astray(actions: ActionSet, path: RecoveryPath | None) -> Finding | None:
    """A refusal where the steps are not those that the machine has on ``path``: its states, each behind its guard."""
    if path is None:
        return refusal(ROUTE, "the action set has later steps, but no path through the state machine")
    awaited = path.awaited
    if actions.target != path.now or tuple(s.transition for s in actions.then) != awaited:
        there = " > ".join((path.now, *(t.target for t in awaited)))
        text = f"the steps lead {' > '.join(actions.states)}; the path leads {there}, each behind its guard"
        return refusal(ROUTE, text)
    return None


def repetition_finding(number: int) -> Finding:
    """The refusal of an action set that was attempt ``number`` already: the same proposal gets the same verdict."""
    return refusal(REPEATED, f"this is attempt {number} again; propose something else")


def closed_finding(states: Sequence[str]) -> Finding:
    """The refusal of an action set whose path the machine no longer opens."""
    text = f"{' > '.join(states)} is not open any more: a guard on it closed; name another path"
    return Finding(CLOSED, Owner.PLANNING, -float("inf"), "1", 0.0, 0, text)


def _read(rules: Iterable[Criterion | Limit]) -> set[str]:
    """Tags that ``rules`` read."""
    return {tag for rule in rules for tag in rule.formula.tags}


def _unfit(actions: ActionSet, rollout: Rollout, read: set[str]) -> Finding | None:
    """Why ``rollout`` says nothing about ``actions``; None where it does. ``read``: the tags that are judged."""
    if rollout.digest != actions.digest:
        return refusal("CHK-DIGEST", "the rollout belongs to another action set; roll this one out first")
    if rollout.result is not RolloutResult.COMPLETED:
        return refusal("CHK-ROLLOUT", f"{rollout.result.value} {rollout.note}")
    signals = rollout.trajectory.signals
    for tag in sorted(read & signals.keys()):
        if not np.isfinite(signals[tag]).all():
            return refusal("CHK-FINITE", f"{tag!r} is not finite in the rollout; the twin left the physical world")
    return None


def _too_short(criterion: Criterion, covered_s: float) -> Finding | None:
    """A refusal where ``criterion`` looks beyond the rollout: whatever is asked of an empty window holds."""
    ahead_s = criterion.formula.horizon_s
    if ahead_s <= covered_s or math.isinf(ahead_s):
        return None
    text = f"{criterion.formula.text!r} looks {ahead_s:.0f} s ahead; the rollout covers {covered_s:.0f} s"
    return refusal(criterion.name, text)
