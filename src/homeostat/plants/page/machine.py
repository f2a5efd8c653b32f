"""The state machine: states with their risk, and the ways between them; many ways to one state become one box."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.state_machine import State, StateMachine, Transition
from homeostat.plants.page.figure import Arrow, Direction, Line, Shape, drawing, lines
from homeostat.plants.page.markup import Markup

AUTOMATIC: Final = "automatic"
"""A transition that is taken as soon as its guard holds."""
DECISION: Final = "decision"
"""A transition that somebody has to decide on."""
FALLBACK: Final = "fallback"
"""A transition that a fallback takes."""
_MANY: Final = 4
"""From so many on, decisions that share a state are drawn as one."""
_Ways: TypeAlias = "Mapping[tuple[str, str], list[Transition]]"
"""Source and target -> the transitions between them."""


def machine_drawing(plant: PlantDescription) -> Markup:
    """The drawing."""
    shapes, arrows = machine_figure(plant)
    machine = plant.machine
    described = (
        f"{len(machine.states)} states and {len(machine.transitions)} transitions, from {machine.initial.label} down. "
        "The tables below say the same, with every guard."
    )
    return drawing("machine", (f"State machine of {plant.label}", described), shapes, arrows, Direction.DOWN)


def machine_figure(plant: PlantDescription) -> tuple[dict[str, Shape], list[Arrow]]:
    """Boxes and arrows of the drawing: what the plant does by itself comes first, fallbacks last."""
    shapes = {f"state {state.name}": _state(state, plant) for state in from_start(plant.machine)}
    arrows: list[Arrow] = []
    for kind in (AUTOMATIC, DECISION, FALLBACK):
        ways = _ways(plant, kind)
        for state, into, many in _fans(ways) if kind != AUTOMATIC else ():
            name = f"{'to' if into else 'from'} {state}, {kind}"
            others = [source if into else target for source, target in many]
            shapes[name] = _pill(others, into, kind)
            ends = (name, f"state {state}") if into else (f"state {state}", name)
            arrows.append(Arrow(*ends, kind, _tip([t for way in many for t in ways[way]])))
            ways = {way: found for way, found in ways.items() if way not in many}
        for (source, target), found in ways.items():
            arrows.append(Arrow(f"state {source}", f"state {target}", kind, _tip(found)))
    return shapes, arrows


def kind_of(transition: Transition, plant: PlantDescription) -> str:
    """Who takes ``transition``: the plant by itself, somebody who decides, or a fallback."""
    if not transition.on_decision:
        return AUTOMATIC
    targets = {strategy.actions.target for strategy in plant.fallback_strategies}
    safe = transition.target in targets and transition.event != plant.machine.recovery_event
    return FALLBACK if safe else DECISION


def from_start(machine: StateMachine) -> list[State]:
    """The states in the order in which the plant comes to them."""
    names = [machine.initial.name]
    for by_itself in (True, False):
        for name in names:
            after = [t for t in machine.transitions if t.source == name and t.on_decision is not by_itself]
            names += dict.fromkeys(t.target for t in after if t.target not in names)
    return [machine.state(name) for name in dict.fromkeys([*names, *(state.name for state in machine.states)])]


def _ways(plant: PlantDescription, kind: str) -> _Ways:
    """Transitions of one kind by the states that they join, in the order of these; without those that stay."""
    found: dict[tuple[str, str], list[Transition]] = defaultdict(list)
    for state in from_start(plant.machine):
        for transition in plant.machine.transitions:
            stays = transition.source == transition.target
            if transition.source == state.name and not stays and kind_of(transition, plant) == kind:
                found[transition.source, transition.target].append(transition)
    return found


def _fans(ways: _Ways) -> Iterator[tuple[str, bool, list[tuple[str, str]]]]:
    """States that many ways lead to (True) or from (False), with these; each way is in one of them at most."""
    left = list(ways)
    for end in (1, 0):
        for state in dict.fromkeys(way[end] for way in left):
            many = [way for way in left if way[end] == state]
            if len(many) >= _MANY:
                yield state, end == 1, many
                left = [way for way in left if way not in many]


def _state(state: State, plant: PlantDescription) -> Shape:
    machine, told = plant.machine, [f"risk {state.risk}"]
    safe = any(strategy.actions.target == state.name for strategy in plant.fallback_strategies)
    told += ["start"] if state.initial else []
    told += ["fallback ends here"] if safe else []
    kind = "safe" if safe else "ordinary" if state.name in machine.ordinary else "abnormal"
    shown = [*lines(state.label or state.name, title=True), Line(", ".join(told))]
    shown += [Line("recovery may end here")] if state.recovery_target else []
    again = [t.event for t in machine.transitions if t.source == t.target == state.name]
    shown += [Line(f"↻ {event}") for event in dict.fromkeys(again)]
    icon = "initial" if state.initial else ""
    return Shape(f"state {kind}", tuple(shown), f"{state.name}: settled when {state.settled_when.text}", icon)


def _pill(states: Sequence[str], into: bool, kind: str) -> Shape:
    """The states that many ways come from or lead to."""
    word, names = "from" if into else "to", ", ".join(states)
    text = f"{word} {names}" if len(states) <= _MANY else f"{word} any of {len(states)} states"
    return Shape(f"many {kind}", lines(text), f"{word} {names}")


def _tip(transitions: Sequence[Transition]) -> str:
    return "; ".join(f"{t.name}: {t.source} to {t.target} on {t.event} if {t.guard.text}" for t in transitions)
