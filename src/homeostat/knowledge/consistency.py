"""Do a plant's tables, its graph and its process model agree? Every mistake is named; none is found at run time only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from homeostat.domain.formula import Formula
from homeostat.domain.formula_ast import Always, Eventually, Node, Until, children, walk
from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.tag import Role, near_matches

from .graph_error import Code, GraphError
from .intervals import Intervals, bounds, can_fail, can_hold


@dataclass(frozen=True, slots=True)
class ModelInterface:
    """What a process model offers; the tables must cover it, and ask for no more."""

    parameters: frozenset[str]
    """Symbols of its parameters."""
    variables: frozenset[str]
    """Names of the quantities that tags can be carried by: states, inputs and quantities derived from them."""
    faults: frozenset[str]
    """Names of the faults that it can simulate."""
    horizon_s: float
    """Length of a rollout [s]."""


@dataclass(frozen=True, slots=True)
class Inconsistency:
    """One thing that does not fit."""

    code: Code
    """Which kind of mistake it is."""
    thing: str
    """What has the mistake, for example ``limit 'LIM-T-HIGH'``."""
    message: str
    """What is wrong, with value, limit and unit, and what to do."""

    def __str__(self) -> str:
        """One line."""
        return f"[{self.code}] {self.thing}: {self.message}"


def inconsistencies(plant: PlantDescription, model: ModelInterface) -> tuple[Inconsistency, ...]:
    """Everything that does not fit, in a fixed order; empty where all is well."""
    found = [
        *_components(plant),
        *_signals(plant, model),
        *_parameters(plant, model),
        *_loops(plant),
        *_equations(plant),
        *_states(plant),
        *_setpoints(plant),
        *_fallbacks(plant),
        *_faults(plant, model),
        *_formulas(plant),
        *_criteria(plant, model),
    ]
    return tuple(Inconsistency(code, thing, message) for code, thing, message in found)


def refuse_inconsistent(plant: PlantDescription, model: ModelInterface) -> None:
    """GraphError with the first inconsistency, and the number of the others, where there is any."""
    found = inconsistencies(plant, model)
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise GraphError(found[0].code, found[0].thing, found[0].message + more)


_Found = Iterator[tuple[Code, str, str]]


def _components(plant: PlantDescription) -> _Found:
    above = {component.name: component.part_of for component in plant.components}
    for component in plant.components:
        seen: set[str] = set()
        here: str | None = component.name
        while here is not None and here != plant.name and here not in seen:
            seen.add(here)
            here = above.get(here)
        if here != plant.name:
            message = f"is not a part of {plant.name!r}; correct part_of"
            yield Code.DISCONNECTED_COMPONENT, f"component {component.name!r}", message


def _signals(plant: PlantDescription, model: ModelInterface) -> _Found:
    symbols = {parameter.symbol for parameter in plant.parameters}
    for signal in plant.signals:
        thing = f"tag {signal.tag.name!r}"
        if signal.variable not in model.variables:
            hint = near_matches(signal.variable, model.variables)
            yield Code.UNKNOWN_VARIABLE, thing, f"the process model has no variable {signal.variable!r}{hint}"
        if signal.tag.name in symbols:
            yield Code.DUPLICATE_ID, thing, "is also the symbol of a parameter; rename one"


def _parameters(plant: PlantDescription, model: ModelInterface) -> _Found:
    stated = {parameter.symbol for parameter in plant.parameters}
    for symbol in sorted(model.parameters - stated):
        yield Code.MISSING_PARAMETER, f"parameter {symbol!r}", "is needed by the process model and stated in no table"
    for symbol in sorted(stated - model.parameters):
        hint = near_matches(symbol, model.parameters)
        yield Code.UNKNOWN_PARAMETER, f"parameter {symbol!r}", f"is stated but unknown to the process model{hint}"


def _loops(plant: PlantDescription) -> _Found:
    for loop in plant.loops:
        places = ((loop.process_variable, Role.PV), (loop.setpoint, Role.SP), (loop.manipulated_variable, Role.MV))
        for name, role in places:
            found = plant.tag(name).role
            if found is not role:
                yield Code.LOOP_ROLE, f"loop {loop.name!r}", f"tag {name!r} has role {found}, its place needs {role}"


def _equations(plant: PlantDescription) -> _Found:
    known = {tag.name for tag in plant.tags} | {parameter.symbol for parameter in plant.parameters}
    for equation in plant.equations:
        for name in sorted(equation.expression.tags - known):
            hint = near_matches(name, known)
            message = f"{name!r} is neither a tag nor a parameter{hint}"
            yield Code.UNKNOWN_SYMBOL, f"equation {equation.name!r}", message


def _states(plant: PlantDescription) -> _Found:
    machine = plant.machine
    reached = {machine.initial.name}
    for _ in machine.states:
        reached |= {transition.target for transition in machine.transitions if transition.source in reached}
    for state in machine.states:
        if state.name not in reached:
            message = f"no path of transitions leads to it from {machine.initial.name!r}"
            yield Code.STATE_UNREACHABLE, f"state {state.name!r}", message
    if not any(state.recovery_target for state in machine.states):
        thing = f"state machine {machine.name!r}"
        yield Code.NO_RECOVERY_TARGET, thing, "no state is a recovery_target, so no recovery could end"


def _setpoints(plant: PlantDescription) -> _Found:
    for state in plant.machine.states:
        for setpoint in state.setpoints:
            thing = f"state {state.name!r}"
            tag = plant.tag(setpoint.tag)
            if reason := _not_commandable(plant, setpoint.tag):
                yield Code.NOT_COMMANDABLE, thing, f"tag {tag.name!r} cannot be commanded: {reason}"
            allowed = f"[{tag.range.low:g}, {tag.range.high:g}] {tag.unit}"
            for value in (setpoint.low, setpoint.high):
                if not tag.range.contains(value):
                    message = f"admits {tag.name!r} = {value:g}, outside its range {allowed}"
                    yield Code.SETPOINT_OUTSIDE_RANGE, thing, message
            if setpoint.design is not None and not setpoint.low <= setpoint.design <= setpoint.high:
                message = f"design value {setpoint.design:g} of {tag.name!r} is outside [{setpoint.low:g}, {setpoint.high:g}]"
                yield Code.SETPOINT_OUTSIDE_RANGE, thing, f"{message} {tag.unit}"


def _fallbacks(plant: PlantDescription) -> _Found:
    if not plant.fallback_strategies:
        yield Code.NO_FALLBACK, f"plant {plant.name!r}", "has no fallback strategy; state at least one"
    for strategy in plant.fallback_strategies:
        thing = f"fallback {strategy.name!r}"
        for command in strategy.actions.commands:
            tag = plant.tag(command.tag)
            if reason := _not_commandable(plant, command.tag):
                yield Code.FALLBACK_TAG_NOT_COMMANDABLE, thing, f"tag {command.tag!r} cannot be commanded: {reason}"
            if command.value is not None and not tag.range.contains(command.value):
                allowed = f"[{tag.range.low:g}, {tag.range.high:g}] {tag.unit}"
                message = f"commands {tag.name!r} = {command.value:g}, outside its range {allowed}"
                yield Code.FALLBACK_OUTSIDE_RANGE, thing, message


def _not_commandable(plant: PlantDescription, name: str) -> str:
    """Why nobody but the basic control system may write a tag; empty where it may be commanded."""
    tag = plant.tag(name)
    if tag.role not in (Role.SP, Role.MV):
        return f"it has role {tag.role}, needs SP or MV"
    for loop in plant.loops:
        if loop.manipulated_variable == name:
            return f"loop {loop.name!r} writes it; command its setpoint or a manual output instead"
    return ""


def _faults(plant: PlantDescription, model: ModelInterface) -> _Found:
    indicated = {fault for rule in plant.symptom_rules for fault in rule.faults}
    stated = {fault.name for fault in plant.faults}
    for fault in plant.faults:
        thing = f"fault {fault.name!r}"
        if fault.name not in model.faults:
            hint = near_matches(fault.name, model.faults)
            yield Code.UNKNOWN_FAULT, thing, f"the process model cannot simulate it{hint}"
        if fault.name not in indicated:
            yield Code.FAULT_WITHOUT_SYMPTOM, thing, "no symptom indicates it, so it cannot be diagnosed"
        if not fault.severity_range.contains(fault.severity_nominal):
            low, high = fault.severity_range.low, fault.severity_range.high
            message = f"nominal severity {fault.severity_nominal:g} is outside [{low:g}, {high:g}] {fault.severity_unit}"
            yield Code.SEVERITY_OUTSIDE_RANGE, thing, message
    for name in sorted(model.faults - stated):
        yield Code.MISSING_FAULT, f"fault {name!r}", "is known to the process model and stated in no table"
    for rule in plant.symptom_rules:
        if not rule.faults:
            yield Code.SYMPTOM_WITHOUT_FAULT, f"symptom {rule.name!r}", "indicates no fault"


def _formulas(plant: PlantDescription) -> _Found:
    ranges = {tag.name: (tag.range.low, tag.range.high) for tag in plant.tags}
    for transition in plant.machine.transitions:
        yield from _momentary(f"transition {transition.name!r}", "guard", transition.guard)
        yield from _judged(plant, f"transition {transition.name!r}", transition.guard, ranges)
    for state in plant.machine.states:
        yield from _momentary(f"state {state.name!r}", "settled_when", state.settled_when)
        yield from _judged(plant, f"state {state.name!r}", state.settled_when, ranges)
    for limit in plant.limits.limits:
        yield from _momentary(f"limit {limit.name!r}", "limit", limit.formula)
        yield from _judged(plant, f"limit {limit.name!r}", limit.formula, ranges)
        yield from _breakable(f"limit {limit.name!r}", limit.formula, ranges)
    for criterion in plant.limits.criteria:
        yield from _judged(plant, f"criterion {criterion.name!r}", criterion.formula, ranges)
        yield from _breakable(f"criterion {criterion.name!r}", criterion.formula, ranges)


def _momentary(thing: str, what: str, formula: Formula) -> _Found:
    if any(isinstance(node, Always | Eventually | Until) for node, _ in walk(formula.root)):
        yield Code.LIMIT_LOOKS_AHEAD, thing, f"{what} '{formula}' is judged on one moment; remove always, eventually, until"


def _judged(plant: PlantDescription, thing: str, formula: Formula, ranges: Intervals) -> _Found:
    if not can_hold(formula.root, ranges):
        yield Code.GUARD_NEVER_TRUE, thing, f"'{formula}' cannot hold for any values inside the ranges of its tags"
    for bound in bounds(formula.root):
        tag = plant.tag(bound.tag)
        if not tag.range.contains(bound.value):
            allowed = f"[{tag.range.low:g}, {tag.range.high:g}] {tag.unit}"
            message = f"compares {tag.name!r} with {bound.value:g}, outside its range {allowed}"
            yield Code.LIMIT_OUTSIDE_RANGE, thing, message


def _breakable(thing: str, formula: Formula, ranges: Intervals) -> _Found:
    if not can_fail(formula.root, ranges):
        message = f"'{formula}' holds for all values inside the ranges of its tags, so it protects nothing"
        yield Code.LIMIT_NEVER_BROKEN, thing, message


def _criteria(plant: PlantDescription, model: ModelInterface) -> _Found:
    for criterion in plant.limits.criteria:
        needs = _bounded_s(criterion.formula.root)
        if needs > model.horizon_s:
            message = f"looks {needs:g} s ahead, but a rollout ends after {model.horizon_s:g} s"
            yield Code.CRITERION_WINDOW_BEYOND_HORIZON, f"criterion {criterion.name!r}", message


def _bounded_s(node: Node) -> float:
    """How many seconds ahead the bounded windows of a formula look; an unbounded one ends with the rollout."""
    below = max((_bounded_s(child) for child in children(node)), default=0.0)
    if isinstance(node, Always | Eventually | Until):
        return below + (node.high_s if node.high_s < float("inf") else node.low_s)
    return below
