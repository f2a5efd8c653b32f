"""Everything that a plant's knowledge graph says, as one value: what agents, twin and guard are configured from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.diagnosis import FaultMode, Feature, SymptomRule
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.parameter import ModelParameter
from homeostat.domain.plant.prices import Price
from homeostat.domain.plant.rules import QualityRule, StartUp, TripRule, WriteRule
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.tag import Tag, scales_of
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.recovery import FallbackStrategy
from homeostat.stl.formula import Expression
from homeostat.stl.spelling import near_matches


class ComponentKind(StrEnum):
    """What a part of the plant is (VDI 2206)."""

    SYSTEM = "System"
    MODULE = "Module"
    COMPONENT = "Component"
    SENSOR = "Sensor"
    ACTUATOR = "Actuator"
    INFORMATION_PROCESSING = "InformationProcessing"


class Relation(StrEnum):
    """How a tag and a component belong together."""

    MEASURES = "measures"
    """The component is the sensor that measures the tag."""
    DRIVES = "drives"
    """The component is the actuator that follows the tag."""
    REPORTS = "reports"
    """The component works the tag out and reports it."""
    SETS = "sets"
    """The component is the controller whose setpoint the tag is."""
    OVERRIDES = "overrides"
    """The component is the actuator whose automatic command the tag replaces."""


@dataclass(frozen=True, slots=True)
class Component:
    """One part of the plant."""

    name: str
    """Identifier in the equipment table."""
    kind: ComponentKind
    """What it is."""
    part_of: str | None
    """Name of the part that it is in; None for the whole plant."""
    label: str
    """In the operator's words."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A tag with its place in the plant and in the process model."""

    tag: Tag
    """The tag."""
    component: str
    """Name of the component that it belongs to."""
    relation: Relation
    """How it belongs to it."""
    variable: str
    """Name of the quantity of the process model that carries its value."""


@dataclass(frozen=True, slots=True)
class ControlLoop:
    """A controller that moves a tag so that another one follows its setpoint."""

    name: str
    """Identifier."""
    controller: str
    """Component that carries it out."""
    process_variable: str
    """Tag that is held."""
    setpoint: str
    """Tag that says where."""
    manipulated_variable: str
    """Tag that is moved."""
    gain: str
    """Symbol of the model parameter that is the proportional gain."""
    reset: str
    """Symbol of the model parameter that is the integral gain."""
    label: str
    """In the operator's words."""


@dataclass(frozen=True, slots=True)
class Equation:
    """How one quantity follows from others."""

    name: str
    """Identifier."""
    operator: str
    """Process operator whose behaviour it describes."""
    result: str
    """Left side: a symbol, or ``dV/dt`` for a rate."""
    expression: Expression
    """Right side over tags and parameter symbols."""
    label: str
    """In the engineer's words."""


@dataclass(frozen=True, slots=True)
class PlantDescription:
    """A plant as its graph describes it; every list is sorted by name."""

    name: str
    """Name of the whole plant in the equipment table."""
    label: str
    """In the operator's words."""
    components: tuple[Component, ...]
    """Parts of the plant, the whole included."""
    signals: tuple[Signal, ...]
    """Tags with their places."""
    loops: tuple[ControlLoop, ...]
    """Control loops of the basic control system."""
    machine: StateMachine
    """Supervisory state machine."""
    limits: Limits
    """Trip limits, permissives, envelopes and acceptance criteria."""
    faults: tuple[FaultMode, ...]
    """Fault modes."""
    features: tuple[Feature, ...]
    """What monitoring computes."""
    symptom_rules: tuple[SymptomRule, ...]
    """When a feature's deviation counts, and which faults it indicates."""
    parameters: tuple[ModelParameter, ...]
    """Parameters of the process model with their uncertainty."""
    fallback_strategies: tuple[FallbackStrategy, ...]
    """Ways to the safe state."""
    equations: tuple[Equation, ...]
    """Equations of the process operators."""
    qualities: Mapping[str, QualityRule]
    """Tag -> when its reading is good, uncertain or bad."""
    trips: Mapping[str, TripRule]
    """Name of a hard limit -> how it is watched."""
    writables: Mapping[str, WriteRule]
    """Tag -> how it is commanded; no other tag can be."""
    start_up: StartUp
    """Start-up: its states, and its limits."""
    prices: tuple[Price, ...] = ()
    """What the tables price."""
    generated: tuple[FaultMode, ...] = ()
    """Fault modes that follow from instruments, actuators and balances; the tables may give some of them a name."""
    timing: Timing = REFERENCE
    """How often it is sampled, and how fast it is."""

    @property
    def fault_modes(self) -> tuple[FaultMode, ...]:
        """Those of the tables, then those that are generated."""
        return (*self.faults, *self.generated)

    @property
    def tags(self) -> tuple[Tag, ...]:
        """The tags."""
        return tuple(signal.tag for signal in self.signals)

    def tag(self, name: str) -> Tag:
        """The tag called ``name``; ValueError naming the nearest ones where there is none."""
        for signal in self.signals:
            if signal.tag.name == name:
                return signal.tag
        raise ValueError(f"plant {self.name!r} has no tag {name!r}{near_matches(name, (t.name for t in self.tags))}")

    @property
    def tags_by_name(self) -> dict[str, Tag]:
        """Name -> tag."""
        return {signal.tag.name: signal.tag for signal in self.signals}

    @property
    def variables(self) -> dict[str, str]:
        """Tag name -> quantity of the process model that carries its value."""
        return {signal.tag.name: signal.variable for signal in self.signals}

    @property
    def sampled(self) -> dict[str, int]:
        """Tag of an analyser, which shows each of its samples until the next one -> for how many ticks."""
        rules, timing = self.qualities.values(), self.timing
        ticks = {rule.tag: timing.ticks(timing.sampling_s(rule.every_s)) for rule in rules if rule.every_s is not None}
        return {tag: count for tag, count in ticks.items() if count > 1}

    @property
    def automatic(self) -> dict[str, str]:
        """Manual output -> the command that it overrides, which it goes on from; both are quantities of the model."""
        variables = self.variables
        return {variables[manual]: variables[command] for manual, command in self.overridden.items()}

    @property
    def overridden(self) -> dict[str, str]:
        """Manual output -> the command that it overrides, as tags."""
        driven = {s.component: s.tag.name for s in self.signals if s.relation is Relation.DRIVES}
        manual = [s for s in self.signals if s.relation is Relation.OVERRIDES]
        return {s.tag.name: driven[s.component] for s in manual if s.component in driven}

    @property
    def moved(self) -> frozenset[str]:
        """Tags that controllers move: actuators' commands and, of a cascade, the setpoints of the inner loops."""
        return frozenset(loop.manipulated_variable for loop in self.loops)

    @property
    def positions(self) -> dict[str, str]:
        """Actuator -> tag that shows where it stands: what a sensor measures that is a part of it."""
        within = {c.name: c.part_of for c in self.components}
        shown = {within.get(s.component): s.tag.name for s in self.signals if s.relation is Relation.MEASURES}
        return {s.component: shown[s.component] for s in self.signals if s.component in shown}

    @property
    def scales(self) -> dict[str, float]:
        """Unit -> what counts as one unit of margin in it: the smallest scale of its tags; 1 for mixed formulas."""
        return scales_of(self.tags)

    def fault(self, name: str) -> FaultMode:
        """The fault mode of the tables called ``name``; ValueError naming the nearest ones where there is none."""
        return _named(name, self.faults, f"plant {self.name!r} has no fault {name!r}")

    def fault_mode(self, name: str) -> FaultMode:
        """The fault mode called ``name``, generated ones included; ValueError as :meth:`fault`."""
        return _named(name, self.fault_modes, f"plant {self.name!r} has no fault mode {name!r}")


def _named(name: str, modes: Iterable[FaultMode], lacking: str) -> FaultMode:
    known = {mode.name: mode for mode in modes}
    if name not in known:
        raise ValueError(f"{lacking}{near_matches(name, known)}; it has {', '.join(known)}")
    return known[name]
