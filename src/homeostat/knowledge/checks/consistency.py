"""Do a plant's tables, its graph and its process model agree? Every mistake is named before anything runs."""

from dataclasses import dataclass

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Role
from homeostat.knowledge.checks import (
    consistency_bounds,
    consistency_commands,
    consistency_guard,
    consistency_prices,
    consistency_rules,
)
from homeostat.knowledge.store.error import Code, Found, Mistake, refuse
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit


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


def inconsistencies(plant: PlantDescription, model: ModelInterface) -> tuple[Mistake, ...]:
    """Everything that does not fit, in a fixed order; empty where all is well."""
    found = [
        *_components(plant),
        *_signals(plant, model),
        *_parameters(plant, model),
        *_loops(plant),
        *_equations(plant),
        *_states(plant),
        *_faults(plant, model),
        *consistency_commands.setpoints(plant),
        *consistency_commands.fallbacks(plant),
        *consistency_commands.permissives(plant),
        *consistency_commands.admitted(plant),
        *consistency_commands.writables(plant),
        *consistency_rules.formulas(plant),
        *consistency_rules.criteria(plant, model.horizon_s),
        *consistency_prices.prices(plant),
        *consistency_guard.trips(plant),
        *consistency_guard.readings(plant),
        *consistency_guard.start_up(plant),
        *consistency_guard.effects(plant),
        *consistency_bounds.trips(plant),
        *consistency_bounds.effects(plant),
        *consistency_bounds.readings(plant),
        *consistency_bounds.commands(plant),
        *consistency_bounds.symptoms(plant),
    ]
    return tuple(map(Mistake._make, found))


def refuse_inconsistent(plant: PlantDescription, model: ModelInterface) -> None:
    """GraphError with the first inconsistency, and the number of the others, where there is any."""
    refuse(inconsistencies(plant, model))


def _components(plant: PlantDescription) -> Found:
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


def _signals(plant: PlantDescription, model: ModelInterface) -> Found:
    symbols = {parameter.symbol for parameter in plant.parameters}
    for signal in plant.signals:
        thing = f"tag {signal.tag.name!r}"
        if signal.variable not in model.variables:
            hint = near_matches(signal.variable, model.variables)
            yield Code.UNKNOWN_VARIABLE, thing, f"the process model has no variable {signal.variable!r}{hint}"
        if signal.tag.name in symbols:
            yield Code.DUPLICATE_ID, thing, "is also the symbol of a parameter; rename one"


def _parameters(plant: PlantDescription, model: ModelInterface) -> Found:
    stated = {parameter.symbol for parameter in plant.parameters}
    for symbol in sorted(model.parameters - stated):
        yield Code.MISSING_PARAMETER, f"parameter {symbol!r}", "is needed by the process model and stated in no table"
    for symbol in sorted(stated - model.parameters):
        hint = near_matches(symbol, model.parameters)
        yield Code.UNKNOWN_PARAMETER, f"parameter {symbol!r}", f"is stated but unknown to the process model{hint}"


def _loops(plant: PlantDescription) -> Found:
    for loop in plant.loops:
        inner = loop.manipulated_variable in {each.setpoint for each in plant.loops if each != loop}
        moved = Role.SP if inner else Role.MV  # the outer loop of a cascade moves a setpoint
        places = ((loop.process_variable, Role.PV), (loop.setpoint, Role.SP), (loop.manipulated_variable, moved))
        for name, role in places:
            found = plant.tag(name).role
            if found is not role:
                yield Code.LOOP_ROLE, f"loop {loop.name!r}", f"tag {name!r} has role {found}, its place needs {role}"


def _equations(plant: PlantDescription) -> Found:
    known = {tag.name for tag in plant.tags} | {parameter.symbol for parameter in plant.parameters}
    for equation in plant.equations:
        for name in sorted(equation.expression.tags - known):
            hint = near_matches(name, known)
            message = f"{name!r} is neither a tag nor a parameter{hint}"
            yield Code.UNKNOWN_SYMBOL, f"equation {equation.name!r}", message


def _states(plant: PlantDescription) -> Found:
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


def _faults(plant: PlantDescription, model: ModelInterface) -> Found:
    indicated = {fault for rule in plant.symptom_rules for fault in rule.faults}
    stated = {fault.name for fault in plant.faults}
    for fault in plant.faults:
        thing = f"fault {fault.name!r}"
        if fault.mode is not None and fault.name in model.faults:
            message = f"is the generated mode {fault.mode!r} and an equation of the process model; empty the cell mode"
            yield Code.DUPLICATE_ID, thing, message
        if fault.mode is None and fault.name not in model.faults:
            hint = near_matches(fault.name, model.faults)
            yield Code.UNKNOWN_FAULT, thing, f"the process model cannot simulate it{hint}"
        if fault.name not in indicated:
            yield Code.FAULT_WITHOUT_SYMPTOM, thing, "no symptom indicates it, so it cannot be diagnosed"
        if not fault.severity_range.contains(fault.severity_nominal):
            allowed = f"[{fault.severity_range.low:g}, {fault.severity_range.high:g}]{in_unit(fault.severity_unit)}"
            message = f"nominal severity {fault.severity_nominal:g} is outside {allowed}"
            yield Code.SEVERITY_OUTSIDE_RANGE, thing, message
    for name in sorted(model.faults - stated):
        yield Code.MISSING_FAULT, f"fault {name!r}", "is known to the process model and stated in no table"
    for rule in plant.symptom_rules:
        if not rule.faults:
            yield Code.SYMPTOM_WITHOUT_FAULT, f"symptom {rule.name!r}", "indicates no fault"
