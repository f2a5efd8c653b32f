"""Can a twin follow the plant with this model: estimates, replays of what was commanded, and control that resumes?

All of it on the plant's own fault-free course without noise, where a model that is right is right exactly; then, with
noise and parameters of their own, plants that are no mistake and must not be taken for one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.plant.description import Relation
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import of_model
from homeostat.evaluate.lint.deep.explained import explained
from homeostat.evaluate.lint.finding import Finding, amount
from homeostat.evaluate.lint.own_code import written
from homeostat.process.batch import Batch, simulate
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.types import Table, Vec
from homeostat.twin.carried import Carried
from homeostat.twin.history import History, Window
from homeostat.twin.replay import replay

LOOKS: Final = (0.4, 0.6, 0.8)
"""Shares of the course after which it is looked at [1]."""
SAME: Final = 0.01
"""Share of a tag's range by which an estimate may be off [1]."""
BUMP: Final = 0.01
"""Share of an output's range by which control may jump where it resumes [1]."""
FAR: Final = 0.1
"""Share of its size by which a state is taken to be far from where it is [1]."""
MOVES: Final = 0.05
"""Share of its range by which an actuator is off both ends where it moves [1]."""
LATEST: Final = 300
"""Readings from which control resumes."""


class Moment(NamedTuple):
    """One moment of the quiet course."""

    row: int
    """How many ticks of it there are before this one."""
    window: Window
    """All that was read until then."""
    state: Vec
    """The true state, shape (states,)."""

    @property
    def at_s(self) -> float:
        """Process time [s]."""
        return self.window.end_s


def following(bench: Bench) -> Iterator[Finding]:
    """Every trouble that a twin would have, each once."""
    bench.told("what a twin needs")
    seen, found = set[tuple[str, str]](), _findings(bench)
    for finding in found:
        key = (str(finding.where), finding.remedy)
        if key not in seen:
            seen.add(key)
            yield finding
    if not seen:
        further = list(_resumed_further(bench))
        yield from further[:1] or explained(bench)


def _findings(bench: Bench) -> Iterator[Finding]:
    for moment in moments(bench):
        wrong = [*_estimate(bench, moment)]
        yield from wrong
        if not wrong:
            yield from _replayed(bench, moment)
            yield from _resumed(bench, moment)


def moments(bench: Bench) -> tuple[Moment, ...]:
    """Some moments of the quiet course, with the true states."""
    whole, states = recorded(bench)
    rows = [int(share * (whole.length - 2)) for share in LOOKS]
    return tuple(Moment(row, _part(whole, 0, row + 1), states[row]) for row in rows)


def recorded(bench: Bench) -> tuple[Window, Table]:
    """All that was read in the quiet course, and its true states, shape (ticks, states)."""
    return bench.kept("recorded", lambda: _recorded(bench))


def _recorded(bench: Bench) -> tuple[Window, Table]:
    plant, course = bench.plant, bench.quiet
    history = History(
        plant.description.variables,
        plant.model.inputs,
        plant.twin.settle_rows,
        len(course.seen),
        plant.description.timing.tick_s,
    )
    for snapshot in course.seen:
        history.append(snapshot)
    whole = history.whole
    begun = plant.model.initial_state(bench.nominal)
    return whole, simulate(plant.model.kernel, batch_of(bench, whole, begun)).record[0]


def batch_of(bench: Bench, window: Window, state: Vec, start_s: float = 0.0) -> Batch:
    """One member along the inputs of ``window`` from ``state`` on."""
    model = bench.plant.model
    none, one = np.zeros((1, len(model.faults))), np.zeros(1)
    return Batch(
        state=state[None].copy(),
        parameters=bench.nominal[None],
        severity=none,
        onset_s=np.full_like(none, np.inf),
        inputs=window.inputs[None],
        input_of=np.zeros(1, dtype=np.int64),
        start_s=start_s,
        steps=window.length,
        stride=1,
        record=tuple(range(len(model.states))),
        seeds=np.zeros(1, dtype=np.int64),
        process_noise=one,
        sensor_noise=one,
    )


def _part(window: Window, first: int, last: int) -> Window:
    """Rows ``first`` to ``last`` - 1."""
    readings = {name: column[first:last] for name, column in window.readings.items()}
    return Window(window.at_s(first), readings, window.inputs[first:last], window.settle_rows, tick_s=window.tick_s)


def _estimate(bench: Bench, moment: Moment) -> Iterator[Finding]:
    """An estimate shows the readings that it was made from, and the truth is what they say."""
    model, d = bench.plant.model, bench.plant.description
    inputs = moment.window.inputs[-1]
    read = model.readings(moment.state, inputs)
    estimate = model.estimate(read)
    again = model.readings(estimate, inputs)
    ahead = Window(moment.window.end_s, {}, inputs[None])
    pair = np.stack([moment.state, _controlled(bench, moment, estimate)])
    later = np.stack([simulate(model.kernel, batch_of(bench, ahead, s, ahead.start_s)).state[0] for s in pair])
    truth = model.truth(np.stack([pair, later], axis=1), np.tile(inputs, (2, 2, 1)))
    for signal in d.signals:
        name, tag = signal.variable, signal.tag
        allowed = SAME * tag.range.span
        shown = abs(again[name] - read[name])
        if shown > allowed:
            was, made = amount(read[name], tag.unit, 6), amount(again[name], tag.unit, 6)
            what = f"from {name!r} = {was} it makes a state that shows {made}"
            yield of_model(bench, "following", "estimate", f"at {moment.at_s:g} s {what}", _TAKE.format(name=name))
            continue
        at_once, later_on = np.abs(np.diff(truth[name], axis=0))[0].tolist()
        # What is controlled is judged a tick later, as what a state shows at once may be a copy; some follow then only.
        off = later_on if name in bench.plant.twin.corrected else min(at_once, later_on)
        if signal.relation is Relation.MEASURES and off > allowed:
            was, made = (amount(value, tag.unit, 6) for value in truth[name][:, 1].tolist())
            what = f"a tick after {moment.at_s:g} s the true {name!r} is {was}, the state that it makes {made}"
            yield of_model(bench, "following", "estimate", what, _TAKE.format(name=name))


def _controlled(bench: Bench, moment: Moment, estimate: Vec) -> Vec:
    """``estimate`` with control that goes on from the last readings."""
    window = _part(moment.window, max(0, moment.window.length - LATEST), moment.window.length)
    states: Table = estimate[None].copy()
    bench.plant.model.resume(states, window.readings, bench.nominal[None].copy())
    return np.asarray(states[0])


_TAKE: Final = "let the state that {name!r} shows be what was read"


def _replayed(bench: Bench, moment: Moment) -> Iterator[Finding]:
    """The model driven by what was recorded shows what was read, to the errors that the settings state."""
    plant = bench.plant
    rows = min(plant.description.timing.ticks(plant.twin.replay_s), moment.window.length)
    window = _part(moment.window, moment.window.length - rows, moment.window.length)
    names = tuple(plant.twin.errors)
    none = np.zeros((1, len(plant.model.faults)))
    healthy = Carried(none, np.full_like(none, np.inf), ((),))
    shown = replay(plant.model, window, bench.nominal[None], healthy, names).predicted[0]
    for k, name in enumerate(names):
        noise, error = plant.twin.errors[name]
        off = np.abs(shown[:, k] - window.readings[name][1:])
        moved = plant.twin.gain_error * float(np.ptp(window.readings[name]))
        late = plant.twin.lag_error_s / window.tick_s * float(np.abs(np.diff(window.readings[name])).max(initial=0.0))
        allowed = noise + error + moved + late
        worst = int(np.argmax(off))
        if float(np.sqrt(np.mean(off**2))) > allowed:
            what = (
                f"a replay of the {rows * window.tick_s:g} s before {moment.at_s:g} s misses {name!r} by up to "
                f"{off[worst]:.3g}, "
                f"more than the {allowed:.3g} that [twin] states of its errors"
            )
            unseen = _unseen(bench, window, moment.row + 1 - rows)
            if unseen:
                what += f"; it begins with what no instrument shows: {unseen}"
            found = of_model(bench, "following", "replay_inputs", what, _STANDS if unseen else _FOLLOW)
            line = written(plant.files, unseen.split("'")[1:2])
            yield found if line is None else replace(found, where=line)


def _unseen(bench: Bench, window: Window, row: int) -> str:
    """States that are taken to be far from where they are when ``window`` begins, in tick ``row``; empty for none."""
    model, (_, states) = bench.plant.model, recorded(bench)
    if not isinstance(model, ComposedModel) or not 0 <= row < len(states):
        return ""
    taken, told = model.estimate(window.at(0)), list[str]()
    totals = {*bench.plant.delivered, *bench.plant.totals.values()}
    for name in model.flowsheet.states:
        column = model.states.index(name)
        size = max(float(np.ptp(states[:, column])), float(np.abs(states[:, column]).max()))
        if name not in totals and abs(taken[column] - states[row, column]) > FAR * size:
            unit = model.flowsheet.states[name].unit
            was, made = amount(states[row, column], unit), amount(taken[column], unit)
            told.append(f"{name!r} is {was} and is taken to be {made}")
    return ", ".join(told)


_STANDS: Final = (
    "say in the flowsheet where such a state stands in operation: FLOWSHEET.rests(STATE) where it follows the rest of "
    "the plant, usual= in FLOWSHEET.state(...) or Vessel.holds(...) where it does not, or give it an instrument"
)
_FOLLOW: Final = (
    "let estimate and replay_inputs follow what was recorded; where levels or temperatures move all the time, as in a "
    "batch, begin it with one reading (settle_rows = 1 in [twin]); of a flowsheet, whose replay is generated, state "
    "the error that its reading may have there (engineering/instruments.csv, or errors in [twin])"
)


def _resumed(bench: Bench, moment: Moment) -> Iterator[Finding]:
    """From a state that knows the last readings alone, the next commands are those of the plant that went on."""
    d = bench.plant.description
    driven = {loop.manipulated_variable: f"loop {loop.name!r} commands" for loop in reversed(d.loops)}
    # The outer loop of a cascade is left out: what it sets shows in the command of the inner one.
    yield from _jumps(
        bench, moment, {n: w for n, w in driven.items() if d.variables[n] not in bench.plant.model.inputs}
    )


def _resumed_further(bench: Bench) -> Iterator[Finding]:
    """The same of each actuator that no loop is known by, while it moves in the quiet course.

    Of a split range one part rests while another moves, and control that resumes from the one alone is wrong then.
    """
    d, model, (whole, states) = bench.plant.description, bench.plant.model, recorded(bench)
    known = {loop.manipulated_variable for loop in d.loops}
    for signal in d.signals:
        name, tag = signal.variable, signal.tag
        if signal.relation is not Relation.DRIVES or name in model.inputs or tag.name in known:
            continue
        share = (whole.readings[name][: len(states)] - tag.range.low) / tag.range.span
        moves = (share > MOVES) & (share < 1.0 - MOVES)
        rows = 1 + np.flatnonzero(moves[1:])
        if rows.size:
            row = int(rows[len(rows) // 2])
            yield from _jumps(bench, Moment(row, _part(whole, 0, row + 1), states[row]), {tag.name: "control commands"})


def _jumps(bench: Bench, moment: Moment, driven: Mapping[str, str]) -> Iterator[Finding]:
    """Which of ``driven``, tag -> who commands it, jump where control goes on at ``moment``."""
    model, d = bench.plant.model, bench.plant.description
    window = moment.window
    inputs = window.inputs[-1:]
    ahead = Window(window.end_s, {}, inputs)
    went = _next(bench, ahead, moment.state, window.end_s)
    resumed = _next(bench, ahead, _controlled(bench, moment, model.estimate(window.at(-1))), window.end_s)
    for tag, who in ((d.tag(name), who) for name, who in driven.items()):
        now, was = resumed[d.variables[tag.name]], went[d.variables[tag.name]]
        if not abs(now - was) <= BUMP * tag.range.span:
            made, meant = amount(now, tag.unit), amount(was, tag.unit)
            what = f"where control goes on at {moment.at_s:g} s, {who} {tag.name!r} = {made} instead of {meant}"
            yield of_model(
                bench, "following", "resume", what, "set the controller's memory so that its output goes on as it was"
            )


def _next(bench: Bench, ahead: Window, state: Vec, start_s: float) -> Mapping[str, float]:
    """Readings one tick later."""
    model = bench.plant.model
    after = simulate(model.kernel, batch_of(bench, ahead, state, start_s)).state[0]
    return model.readings(after, ahead.inputs[0])
