"""Controllers that go on from a record: their integral terms follow from the commands that they gave."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from homeostat.process.blocks.code.control import Follows, follows
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import Actuator, Controller
from homeostat.process.blocks.term import TICK, Leaf, Term, evaluate, leaves
from homeostat.process.equipment import pid_integral
from homeostat.process.types import Table, Vec


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
    for c in layout.sheet.controllers.values():
        known = {**values, **recorded}
        setpoint = np.array(readings.get(c.given, np.full(len(readings[c.measured]), np.nan))[:-1], dtype=np.float64)
        if c.setpoint is not None and given_by_hand[c.given] in leaves(c.setpoint):
            setpoint = np.broadcast_to(evaluate(c.setpoint, known), setpoint.shape)
        elif c.setpoint is not None:
            setpoint = np.where(np.isnan(setpoint), evaluate(c.setpoint, known), setpoint)
        error = c.acts * (readings[c.measured][:-1] - setpoint)
        forward = np.broadcast_to(np.asarray(evaluate(c.forward, known), dtype=np.float64), error.shape)
        given = _output(c, layout, readings, known, len(error))
        at = layout.column
        states[:, at[str(c.used.value)]] = setpoint[-1]
        if c.derivative:
            states[:, at[c.last]] = error[-1]
        if given is None:
            continue
        states[:, at[str(c.output.value)]] = given[0][-1]
        reset = values[c.gain("Ki")] * layout.tick_s
        tuning = values[c.gain("Kp")], reset, float(evaluate(c.law.least, values))
        states[:, at[c.integral]] = _integral(error, forward, *given, tuning)


def _output(
    c: Controller, layout: Layout, readings: Mapping[str, Vec], known: dict[Term, object], rows: int
) -> tuple[Vec, NDArray[np.bool_], NDArray[np.bool_]] | None:
    """What the controller's output was by the record, in which rows it is known to be it, and in which it was by hand.

    None if nothing tells.
    """
    how, moved, inner = follows(c, layout)
    for a in sorted(moved, key=lambda a: _at_last_by_hand(a, readings)):
        if a.command not in readings:
            continue
        by_hand = ~np.isnan(readings[a.manual][1:]) if a.manual in readings else np.zeros(rows, dtype=np.bool_)
        assert a.automatic is not None
        command = readings[a.command][1:]
        if how is Follows.BY_HAND:
            return command - evaluate(c.law.beside, known), (command > 0.0) & (command < 1.0), by_hand
        output = _inverse(a.automatic, c.output, command, known)
        return output, _inside(output), by_hand
    for i in inner:
        assert i.setpoint is not None
        used = readings.get(i.given)
        reading = readings[i.measured][1:]
        target = reading if used is None else np.where(np.isnan(used[1:]), reading, used[1:])
        output = _inverse(i.setpoint, c.output, target, known)
        return output, _inside(output), np.zeros(rows, dtype=np.bool_)
    return None


def _at_last_by_hand(a: Actuator, readings: Mapping[str, Vec]) -> bool:
    """Whether the last command of an actuator says nothing of the output that others follow."""
    return a.manual in readings and not np.isnan(readings[a.manual][-1])


def _inside(output: Vec) -> NDArray[np.bool_]:
    """Rows in which an output is inside its limits, and so tells what it was worked out from."""
    return np.asarray((output > 1e-9) & (output < 1.0 - 1e-9))


def _inverse(of: Term, output: Term, wanted: Vec, known: dict[Term, object]) -> Vec:
    """Output from 0 to 1 at which the monotone term ``of`` it is ``wanted``, by bisection, shape of ``wanted``."""
    low, high = np.zeros_like(wanted), np.ones_like(wanted)
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
