"""Reliance: what a proposal comes to where actuators that nobody has seen move stay where they are.

No probability is claimed. A relief that has never opened may be stuck, and nothing on record would show it: what is
released must not count on it more than leaving the plant alone, or falling back, does.

    for all actuators that leave their rest in the rollout of the proposal, together, and for each alone
        the same commands in the same members, with the actuators held by hand where they are
        refused if that violates a hard limit that the proposal keeps, unless one of what it is compared with, held as
        well, fares no better (:mod:`homeostat.agents.no_worse`)

Hand check: a pressure that is raised to 240 bar overshoots to 244 bar with its relief, to 254 bar without, and the
limit is 250 bar. Left alone it stays at 200 bar either way: refused. A drain that is opened by hand, does not move and
leaves the plant as it was: not refused. What is commanded by design in the state is ordinary operation, and no
protection: the next valve of a batch has not moved yet, either.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.checks import rollout_findings
from homeostat.agents.no_worse import SLACK, worse
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.verdict import Finding, Rollout, RolloutResult
from homeostat.guard.requests.permissives import refusal
from homeostat.process.types import Flags
from homeostat.twin.forecast import Ensemble
from homeostat.twin.resting import Resting
from homeostat.twin.twin import Interruption, Twin

UNSEEN: Final = "CHK-UNSEEN"
"""Name of the refusal of what counts on an actuator that nobody has seen move."""
RollOut: TypeAlias = Callable[[ActionSet, Interruption | None], Rollout]
"""Rolls out over the members that are judged; until it is ended, if it is."""


@dataclass(frozen=True, slots=True)
class Relying:
    """What is asked about."""

    actions: ActionSet
    """What is to be released."""
    states: Sequence[State]
    """The states that it leads through; what they command by design is ordinary operation."""
    beside: tuple[ActionSet, ...]
    """Leaving the plant alone, and falling back: what fares no better with the same actuators held is no reason."""
    ended: Interruption | None = None
    """What ends it; None where it is to last."""


@dataclass(frozen=True, slots=True)
class Bench:
    """On what it is tried, and by what it is judged."""

    roll_out: RollOut
    """Rolls out over the members that are judged."""
    resting: tuple[Resting, ...]
    """Actuators at rest that nobody has seen move."""
    limits: Limits
    """The hard ones, and hard criteria."""
    scales: Mapping[str, float]
    """Unit -> what counts as one unit of margin in it."""
    tick_s: float
    """Period of the plant's clock [s]."""

    @classmethod
    def of(
        cls, twin: Twin, hypotheses: Sequence[Hypothesis], limits: Limits, scales: Mapping[str, float],
        members: Ensemble | None = None,
    ) -> "Bench":  # fmt: skip
        """A ``twin`` that stays as it is, over ``members``, or those that it judges these ``hypotheses`` by."""

        def roll_out(actions: ActionSet, ended: Interruption | None) -> Rollout:
            return twin.roll_out(actions, hypotheses, ended, members)

        return cls(roll_out, twin.resting, limits, scales, twin.timing.tick_s)


@dataclass(frozen=True, slots=True)
class Relied:
    """What counts on actuators that nobody has seen move."""

    members: Flags
    """In which members, shape (members,)."""
    findings: tuple[Finding, ...]
    """Why: the refusal, and the hard limits that are violated where the actuators stay; empty where nothing does."""


def relied_on(asked: Relying, rollout: Rollout, by: Bench) -> Relied:
    """Whether ``asked``, of which ``rollout`` is known, counts on what nobody has seen move, in any member."""
    moved = [x for x in unseen(by.resting, asked.states) if leaves(x, rollout.trajectory.signals, 1).any()]
    together = [tuple(moved), *((x,) for x in moved if len(moved) > 1)]
    members, findings = np.zeros(len(rollout.weights), dtype=np.bool_), dict[str, Finding]()
    for held in together if moved else ():
        mine = by.roll_out(keeping(asked.actions, held), asked.ended and _ended(asked.ended, held))
        counts = _worse(mine, rollout, by, 0.0)
        for other in asked.beside if counts.any() else ():
            counts &= _worse(mine, by.roll_out(keeping(other, held), None), by, SLACK)
        if counts.any():
            members = members | counts
            for f in _findings(mine, held, asked.actions, by.limits):
                findings[f.criterion] = min(f, findings.get(f.criterion, f), key=lambda each: each.margin)
    return Relied(members, tuple(findings.values()))


def _worse(mine: Rollout, other: Rollout, by: Bench, slack: float) -> Flags | np.bool_:
    """In which members ``mine`` fares worse; where the twin leaves the physical world, in all or in none."""
    broke = RolloutResult.BROKE_DOWN
    if broke in (mine.result, other.result):
        return np.bool_(other.result is not broke)
    return worse(mine, other, by.limits, by.scales, by.tick_s, slack)


def unseen(resting: Iterable[Resting], states: Iterable[State]) -> tuple[Resting, ...]:
    """Those of ``resting`` that no one of ``states`` commands by design."""
    by_design = {r.tag for state in states for r in state.setpoints if r.design is not None}
    return tuple(x for x in resting if x.manual not in by_design)


def leaves(element: Resting, signals: Mapping[str, NDArray[np.float64]], count: int) -> Flags:
    """In which of ``count`` candidates that follow each other in ``signals`` it leaves its rest, shape (count,)."""
    command = signals.get(element.command)
    if command is None:
        return np.zeros(count, dtype=np.bool_)
    off = (np.abs(command - element.rest) > element.leaves).any(axis=1)
    return np.asarray(off.reshape(count, -1).any(axis=1))


def keeping(actions: ActionSet, held: Iterable[Resting]) -> ActionSet:
    """``actions`` with each of ``held`` by hand where it is, whatever they command of it."""
    hands = {x.manual: Command(x.manual, x.rest, None) for x in held}
    first = tuple(c for c in actions.commands if c.tag not in hands)
    then = (replace(s, commands=tuple(c for c in s.commands if c.tag not in hands)) for s in actions.then)
    return replace(actions, commands=(*first, *hands.values()), then=tuple(then))


def _ended(ended: Interruption, held: tuple[Resting, ...]) -> Interruption:
    return replace(ended, actions=keeping(ended.actions, held))


def _findings(mine: Rollout, held: tuple[Resting, ...], actions: ActionSet, limits: Limits) -> tuple[Finding, ...]:
    """The refusal, and the hard limits that are violated where ``held`` stay, which say what is missing."""
    names = " and ".join(x.actuator for x in held)
    counts = f"counts on {names} moving, which nobody has seen"
    hard = [c for c in limits.criteria if c.hard]
    found = () if not mine.weights else rollout_findings(mine, hard, limits.hard, actions)
    violated = tuple(sorted((f for f in found if not f.satisfied), key=lambda f: f.margin))
    if not violated:
        return (refusal(UNSEEN, f"{counts}; else the twin leaves the physical world"),)
    worst = violated[0]
    return (replace(worst, criterion=UNSEEN, message=f"{counts}: else {worst.message}"), *violated)
