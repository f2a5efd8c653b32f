"""May what states admit and fallbacks command be commanded at all?"""

from homeostat.domain.mode import Side
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.tag import ROUNDING, Role, Tag
from homeostat.domain.recovery import Command
from homeostat.knowledge.checks.consistency_rules import ranges_of
from homeostat.knowledge.checks.intervals import can_hold
from homeostat.knowledge.store.error import Code, Found
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit


def setpoints(plant: PlantDescription) -> Found:
    """What the states admit: commandable tags, inside their ranges, design values inside the admitted range."""
    for state in plant.machine.states:
        for setpoint in state.setpoints:
            thing = f"state {state.name!r}"
            tag = plant.tag(setpoint.tag)
            if reason := _not_commandable(plant, setpoint.tag):
                yield Code.NOT_COMMANDABLE, thing, f"tag {tag.name!r} cannot be commanded: {reason}"
            allowed = f"[{tag.range.low:g}, {tag.range.high:g}]{in_unit(tag.unit)}"
            for value in (setpoint.low, setpoint.high):
                if not tag.range.contains(value):
                    message = f"admits {tag.name!r} = {value:g}, outside its range {allowed}"
                    yield Code.SETPOINT_OUTSIDE_RANGE, thing, message
            given = dict.fromkeys((setpoint.low, setpoint.high, *filter(None, (setpoint.design,))))
            for value in given:
                yield from _between(tag, value, Code.SETPOINT_OUTSIDE_RANGE, thing)
            if setpoint.design is not None and not setpoint.low <= setpoint.design <= setpoint.high:
                admitted = f"[{setpoint.low:g}, {setpoint.high:g}]{in_unit(tag.unit)}"
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
                allowed = f"[{tag.range.low:g}, {tag.range.high:g}]{in_unit(tag.unit)}"
                message = f"commands {tag.name!r} = {command.value:g}, outside its range {allowed}"
                yield Code.FALLBACK_OUTSIDE_RANGE, thing, message
            if command.value is not None:
                yield from _between(tag, command.value, Code.FALLBACK_OUTSIDE_RANGE, thing)
            yield from _hurried(plant, thing, command)


def _between(tag: Tag, value: float, code: Code, thing: str) -> Found:
    """A tag with two positions is at one of them."""
    if tag.range.contains(value) and abs(value - tag.nearest(value)) > ROUNDING * tag.range.span:
        positions = f"{tag.range.low:g} and {tag.range.high:g}"
        message = f"{tag.name!r} = {value:g} is neither of its two positions, {positions}"
        yield code, thing, f"{message}; state one of them, or a smaller increment in signals.csv"


def _hurried(plant: PlantDescription, thing: str, command: Command) -> Found:
    """A fallback is no faster than the equipment permits, be it by a rate of its own or by its tag's."""
    tag, rule, ends = plant.tag(command.tag), plant.writables.get(command.tag), "lower it, or empty the cell"
    if command.value is None or command.rate is None or rule is None:
        return
    most, why = (tag.rate_limit, "rate_limit in signals.csv") if rule.fastest is None else (rule.fastest, "fastest")
    if most is not None and command.rate > most:
        unit, what = f"{tag.unit}/s", "what writables.csv permits" if rule.fastest is not None else "its ordinary rate"
        message = f"fallbacks.csv, rate {command.rate:g} {unit} of {tag.name!r} is more than {most:g} {unit}, {what}"
        yield Code.BAD_NUMBER, thing, f"{message} ({why}); {ends}"


def permissives(plant: PlantDescription) -> Found:
    """What fallbacks command violates no permissive, whatever the plant does, but those that are set aside."""
    ranges = ranges_of(plant)
    rules = {limit.name: limit for limit in plant.limits.of_kind(LimitKind.PERMISSIVE)}
    for strategy in plant.fallback_strategies:
        thing = f"fallback {strategy.name!r}"
        for name in sorted(strategy.waived.keys() - rules.keys()):
            yield Code.UNKNOWN_LIMIT, thing, f"sets {name!r} aside, which is no permissive{near_matches(name, rules)}"
        commanded = {c.tag: (c.value, c.value) for c in strategy.actions.commands if c.value is not None}
        for name, rule in rules.items():
            if name not in strategy.waived and not can_hold(rule.formula.root, ranges | rule.following(commanded)):
                message = f"violates {name!r}, '{rule.formula}'; change its commands or add a waiver with the reason"
                yield Code.FALLBACK_NOT_PERMITTED, thing, message


def admitted(plant: PlantDescription) -> Found:
    """What fallbacks command is admitted by the state that they lead to."""
    for strategy in plant.fallback_strategies:
        thing, target = f"fallback {strategy.name!r}", plant.machine.state(strategy.actions.target)
        for command in strategy.actions.commands:
            found = target.setpoint(command.tag)
            if found is None:
                message = f"commands {command.tag!r}, but state {target.name!r} has no setpoint row for it; add one"
                yield Code.FALLBACK_NOT_ADMITTED, thing, message
            elif command.value is not None and not found.low <= command.value <= found.high:
                allowed = f"[{found.low:g}, {found.high:g}]{in_unit(plant.tag(command.tag).unit)}"
                message = f"commands {command.tag!r} = {command.value:g}, but state {target.name!r} admits {allowed}"
                yield Code.FALLBACK_NOT_ADMITTED, thing, message


def writables(plant: PlantDescription) -> Found:
    """Every tag that is commanded has a row of the writable tags that fits it, and no other tag has one."""
    for name, rule in sorted(plant.writables.items()):
        thing, tag = f"writable tag {name!r}", plant.tag(name)
        if reason := _not_commandable(plant, name):
            yield Code.NOT_COMMANDABLE, thing, f"cannot be commanded: {reason}"
        if tag.two_position and not _leads_across(tag):
            message = (
                f"increment {tag.increment:g}{in_unit(tag.unit)} does not lead from one end of its range to the other"
            )
            yield Code.BAD_NUMBER, thing, f"{message}; both must be multiples of it"
        if tag.increment is not None and rule.tolerance >= tag.increment:
            message = f"tolerance {rule.tolerance:g} must be below its increment {tag.increment:g}{in_unit(tag.unit)}"
            yield Code.BAD_NUMBER, thing, message
        if rule.fastest is not None and (tag.rate_limit is None or rule.fastest < tag.rate_limit):
            slow = "none, so that it may step" if tag.rate_limit is None else f"{tag.rate_limit:g} {tag.unit}/s"
            message = f"fastest {rule.fastest:g} {tag.unit}/s must not be below its rate_limit in signals.csv, {slow}"
            yield Code.BAD_NUMBER, thing, f"writables.csv, {message}; correct or empty the cell"
        if rule.ramped_by is Side.GUARD and tag.two_position and tag.rate_limit is not None:
            message = "has two positions and is ramped by the guard, which commands what is between"
            yield Code.TAG_NOT_WRITABLE, thing, f"{message}; let the plant do it"
        if rule.ramped_by is Side.GUARD and tag.rate_limit is None:
            yield Code.TAG_NOT_WRITABLE, thing, "is ramped by the guard, but has no rate_limit in the signal table"
    by_hand = {(s.name, r.tag, r.design is None) for s in plant.machine.states for r in s.setpoints}
    in_fallback = {(f.name, c.tag, c.value is None) for f in plant.fallback_strategies for c in f.actions.commands}
    for where, found in (("state", by_hand), ("fallback", in_fallback)):
        for name, written, automatic in sorted(found):
            thing, row = f"{where} {name!r}", plant.writables.get(written)
            if row is None:
                message = f"commands {written!r}, which has no row in the table of writable tags; add one"
                yield Code.TAG_NOT_WRITABLE, thing, message
            elif automatic and not row.automatic:
                message = (
                    f"hands {written!r} back to automatic, which its row of the writable tags forbids; fill the value"
                )
                yield Code.TAG_NOT_WRITABLE, thing, message


def _leads_across(tag: Tag) -> bool:
    """Whether both ends of a tag's range are multiples of its increment, and nothing between them is."""
    step = tag.increment or tag.range.span
    ends = (tag.range.low / step, tag.range.high / step)
    whole = all(abs(end - round(end)) <= ROUNDING for end in ends)
    return whole and round(ends[1]) - round(ends[0]) == 1


def _not_commandable(plant: PlantDescription, name: str) -> str:
    """Why nobody but the basic control system may write a tag; empty where it may be commanded."""
    tag = plant.tag(name)
    if tag.role not in (Role.SP, Role.MV):
        return f"it has role {tag.role}, needs SP or MV"
    for loop in plant.loops:
        if loop.manipulated_variable == name:
            return f"loop {loop.name!r} writes it; command its setpoint or a manual output instead"
    return ""
