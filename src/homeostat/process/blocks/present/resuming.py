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
from homeostat.process.blocks.term import TICK, Leaf, Term, evaluate, leaves
from homeostat.process.equipment import pid_integral
from homeostat.process.types import Table, Vec

LATELY: Final = 30
"""Rows at the end of a record whose mean says which of several outputs was selected."""


def resume_controllers(layout: Layout, states: Table, readings: Mapping[str, Vec], parameters: Vec) -> None:
    """Let every controller go on without a bump, in place: its integral term stands behind the last command.

    ``states``: shape (members, states); ``readings``: variable -> shape (n,), n >= 2, where a command in row k was
    worked out from row k - 1; ``parameters``: shape (parameters,).
    """
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
            continue
        given = given[0], given[1], given[2] | _frozen(c, readings, known, len(error))
        states[:, at[str(c.output.value)]] = given[0][-1]
        known[c.output] = given[0]  # what it sets comes after it
        tuning = gain, values[c.gain("Ki")] * layout.tick_s, least
        states[:, at[c.integral]] = _integral(error, forward, *given, tuning)


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
) -> tuple[Vec, NDArray[np.bool_], NDArray[np.bool_]] | None:
    """What the controller's output was by the record, in which rows it is known to be it, and in which it was by hand.

    None if nothing tells.
    """
    how, moved, inner = follows(c, layout)
    least = float(evaluate(c.law.least, known))
    shown = next((s.name for s in layout.sheet.sensors.values() if s.of == c.output and s.name in readings), None)
    if shown is not None:
        output = readings[shown][1:]
        return output, _inside(output, least), np.zeros(rows, dtype=np.bool_)
    for a in sorted(moved, key=lambda a: _by_hand_at_last(a, readings)):
        if a.command not in readings:
            continue
        by_hand = ~np.isnan(readings[a.manual][1:]) if a.manual in readings else np.zeros(rows, dtype=np.bool_)
        assert a.automatic is not None
        command = readings[a.command][1:]
        if how is Follows.BY_HAND:
            return command - evaluate(c.law.beside, known), (command > 0.0) & (command < 1.0), by_hand
        output = command if how is Follows.SELECTED else _inverse(a.automatic, c.output, command, known, least)
        return output, _inside(output, least), by_hand
    for i in inner:
        assert i.setpoint is not None
        used = readings.get(i.given)
        reading = readings[i.measured][1:] - readings.get(f"{i.measured}_err", np.zeros(rows + 1))[1:]
        target = reading if used is None else np.where(np.isnan(used[1:]), reading, used[1:])
        output = _inverse(i.setpoint, c.output, target, known, least)
        return output, _inside(output, least), np.zeros(rows, dtype=np.bool_)
    for other in layout.sheet.controllers.values():
        stands = other.law.meanwhile
        if c.law.meanwhile == other.output and stands is not None and c.output in leaves(stands):  # one acts for both
            return _output(replace(other, law=replace(other.law, meanwhile=None)), layout, readings, known, rows)
    return None


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


def _inverse(of: Term, output: Term, wanted: Vec, known: Mapping[Term, Any], least: float) -> Vec:
    """Output from ``least`` to 1 at which the monotone term ``of`` it is ``wanted``, by bisection; of its shape."""
    low, high = np.full_like(wanted, least), np.ones_like(wanted)
    rises = np.mean(evaluate(of, {**known, output: high}) - evaluate(of, {**known, output: low})) >= 0.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        below = evaluate(of, {**known, output: middle}) < wanted
        up = below if rises else ~below
        low, high = np.where(up, middle, low), np.where(up, high, middle)
    return np.asarray(0.5 * (low + high))


def _integral(
    error: Vec,
    forward: Vec,
    output: Vec,
    known: NDArray[np.bool_],
    by_hand: NDArray[np.bool_],
    tuning: tuple[float, float, float],
) -> float:
    """The integral term after the last row, followed from the last row in which the output tells it.

    It does where the output is ``known``, or by hand. ``tuning``: gain, reset per tick, and the lowest output.
    """
    gain, reset, least = tuning
    told = np.flatnonzero(known | by_hand)
    first = int(told[-1]) if told.size else 0
    integral = float(output[first] - forward[first] - gain * error[first])
    if by_hand[-1]:
        return integral
    if not told.size:
        integral = min(max(integral, least - forward[first]), 1.0 - forward[first])
    rest = slice(first + int(by_hand[first]), None)
    for e, f in zip(error[rest].tolist(), forward[rest].tolist(), strict=True):
        integral = pid_integral(e, integral + f, gain, reset, least, 1.0, 1.0) - f
    return min(max(integral, -1.0), 1.0)
