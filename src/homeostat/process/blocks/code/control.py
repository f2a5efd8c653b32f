"""Controllers in a kernel's source: their outputs before the actuators move, their integral terms after it."""

from __future__ import annotations

from enum import Enum

from homeostat.process.blocks.code.writing import Scope
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import Actuator, Controller
from homeostat.process.blocks.term import Leaf, Term, leaves


class Follows(Enum):
    """What the integral term of a controller does where its output is not what acts."""

    COMMAND = "command"
    """It follows the command of the actuator, so that its output would be the same."""
    SELECTED = "selected"
    """The same by hand; where another output was selected it becomes the command, and its output stays beyond that by
    its own error (external reset), so that it is selected again as soon as its error changes sign."""
    BY_HAND = "by hand"
    """It follows a command by hand, less what is added beside the output; else it goes on within its own limits."""
    STANDS = "stands"
    """It goes on while anything follows the output, and else stays as it is: what acts does not tell which output would
    have done the same."""


def follows(c: Controller, layout: Layout) -> tuple[Follows, tuple[Actuator, ...], tuple[Controller, ...]]:
    """What the controller's integral does, the actuators it acts on, and the controllers whose setpoint it is."""
    sheet = layout.sheet
    moved = tuple(a for a in sheet.actuators.values() if a.automatic is not None and c.output in leaves(a.automatic))
    inner = tuple(i for i in sheet.controllers.values() if i.setpoint is not None and c.output in leaves(i.setpoint))
    if len(moved) == 1 and not inner and not c.law.plain:
        return Follows.BY_HAND, moved, inner
    if len(moved) != 1 or inner or moved[0].automatic is None or not _chosen(moved[0].automatic, c.output):
        return Follows.STANDS, moved, inner
    return Follows.SELECTED if moved[0].automatic.op in ("min", "max") else Follows.COMMAND, moved, inner


def _chosen(automatic: Term, output: Term) -> bool:
    """Whether a command is that output, or one that is chosen among several."""
    if automatic.op in ("min", "max", "where"):
        return any(_chosen(each, output) for each in automatic.args)
    return automatic == output


def control(c: Controller, layout: Layout, scope: Scope) -> Scope:
    """The output of a controller from what was measured last."""
    at, given = layout.column, f"um[k, {layout.inputs.index(c.given)}]"
    setpoint = given
    if c.setpoint is not None and Term(Leaf.INPUT, value=c.given) in leaves(c.setpoint):
        setpoint = scope.name(c.setpoint)
    elif c.setpoint is not None:
        setpoint = f"{scope.name(c.setpoint)} if math.isnan({given}) else {given}"
    used, out, integral = (f"xm[{at[name]}]" for name in (str(c.used.value), str(c.output.value), c.integral))
    error, forward = f"e_{c.name}", f"ff_{c.name}"
    scope.say(f"{used} = {setpoint}", f"{error} = {float(c.acts)!r} * (xm[{at[c.measured]}] - {used})")
    scope.say(f"{forward} = {scope.name(c.forward)}")
    if c.derivative:
        scope.say(f"{forward} += {scope.name(c.gain('Kd'))} * ({error} - xm[{at[c.last]}]) / {layout.tick_s!r}")
        scope.say(f"xm[{at[c.last]}] = {error}")
    gain, least = scope.name(c.gain("Kp")), scope.name(c.law.least)
    acts = f"pid_output({error}, {integral} + {forward}, {gain}, {least}, 1.0)"
    if c.law.held is not None:
        stands = out if c.law.meanwhile is None else scope.name(c.law.meanwhile)
        scope.say(f"held_{c.name} = {scope.name(c.law.held)}")
        acts = f"{stands} if held_{c.name} else {acts}"
    scope.say(f"{out} = {acts}")
    return scope


def conclude(c: Controller, layout: Layout, scope: Scope) -> None:
    """Its integral term, once it is known what acted; while it is held, that from which its output would go on."""
    if c.law.held is None:
        scope.say(*_integrated(c, layout, scope))
        return
    at = layout.column
    out, integral = f"xm[{at[str(c.output.value)]}]", f"xm[{at[c.integral]}]"
    goes_on = f"{integral} = pid_tracking(e_{c.name}, {out} - ff_{c.name}, {scope.name(c.gain('Kp'))})"
    acts = _integrated(c, layout, scope)
    scope.say(f"if held_{c.name}:", f"    {goes_on}", "else:", *(f"    {line}" for line in acts))


def _integrated(c: Controller, layout: Layout, scope: Scope) -> list[str]:
    """Lines for the integral term of a controller that acts; what they need is worked out before them."""
    at = layout.column
    out, integral = f"xm[{at[str(c.output.value)]}]", f"xm[{at[c.integral]}]"
    gain, reset = scope.name(c.gain("Kp")), scope.name(c.gain("Ki"))
    error, forward = f"e_{c.name}", f"ff_{c.name}"
    how, moved, inner = follows(c, layout)
    least = scope.name(c.law.least)
    terms = f"{error}, {integral} + {forward}, {gain}, {reset}, {least}, 1.0, {layout.tick_s!r}"
    on = f"{integral} = pid_integral({terms}) - {forward}"
    if how is not Follows.STANDS:
        command, tracked = f"xm[{at[moved[0].command]}]", ""
        by_hand = f"not math.isnan(um[k, {layout.inputs.index(moved[0].manual)}])"
        if how is Follows.BY_HAND:
            output = f"{command} - {scope.name(c.law.beside)} - {forward}"
            goes = "True" if c.law.rests is None else f"not {scope.name(c.law.rests)}"
            return [
                f"if {by_hand}:", f"    {integral} = pid_tracking({error}, {output}, {gain})",
                f"elif {goes}:", f"    {on}",
            ]  # fmt: skip
        lines = []
        if how is Follows.SELECTED:
            lines += [f"if abs({command} - {out}) > 1e-12 and not ({by_hand}):"]
            lines += [f"    {integral} = {command} - {forward}"]
            tracked = "el"
        tracks = f"    {integral} = pid_tracking({error}, {command} - {forward}, {gain})"
        return [*lines, f"{tracked}if abs({command} - {out}) > 1e-12:", tracks, "else:", f"    {on}"]
    free = [f"math.isnan(um[k, {layout.inputs.index(name)}])" for name in
            (*(a.manual for a in moved), *(i.given for i in inner))]  # fmt: skip
    return [f"if {' or '.join(free) or 'True'}:", f"    {on}"]
