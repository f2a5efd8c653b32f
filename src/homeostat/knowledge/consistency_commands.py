"""May what states admit and fallbacks command be commanded at all?"""

from __future__ import annotations

from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.tag import Role

from .graph_error import Code, Found


def setpoints(plant: PlantDescription) -> Found:
    """What the states admit: commandable tags, inside their ranges, design values inside the admitted range."""
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
                admitted = f"[{setpoint.low:g}, {setpoint.high:g}] {tag.unit}"
                message = f"design value {setpoint.design:g} of {tag.name!r} is outside {admitted}"
                yield Code.SETPOINT_OUTSIDE_RANGE, thing, message


def fallbacks(plant: PlantDescription) -> Found:
    """What the fallback strategies command: commandable tags, inside their ranges."""
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
