"""What the tables alone show of control: gains that act against each other, limits that the design itself violates.

And outputs that a state commands by hand and the next one does not command, so that they stay where they are.
"""

from __future__ import annotations

from collections.abc import Iterator

from homeostat.domain.plant.description import ControlLoop, PlantDescription, Relation
from homeostat.domain.plant.limits import LimitKind
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.evaluate.lint.places import Places
from homeostat.knowledge.checks.consistency_rules import ranges_of
from homeostat.knowledge.checks.intervals import can_hold
from homeostat.plants.wired.guarding import by_design


def opposed_gains(plant: PlantDescription, places: Places) -> Iterator[Finding]:
    """Loops whose two gains have different signs."""
    values = {p.symbol: p.value for p in plant.parameters}
    for loop in plant.loops:
        gain, reset = values.get(loop.gain, 0.0), values.get(loop.reset, 0.0)
        if gain * reset < 0.0:
            other = places.row("parameters", symbol=loop.reset)
            what = (
                f"{loop.gain} = {gain:g} and {loop.reset} = {reset:g} ({other}) of loop {loop.name!r} have different "
                "signs: one acts against the other"
            )
            place = places.row("parameters", symbol=loop.gain)
            remedy = "give both the same sign, that of the loop's action"
            yield Finding(Severity.ERROR, "loops", place, what, remedy)


def held_beyond(plant: PlantDescription, places: Places) -> Iterator[Finding]:
    """Limits that cannot hold with what the state holds in which the plant stands by design."""
    steps = by_design(plant)
    if not steps:
        return
    state = steps[-1].target
    held, ranges = _held(plant, state), ranges_of(plant)
    fixed = ranges | {tag: (value, value) for tag, (value, _) in held.items()}
    for limit in plant.limits.limits:
        root = limit.formula.root
        if limit.kind is LimitKind.PERMISSIVE or not can_hold(root, ranges) or can_hold(root, fixed):
            continue
        told = [
            f"{tag!r} at {amount(value, plant.tag(tag).unit, 6)} ({places.row('setpoints', state=state, tag=setpoint)})"
            for tag, (value, setpoint) in sorted(held.items())
            if tag in limit.formula.tags
        ]
        what = f"'{limit.formula}' is violated all the time in {state!r}, which by design holds {' and '.join(told)}"
        place = places.row("limits", id=limit.name)
        yield Finding(Severity.ERROR, "rules", place, what, "correct the limit, or the design in setpoints.csv")


def kept_by_hand(plant: PlantDescription, places: Places) -> Iterator[Finding]:
    """Manual outputs that a state by design, or a fallback, commands and a state that follows leaves where they are."""
    manual = {s.tag.name for s in plant.signals if s.relation is Relation.OVERRIDES} & plant.overridden.keys()
    commanded, found = _commanded(plant), dict[tuple[str, str], dict[str, float]]()
    for transition in plant.machine.transitions:
        target = plant.machine.state(transition.target)
        for tag, value in commanded.get(transition.source, {}).items():
            if tag in manual and target.setpoint(tag) is None:
                found.setdefault((tag, target.name), {})[transition.source] = value
    for (tag, after), sources in sorted(found.items()):
        unit = plant.tag(tag).unit
        told = " and ".join(f"{amount(value, unit, 6)} in {name!r}" for name, value in sorted(sources.items()))
        what = (
            f"{tag!r} is commanded by hand, to {told}, and {after!r}, which follows, does not command it: it stays "
            "there, and its controller moves nothing"
        )
        remedy = (
            f"give it a row in {after!r}: automatic ({after},{tag},0,0, with no design), a range for a choice, or "
            "the value at which it is to stay"
        )
        first = min(sources)
        yield Finding(Severity.WARNING, "states", places.row("setpoints", state=first, tag=tag), what, remedy)


def _commanded(plant: PlantDescription) -> dict[str, dict[str, float]]:
    """State -> tag -> value that a fallback which leads there commands, or else the state by design."""
    design = {s.name: {r.tag: r.design for r in s.setpoints if r.design is not None} for s in plant.machine.states}
    for strategy in plant.fallback_strategies:
        sent = {c.tag: c.value for c in strategy.actions.commands if c.value is not None}
        design[strategy.actions.target] |= sent
    return design


def _held(plant: PlantDescription, name: str) -> dict[str, tuple[float, str]]:
    """Tag -> value at which the state called ``name`` holds it by design, and the setpoint that says so.

    A loop whose actuator is commanded by hand there holds nothing, nor does one that may be overridden by another.
    """
    state, found = plant.machine.state(name), dict[str, tuple[float, str]]()
    for loop in plant.loops:
        row = state.setpoint(loop.setpoint)
        if row is None or row.design is None or _rivals(plant, loop) or _by_hand(plant, loop, name):
            continue
        found |= {tag: (row.design, loop.setpoint) for tag in (loop.process_variable, loop.setpoint)}
    return found


def _rivals(plant: PlantDescription, loop: ControlLoop) -> bool:
    return any(each.manipulated_variable == loop.manipulated_variable and each != loop for each in plant.loops)


def _by_hand(plant: PlantDescription, loop: ControlLoop, name: str) -> bool:
    """Whether a state commands the loop's actuator by hand by design."""
    state = plant.machine.state(name)
    driven = {s.component for s in plant.signals if s.tag.name == loop.manipulated_variable}
    manual = [s.tag.name for s in plant.signals if s.relation is Relation.OVERRIDES and s.component in driven]
    rows = [row for tag in manual if (row := state.setpoint(tag)) is not None]
    return any(row.design is not None for row in rows)
