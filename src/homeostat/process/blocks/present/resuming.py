"""Controllers that go on from a record: their integral terms follow from the commands that they gave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from homeostat.process.blocks.code.control import Follows, follows
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import Actuator, Controller
from homeostat.process.blocks.present.outputs import Part, Told, told_by
from homeostat.process.blocks.term import TICK, Leaf, Term, evaluate, leaves
from homeostat.process.equipment import pid_integral
from homeostat.process.types import Table, Vec

LATELY: Final = 30
"""Rows at the end of a record whose mean says which of several outputs was selected."""


def resume_controllers(layout: Layout, states: Table, readings: Mapping[str, Vec], parameters: Vec) -> frozenset[str]:
    """Let every controller go on without a bump, in place: its integral term stands behind the last command.

    ``states``: shape (members, states); ``readings``: variable -> shape (n,), n >= 2, where a command in row k was
    worked out from row k - 1; ``parameters``: shape (parameters,). Returns the columns of integral terms that no row
    tells, because the output was at its end in all of them: where these stand is a guess.
    """
    guessed = set[str]()
    held, given_by_hand = layout.leaf[Leaf.HELD], layout.leaf[Leaf.INPUT]
    values = dict(zip(layout.leaf[Leaf.PARAMETER].values(), parameters.tolist(), strict=True))
    values |= {TICK: layout.tick_s, **layout.healthy}
    recorded = dict(zip(held.values(), states.mean(axis=0).tolist(), strict=True))
    recorded |= {held[n]: v[:-1] for n, v in readings.items() if n in held}
    recorded |= {given_by_hand[n]: v[:-1] for n, v in readings.items() if n in given_by_hand}
    known, at = {**values, **recorded}, layout.column
    for c in layout.sheet.controllers.values():
        setpoint = _setpoint(c, readings, known)
        error = c.acts * (readings[c.measured][:-1] - setpoint)
        forward = np.broadcast_to(np.asarray(evaluate(c.forward, known), dtype=np.float64), error.shape)
        states[:, at[str(c.used.value)]] = setpoint[-1]
        if c.derivative:
            states[:, at[c.last]] = error[-1]
        gain, least = values[c.gain("Kp")], float(evaluate(c.law.least, values))
        beyond = _not_selected(c, layout, readings, known)
        if beyond is not None and not _frozen(c, readings, known, 1)[-1]:
            states[:, at[c.integral]] = beyond - forward[-1]
            states[:, at[str(c.output.value)]] = min(max(beyond + gain * error[-1], least), 1.0)
            continue
        given = _output(c, layout, readings, known, len(error))
        if given is None:
            guessed.add(c.integral)
            continue
        given = given._replace(by_hand=given.by_hand | _frozen(c, readings, known, len(error)))
        read = given.output[np.isfinite(given.output)]
        states[:, at[str(c.output.value)]] = read[-1] if read.size else least
        known[c.output] = given.output  # what it sets comes after it
        tuning = gain, values[c.gain("Ki")] * layout.tick_s, least
        states[:, at[c.integral]] = _integral(error, forward, given, tuning)
        if not np.any(given.known | given.by_hand):
            guessed.add(c.integral)
    return frozenset(guessed)


def _setpoint(c: Controller, readings: Mapping[str, Vec], known: Mapping[Term, Any]) -> Vec:
    """What the controller followed in each row but the last, shape (n - 1,)."""
    given = np.array(readings.get(c.given, np.full(len(readings[c.measured]), np.nan))[:-1], dtype=np.float64)
    if c.setpoint is None:
        return given
    own = np.broadcast_to(evaluate(c.setpoint, known), given.shape)
    told = readings.get(f"{c.measured}_err")
    if told is not None:  # what it says that it is off by is exact, and what its setpoint follows from is as read
        used = (readings[c.measured] - told)[1:]
        return np.where(np.isnan(used), own, used)
    return own if Term(Leaf.INPUT, value=c.given) in leaves(c.setpoint) else np.where(np.isnan(given), own, given)


def _not_selected(
    c: Controller, layout: Layout, readings: Mapping[str, Vec], known: Mapping[Term, Any]
) -> float | None:
    """The last command, where that was another controller's output that was selected in place of this one's; else None.

    Outputs that were not selected stand off the command by their own error (:class:`Follows`), and so show which was.
    """
    how, moved, _ = follows(c, layout)
    if how is not Follows.SELECTED or moved[0].command not in readings or _by_hand_at_last(moved[0], readings):
        return None
    command, automatic = readings[moved[0].command][1:][-LATELY:], moved[0].automatic
    assert automatic is not None
    rivals = [each for each in layout.sheet.controllers.values() if each.output in leaves(automatic)]
    stands: dict[Term, float] = {}
    for each in rivals:
        error = each.acts * (readings[each.measured][:-1] - _setpoint(each, readings, known))
        stands[each.output] = float(np.mean(command + known[each.gain("Kp")] * error[-LATELY:]))
    latest = {leaf: np.ravel(v)[-1] for leaf, v in known.items()}
    acted = float(evaluate(automatic, latest | stands))
    selected = min(stands, key=lambda output: abs(stands[output] - acted))
    return None if selected == c.output else float(command[-1])


def _output(
    c: Controller, layout: Layout, readings: Mapping[str, Vec], known: Mapping[Term, Any], rows: int
) -> Told | None:
    """What the record says of the controller's output, in each of ``rows`` rows; None if nothing tells."""
    how = follows(c, layout)[0]
    least = float(evaluate(c.law.least, known))
    no, free = np.zeros(rows, dtype=np.bool_), np.full(rows, np.inf)
    shown = next((s.name for s in layout.sheet.sensors.values() if s.of == c.output and s.name in readings), None)
    if shown is not None:
        output = readings[shown][1:]
        return Told(output, _inside(output, least), no, -free, free)
    parts = _parts(c, layout, readings, rows)
    if parts and how is not Follows.STANDS:
        part = parts[0]
        if how is Follows.BY_HAND:
            inside = (part.wanted > 0.0) & (part.wanted < 1.0)
            return Told(part.wanted - evaluate(c.law.beside, known), inside, part.by_hand, -free, free)
        other = part.by_hand
        if how is not Follows.SELECTED:  # which of several controllers was selected, their outputs alone do not tell
            # Where something else was chosen the integral term followed the command, as it does by hand.
            other = other | (part.at(c.output, known, least) == part.at(c.output, known, 1.0))
        return Told(part.wanted, _inside(part.wanted, least) & ~other, other, -free, free)
    if parts:
        return told_by(parts, c.output, known, least)
    for each in layout.sheet.controllers.values():
        stands = each.law.meanwhile
        if c.law.meanwhile == each.output and stands is not None and c.output in leaves(stands):  # one acts for both
            return _output(replace(each, law=replace(each.law, meanwhile=None)), layout, readings, known, rows)
    return None


def _parts(c: Controller, layout: Layout, readings: Mapping[str, Vec], rows: int) -> list[Part]:
    """All that follows the controller's output and is in the record: actuators, then setpoints of inner loops."""
    _, moved, inner = follows(c, layout)
    parts = list[Part]()
    for a in moved:
        if a.command in readings and a.automatic is not None:
            by_hand = ~np.isnan(readings[a.manual][1:]) if a.manual in readings else np.zeros(rows, dtype=np.bool_)
            parts.append(Part(a.automatic, readings[a.command][1:], by_hand))
    for i in inner:
        assert i.setpoint is not None
        given = readings.get(i.given, np.full(rows + 1, np.nan))[1:]
        # What it says that it is off by is exact, so that this is the setpoint in force.
        in_force = readings[i.measured][1:] - readings.get(f"{i.measured}_err", np.zeros(rows + 1))[1:]
        parts.append(Part(i.setpoint, np.where(np.isnan(given), in_force, given), ~np.isnan(given)))
    return parts


def _frozen(c: Controller, readings: Mapping[str, Vec], known: Mapping[Term, Any], rows: int) -> NDArray[np.bool_]:
    """The last ``rows`` in which a controller was held, so that its integral term follows where its output stood."""
    if c.law.held is None:
        return np.zeros(rows, dtype=np.bool_)
    commanded = {Term(Leaf.INPUT, value=name): v[1:] for name, v in readings.items()}
    found = evaluate(c.law.held, {**known, **commanded})
    return np.broadcast_to(np.asarray(found, dtype=np.bool_), (len(readings[c.measured]) - 1,))[-rows:]


def _by_hand_at_last(a: Actuator, readings: Mapping[str, Vec]) -> bool:
    """Whether the last command of an actuator says nothing of the output that others follow."""
    return a.manual in readings and not np.isnan(readings[a.manual][-1])


def _inside(output: Vec, least: float) -> NDArray[np.bool_]:
    """Rows in which an output is inside its limits, and so tells what it was worked out from."""
    return np.asarray((output > least + 1e-9) & (output < 1.0 - 1e-9))


def _integral(error: Vec, forward: Vec, told: Told, tuning: tuple[float, float, float]) -> float:
    """The integral term after the last row, followed from the last row in which the output tells it.

    From there on it stays where the output is within what the record says. ``tuning``: gain, reset per tick, and the
    lowest output.
    """
    gain, reset, least = tuning
    read = np.isfinite(error) & np.isfinite(forward) & np.isfinite(told.output)
    rows = np.flatnonzero((told.known | told.by_hand) & read)
    starts = rows if rows.size else np.flatnonzero(read)
    if not starts.size:
        return 0.0
    first = int(starts[-1] if rows.size else starts[0])
    integral = float(told.output[first] - forward[first] - gain * error[first])
    if told.by_hand[-1] and first == len(error) - 1:
        return integral
    if not rows.size:
        integral = min(
            max(_at_its_end(integral, told.output[first], least), least - forward[first]), 1.0 - forward[first]
        )
    for k in range(first + int(told.by_hand[first]), len(error)):
        if not read[k]:
            continue
        e, f = float(error[k]), float(forward[k])
        if k > first:
            integral = min(max(integral, told.low[k] - f - gain * e), told.high[k] - f - gain * e)
        integral = pid_integral(e, integral + f, gain, reset, least, 1.0, 1.0) - f
    # Where nothing told it, it is a guess that must not lead far; else it is as large as the error asks for.
    return integral if rows.size else min(max(integral, -1.0), 1.0)


def _at_its_end(reaches: float, output: float, least: float) -> float:
    """An integral term whose output was at its end in all that is on record; ``reaches``: what just gets it there.

    It is where a run begins, or as near to that as keeps the output there: a relief that has never opened would, with
    what just closes it, open at every rise of a pressure that is far below its setpoint.
    """
    if output <= least + 1e-9:
        return min(reaches, 0.0)
    return max(reaches, 0.0) if output >= 1.0 - 1e-9 else reaches
