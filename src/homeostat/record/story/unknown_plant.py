"""A plant that is not to be had: what its run tells of it, with names in place of words and without units."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.plant.description import PlantDescription, Relation, Signal
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.plant.state_machine import State, StateMachine
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.domain.recovery import Command
from homeostat.journal import RunStarted
from homeostat.stl.formula import parse

_ANY: Final = Range(0.0, 1.0)
"""What nobody looks at."""
_INITIAL: Final = ""
"""Name of the state that a run is in before it says so."""


def unknown_plant(name: str, told: Iterable[object]) -> PlantDescription:
    """A plant called ``name`` that knows the tags, states and faults in ``told``, and nothing else."""
    tags, states, faults = dict[str, None](), dict.fromkeys([_INITIAL]), dict[str, None]()
    for part in (part for item in told for part in _parts(item)):
        match part:
            case Command():
                tags[part.tag] = None
            case FaultState():
                faults[part.fault] = None
            case RunStarted():
                faults.update(dict.fromkeys(part.faults))
            case StateEntered():
                states[part.state] = None
            case FallbackActivated():
                states[part.strategy] = None
    machine, start = StateMachine(name, tuple(map(_state, states)), ()), StartUp(frozenset(), {})
    signals, injected = tuple(map(_signal, tags)), tuple(map(_fault, faults))
    limits, nothing = Limits((), ()), ((),) * 5
    return PlantDescription(name, name, (), signals, (), machine, limits, injected, *nothing, {}, {}, {}, start)


def _parts(item: object) -> Iterator[object]:
    """``item`` and everything in it."""
    yield item
    if isinstance(item, tuple | list):
        for part in item:
            yield from _parts(part)
    elif isinstance(item, Mapping):
        yield from _parts(tuple(item.values()))
    elif dataclasses.is_dataclass(item):
        for field in dataclasses.fields(item):
            yield from _parts(getattr(item, field.name))


def _signal(name: str) -> Signal:
    return Signal(Tag(name, Role.PV, "1", _ANY, 1.0), "", Relation.REPORTS, "")


def _state(name: str) -> State:
    return State(name, name, 0, name == _INITIAL, False, parse("true", {}), frozenset(), ())


def _fault(name: str) -> FaultMode:
    return FaultMode(name, name, "", None, _ANY, 0.0, "1", 0.0, "")
