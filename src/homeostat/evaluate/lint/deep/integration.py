"""Are the steps short enough in which the model is integrated, wherever commands that are admitted may take it?"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.plant.state_machine import State
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import module_file
from homeostat.evaluate.lint.deep.following import batch_of, moments, recorded
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.process.batch import BatchRun
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.stabilised import stages_of
from homeostat.process.blocks.stiffness import Motion
from homeostat.process.seeds import Stream, generator
from homeostat.process.types import Table

MEMBERS: Final = 16
"""Sets of commands that are tried for each state of the machine."""
LOOKS: Final = 40
"""Moments at which each course is looked at."""
MOST_PARTS: Final = 100
"""Steps in a tick that a flowsheet may have."""
DOUBTFUL: Final = 0.7
"""Share of the rate that is stable from which a motion is integrated again in shorter steps."""
TRIED, TICKS, FINER = 20, 3, 4
"""How many moments of a course are integrated again, for how long, and in how many times as many steps."""
OFF: Final = 0.05
"""Share of what a state comes through by which it may differ after that."""
_SAFE: Final = 1.4
"""Rate times step that is proposed for Runge-Kutta 4."""


class Coarse(NamedTuple):
    """Where the steps are too long."""

    off: float
    """By how much of its range a state differs with shorter ones."""
    rate: float
    """How fast it moves [1/s]."""
    parts: int
    """In how many steps the tick is integrated, where these are equal."""
    state: str
    """Which it is."""
    where: str
    """In which course."""


def integration(bench: Bench) -> Iterator[Finding]:
    """One finding where the steps of a flowsheet are too long for its fastest motion."""
    model = bench.plant.model
    if not isinstance(model, ComposedModel) or not model.layout.rates:
        return
    bench.told("the steps of the integration")
    found = [coarse for course in _visited(bench) if (coarse := _coarse(bench, model, *course)) is not None]
    if not found:
        return
    worst, place = max(found), Place(module_file(bench), None, "parts")
    what = f"{worst.where}, {worst.state!r} moves by itself in {1.0 / worst.rate:.3g} s and is integrated in steps"
    yield Finding(Severity.ERROR, "integration", place, *_told(worst, what, model.layout))


def _told(worst: Coarse, what: str, layout: Layout) -> tuple[str, str]:
    """What is wrong, and what to do."""
    tick_s, stated_s = layout.tick_s, layout.sheet.fastest_s
    if stated_s is not None:
        remedy = f"state what is so fast, Flowsheet(fastest_s={1.0 / worst.rate:.2g}), or leave it out"
        try:
            stages_of(tick_s, 1.0 / worst.rate)
        except ValueError:  # which the flowsheet would refuse
            remedy = "leave out what is so fast, or give [time] a shorter tick_s"
        return f"{what} for {stated_s:.3g} s: with shorter ones it comes out otherwise", remedy
    needed = math.ceil(worst.rate * tick_s / _SAFE)
    remedy = f"integrate a tick in {needed} steps, Flowsheet(parts={needed})"
    if needed > MOST_PARTS:
        remedy = "leave out what is so fast, give Flowsheet a fastest_s, or give [time] a shorter tick_s"
    return f"{what} of {tick_s / worst.parts:.3g} s: with shorter ones it comes out otherwise", remedy


def _coarse(bench: Bench, model: ComposedModel, where: str, states: Table, inputs: Table) -> Coarse | None:
    """Where the steps are too long in a course, if they are."""
    layout, sound = model.layout, np.isfinite(states).all(axis=1)
    if not sound.any():
        return None
    states, inputs = states[sound], inputs[sound]
    motion = Motion(layout, states, inputs, bench.nominal)
    rates, names = motion.fastest()
    shares = rates / motion.stable
    rows = np.argsort(shares)[::-1][:TRIED]
    rows = rows[shares[rows] > DOUBTFUL]
    span = np.maximum(np.ptp(motion.states, axis=0), 1e-9)
    found = []
    for parts in np.unique(motion.parts[rows]).tolist():
        alike = rows[motion.parts[rows] == parts]
        again = Motion(layout, states[alike], inputs[alike], bench.nominal)
        off = np.nan_to_num(np.abs(again.ahead(TICKS) - again.ahead(TICKS, FINER)) / span, nan=np.inf).max(axis=1)
        for row, share in zip(alike.tolist(), off.tolist(), strict=True):
            found.append(Coarse(share, float(rates[row]), parts, names[row], where))
    worst = max(found, default=None)
    return worst if worst is not None and worst.off > OFF else None


def _visited(bench: Bench) -> Iterator[tuple[str, Table, Table]]:
    """States that the plant comes through, with their inputs: by itself, and at the bounds of what is admitted."""
    if len(bench.quiet.seen) < 2:
        begun = bench.plant.model.initial_state(bench.nominal)
        beside = begun + np.diag(0.01 * np.maximum(np.abs(begun), 1.0))  # what is at rest does not show how it moves
        yield "where a run begins", beside, np.tile(bench.plant.start, (begun.size, 1))
        return
    whole, states = recorded(bench)
    spread = np.linspace(0, len(states) - 1, 4 * LOOKS).astype(int)
    rows = np.unique([*spread, *range(max(0, len(states) - LOOKS), len(states))])  # before it breaks, if it does
    yield "in the fault-free course", states[rows], whole.inputs[rows]
    for state in bench.plant.description.machine.states if not bench.quiet.broke else ():
        if any(setpoint.low < setpoint.high for setpoint in state.setpoints):
            yield from _at_bounds(bench, state)


def _at_bounds(bench: Bench, state: State) -> Iterator[tuple[str, Table, Table]]:
    """Courses from the end of the fault-free one on, under commands at the bounds of what ``state`` admits."""
    plant, model = bench.plant, bench.plant.model
    last, d = moments(bench)[-1], bench.plant.description
    stride = max(1, d.timing.ticks(plant.twin.horizon_s) // LOOKS)
    steps = stride * LOOKS
    draws, usual = generator(0, Stream.LINT_COMMANDS), last.window.inputs[-1]
    inputs = np.tile(usual, (MEMBERS, steps, 1))
    for setpoint in state.setpoints:
        at = model.inputs.index(d.variables[setpoint.tag])
        offered = [setpoint.low, setpoint.high, math.nan if setpoint.design is None else setpoint.design]
        inputs[:, :, at] = draws.choice(offered, (MEMBERS, 1))
    one = batch_of(bench, last.window, last.state, last.at_s)
    batch = replace(
        one.members(np.zeros(MEMBERS, dtype=np.int64)),
        inputs=inputs,
        input_of=np.arange(MEMBERS),
        steps=steps,
        stride=stride,
    )
    run = BatchRun(model.kernel, batch, refuse=False)
    run.advance(steps)
    flat = run.record.reshape(-1, len(model.states))
    yield f"at the bounds of what {state.name!r} admits", flat, np.repeat(inputs[:, 0], LOOKS, axis=0)
