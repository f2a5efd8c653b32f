"""A trial: the question of a person, rolled out on a twin of its own and judged as a proposal would be."""

from __future__ import annotations

import math

from homeostat.agents.checks import judge
from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.console.card.card import Move
from homeostat.console.card.episode import worded
from homeostat.console.card.foresight import Foresight, first_limit
from homeostat.console.card.margins import predicted_margins
from homeostat.console.card.proposal import state_label
from homeostat.console.trial.question import Question, Tried
from homeostat.domain.diagnosis import by_fault_set
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Rollout
from homeostat.guard.sequence.sequencer import nominal_commands, what_follows
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.guarding import rules_of
from homeostat.record.story.plain import plainly
from homeostat.recovery.look.foresight import foreseen
from homeostat.twin.twin import Twin

_SEED = 1
_MOST_S = 3600.0
"""Readings that a twin looks back on [s]."""


def tried(question: Question) -> Tried:
    """What the twin of the question's plant says; PlantError where the plant is not to be had."""
    plant = load_plant(question.folder)
    twin = Twin(plant.model, plant.description, plant.twin, _SEED)
    learnt_s = _follow(twin, question, plant.monitoring.centre_s)
    d, rules = plant.description, rules_of(plant)
    by_state = nominal_commands(rules)
    machine, step = d.machine, plant.description.machine.transitions
    decided = tuple(t for t in step if (t.source, t.target) == (question.state, question.target) and t.on_decision)[:1]
    commands = tuple(
        Command(tag, value, None if value is None else d.tags_by_name[tag].rate_limit)
        for tag, value in question.values.items()
    )
    then = what_follows(machine, question.target, by_state)
    actions = ActionSet(commands, question.target, then)
    way = (*decided, *(s.transition for s in then))
    path = RecoveryPath(machine, way) if way else None
    rest = ActionSet((), question.state, what_follows(machine, question.state, by_state))
    hypotheses = plausible(question.diagnosis)
    rollout, alone = twin.roll_out(actions, hypotheses), twin.roll_out(rest, hypotheses)
    verdict = judge(actions, rollout, d.limits, machine.state(actions.end), d.tags_by_name, path)
    violated = sorted((f for f in verdict.findings if not f.satisfied), key=lambda f: f.relative(d.scales))
    objections = [plainly(f.message) for f in violated]
    values = {tag: float(column[-1]) for tag, column in question.readings.signals.items()}
    closed = [t for t in decided if not t.guard.margin_at(values) >= 0.0]  # what is undecided is not open
    objections += [f"the step to {t.target!r} is not open: {t.guard}" for t in closed]
    return Tried(
        at_s=question.at_s,
        state=state_label(actions.end, d),
        moves=tuple(_moves(question, plant)),
        approved=isinstance(verdict, Approve) and not objections,
        objections=tuple(objections),
        margins=predicted_margins(verdict.findings, d),
        foresight=_told(rollout, plant, actions.digest),
        beside=_told(alone, plant, ""),
        cost=_cost(rollout, actions, plant, 1),
        cost_alone=_cost(alone, rest, plant, 0),
        currency=plant.prices.currency,
        assumed=tuple((worded(h, d)[0], h.probability) for h in by_fault_set(hypotheses)),
        learnt_s=learnt_s,
    )


def _follow(twin: Twin, question: Question, centre_s: float) -> float:
    """Show ``twin`` what was read; the healthy time that it has learnt from [s].

    As where the plant is watched, it learns from ``centre_s`` of healthy readings [s], and from nothing less.
    """
    readings, (from_s, to_s) = question.readings, question.healthy_s
    learns, learnt_s = to_s - from_s >= centre_s, 0.0
    part = readings.between(max(0.0, min(question.at_s, to_s) - _MOST_S), question.at_s)
    columns = {tag: values[part].tolist() for tag, values in readings.signals.items()}
    times = readings.times_s[part].tolist()
    for row, at_s in enumerate(times):
        bad = frozenset(t for t, spans in question.bad.items() if any(a <= at_s < b for a, b in spans))
        twin.observe(Snapshot(at_s, {tag: column[row] for tag, column in columns.items()}, bad))
        if learns and not learnt_s and (row + 1 == len(times) or times[row + 1] > to_s):
            twin.calibrate(centre_s)
            learnt_s = centre_s
    return learnt_s


def _moves(question: Question, plant: Plant) -> list[Move]:
    tags, before = plant.description.tags_by_name, question.targets
    return [
        Move(tag, tags[tag].description, tags[tag].unit, before.get(tag), tag in before, value, tags[tag].rate_limit)
        for tag, value in question.values.items()
    ]


def _told(rollout: Rollout, plant: Plant, digest: str) -> Foresight:
    told = foreseen(rollout, plant.description.limits, digest)
    return Foresight(told, first_limit(told, plant.description))


def _cost(rollout: Rollout, actions: ActionSet, plant: Plant, releases: int) -> float | None:
    if not rollout.weights:
        return None
    pricing = Pricing(plant.prices, plant.description.limits, plant.description.scales)
    total = pricing.of(rollout, actions.states, releases).total
    return total if math.isfinite(total) else None
