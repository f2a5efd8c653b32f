"""What readings and controllers say by themselves, before the twin is asked what explains them.

A model explains a stuck thermometer as fouling and a wrong gain as a lag, because neither is among its faults. Both
show without a list: an instrument with noise never repeats itself, its scatter is known, a controller obeys its law.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from homeostat.domain.plant.description import ControlLoop, PlantDescription, Relation, Signal
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.plant.tag import Tag
from homeostat.process.batch import Batch, ProcessError, simulate
from homeostat.process.model import ProcessModel
from homeostat.process.types import Cube, Flags, Indices, Table, Vec
from homeostat.twin.calibration import prior
from homeostat.twin.history import Window
from homeostat.twin.isolation.scatter import against_usual
from homeostat.twin.isolation.setpoints import as_followed, followed

EQUAL: Final = 4
"""This many equal readings in a row are no flat line yet."""
NOISE_RATIO: Final = 2.5
"""Scatter against what is usual from which an instrument is noisy [1]."""
LAW: Final = 5e-5
"""Departure from its law that a controller may have, as a share of its output's range [1]; its resolution is added."""
LOOKED_AT: Final = 60
"""How many readings of the window are present; of a window shorter than twice that, half."""
SAMPLES: Final = 20
"""Fewest readings that an instrument's scatter or a controller is judged by."""

_CHANCE = 1e-9  # of a flat line by luck: thirty instruments have 2.6 million readings a day
_COARSE = 0.5  # share of equal neighbours from which an instrument's resolution hides its noise
_REST = 0.02  # share of the span below which what is measured may be at rest, and so may the reading
_NEAR = 0.1  # share of the span that a reading may be from the model's where noise is relative
_PROCESS = 2.0  # mean square scatter against that of the stated noise from which it is the process's
_MEMBERS = 8  # the model without noise, and how often it is asked for noise
_FAR = 0.3  # departure as a share of the range that no saturation explains
_IDLE = 0.25  # share of ticks without a move from which a controller works more slowly than it is looked at


class What(StrEnum):
    """What is wrong with an instrument or a controller."""

    FROZEN = "frozen"
    """The instrument repeats itself although it has noise."""
    NOISY = "noisy"
    """It scatters more than it did."""
    LAW = "law"
    """The controller's output is not what its gains give."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong without any twin having been asked."""

    tag: str
    """The reading, or the output of the controller."""
    what: What
    """What is wrong."""
    since_s: float
    """Process time from which it shows in the window [s]."""
    value: float
    """Equal readings or seconds of them, ratio of scatters, or departure of the output."""
    limit: float
    """The most that is usual, in the same unit."""
    unit: str
    """Unit of both."""
    text: str
    """In an operator's words."""


def prechecks(
    window: Window, description: PlantDescription, model: ProcessModel, healthy_until_s: float = math.inf
) -> tuple[Finding, ...]:
    """Everything that is wrong with instruments and controllers at the end of ``window``, by its own evidence.

    ``healthy_until_s`` [s of process time]: before it nothing was noticed; what is usual is learned from there.
    ``window`` has to reach back before whatever is wrong: of an instrument that is stuck throughout, nothing is said.
    No false finding in 336 runs of two plants, healthy and with every fault of their tables, as modelled and not,
    with a look of 400 s every 5 to 10 s: with 95 % confidence, fewer than one run in 100 has any. That was before
    outputs at a limit were judged.
    """
    noisy = noise_ratios(window, description, model, healthy_until_s)
    return (*flat_lines(window, description), *noisy, *broken_laws(window, description, model))


def shared(findings: Sequence[Finding]) -> bool:
    """Whether two instruments or more are noisy: that has one cause outside of them, and none of them is at fault."""
    return sum(f.what is What.NOISY for f in findings) > 1


def flat_lines(window: Window, description: PlantDescription) -> tuple[Finding, ...]:
    """Instruments that have noise and repeat themselves to the last digit up to the end of ``window``.

    How often neighbours are equal without that is counted in the readings before, so a coarse instrument may repeat
    itself for longer; where the guard has called it frozen and its readings are held, that is taken for it. Not judged
    are other unknown readings, and those at rest or at an end of their range.
    """
    found: list[Finding] = []
    for signal in _instruments(window, description):
        if signal.variable in window.frozen_s:
            found += _known_to_be_frozen(window, signal, description)
            continue
        known = ~_held(window, signal)
        rows, values = np.flatnonzero(known), window.readings[signal.variable][known]
        if not known[-1] or not np.isfinite(values).all():
            continue
        changes = np.flatnonzero(np.diff(values))
        first = int(changes[-1]) + 1 if changes.size else 0
        count, moving = len(values) - first, ~_at_rest(values, first, signal, description)
        if count <= EQUAL or not moving[-1]:
            continue
        if first == 0:
            found += _throughout(window, signal, description)
            continue
        if signal.tag.name in description.sampled:
            found += _samples(window, signal, description, rows[changes + 1])
            continue
        share = _share_equal(values[:first], moving[:first], description.qualities[signal.tag.name])
        if share > _COARSE or share ** (count - 1) > _CHANCE:
            continue
        limit = float(max(EQUAL, 1 + math.floor(math.log(_CHANCE) / math.log(share))))
        text = (
            f"{signal.tag.name} has shown exactly {values[-1]:g} {signal.tag.unit} for {count} readings although it "
            f"has noise: {signal.component} is stuck"
        )
        since_s = window.at_s(float(rows[first]))
        found.append(Finding(signal.tag.name, What.FROZEN, since_s, float(count), limit, "readings", text))
    return tuple(found)


def _share_equal(values: Vec, moving: Flags, rule: QualityRule) -> float:
    """Share of neighbours in ``values``, shape (n,), that are equal, and not by luck more [1]; of ``moving`` ones only.

    An instrument that was stuck before is no coarse one: where the tables say how long it may repeat itself, it counts
    how often a change is followed by none, which a stretch that it was stuck for adds one to and no more.
    """
    equal, judged = np.diff(values) == 0.0, moving[1:] & moving[:-1]
    share = _not_by_luck(equal[judged])
    if rule.frozen_s is None or not rule.noise:
        return share
    return min(share, _not_by_luck(equal[1:][~equal[:-1] & judged[1:] & judged[:-1]]))


def _not_by_luck(equal: Flags) -> float:
    often = float(np.count_nonzero(equal)) + 1.0
    return (often + 2.0 * math.sqrt(often)) / (equal.size + 2.0)


def _throughout(window: Window, signal: Signal, description: PlantDescription) -> tuple[Finding, ...]:
    """That an instrument is stuck that repeats itself in all of ``window``, and did not before; the tables say for how
    long it may."""
    rule, since_s = description.qualities[signal.tag.name], window.still_s.get(signal.variable)
    if since_s is None or not rule.noise or rule.frozen_s is None or window.end_s - since_s < rule.frozen_s:
        return ()
    text = f"{signal.tag.name} repeats itself since {since_s:.0f} s although it has noise: {signal.component} is stuck"
    return (Finding(signal.tag.name, What.FROZEN, since_s, window.end_s - since_s, rule.frozen_s, "s", text),)


def _samples(window: Window, signal: Signal, description: PlantDescription, changed: Indices) -> tuple[Finding, ...]:
    """That an analyser is stuck whose samples are the same for longer than the tables let them, and mostly were not
    before; ``changed``: the rows of ``window`` in which it showed something else than before, the last of them last."""
    rule, since_s = description.qualities[signal.tag.name], window.at_s(float(changed[-1]))
    passed_s, before = window.end_s - since_s, float(changed[-1]) / description.sampled[signal.tag.name]
    if not rule.noise or rule.frozen_s is None or passed_s < rule.frozen_s or len(changed) <= (1.0 - _COARSE) * before:
        return ()
    text = (
        f"{signal.tag.name} shows the same sample since {since_s:.0f} s although it has noise: {signal.component} is "
        "stuck"
    )
    return (Finding(signal.tag.name, What.FROZEN, since_s, passed_s, rule.frozen_s, "s", text),)


def _known_to_be_frozen(window: Window, signal: Signal, description: PlantDescription) -> tuple[Finding, ...]:
    """That an instrument is stuck whose readings were called frozen, and are held; none where it may be at rest."""
    since_s, rule = window.frozen_s[signal.variable], description.qualities[signal.tag.name]
    first = window.row(since_s)
    if _at_rest(window.readings[signal.variable], first, signal, description)[-1]:
        return ()
    count, limit = window.end_s - since_s + window.tick_s, rule.frozen_s or math.inf
    text = f"{signal.tag.name} repeats itself since {since_s:.0f} s although it has noise: {signal.component} is stuck"
    return (Finding(signal.tag.name, What.FROZEN, since_s, count, limit, "s", text),)


def _instruments(window: Window, description: PlantDescription) -> list[Signal]:
    measured = (s for s in description.signals if s.relation is Relation.MEASURES and s.variable in window.readings)
    return [s for s in measured if s.tag.name in description.qualities]


def _held(window: Window, signal: Signal) -> Flags:
    return window.held.get(signal.variable, np.zeros(window.length, dtype=bool))


def _at_rest(values: Vec, first: int, signal: Signal, description: PlantDescription) -> Flags:
    """Where an instrument may repeat itself without being stuck, shape (n,): at an end of its range, and near zero.

    Near zero it may not where the tables state a noise for it, also at rest, that it was fine enough to show before
    row ``first``.
    """
    tag, rule, steps = signal.tag, description.qualities[signal.tag.name], np.abs(np.diff(values[:first]))
    noise = 0.0 if rule.frozen_s is None else rule.noise or 0.0
    near = 0.0 if np.min(steps, where=steps > 0.0, initial=np.inf) <= noise else _REST * tag.range.span
    resting = (values <= tag.range.low) | (values >= tag.range.high) | (np.abs(values) < near)
    return np.asarray(resting)


def noise_ratios(
    window: Window, description: PlantDescription, model: ProcessModel, healthy_until_s: float = math.inf
) -> tuple[Finding, ...]:
    """Instruments that scatter more at the end of ``window`` than they usually do.

    Usual is what the model's instruments scatter in the same ticks under the same commands, times how much more or
    less than the model's this one did while healthy. Not judged are instruments that show more of the process's
    scatter than of their own, analysers, which show each sample for some ticks, and, where noise is a share of the
    reading, readings at rest or far from the model's.
    """
    modelled = _as_modelled(window, description, model)
    if modelled is None:
        return ()
    begin = window.length - min(LOOKED_AT, window.length // 2)
    middle = np.arange(1, window.length - 1)
    parts = middle < min((healthy_until_s - window.start_s) / window.tick_s, begin), middle > begin
    found = []
    for signal in _instruments(window, description):
        if signal.variable not in model.shown or signal.tag.name in description.sampled:
            continue
        shown = modelled[:, :, list(model.shown).index(signal.variable)]
        ratio = _noise_ratio(window, description, signal, shown, parts)
        if ratio > NOISE_RATIO:
            text = (
                f"{signal.tag.name} scatters {ratio:.1f} times as much as usual (limit {NOISE_RATIO:g}): noise of "
                f"{signal.component}, unless others scatter as well"
            )
            since_s = window.at_s(begin)
            found.append(Finding(signal.tag.name, What.NOISY, since_s, ratio, NOISE_RATIO, "1", text))
    return tuple(found)


def _noise_ratio(
    window: Window, description: PlantDescription, signal: Signal, shown: Table, parts: tuple[Flags, Flags]
) -> float:
    """Scatter in the second of ``parts``, of second differences, against what is usual; 0 where it is not judged.

    ``shown``: what the model shows, shape (_MEMBERS, times). Second differences see neither levels nor ramps.
    """
    read, span, rule = window.readings[signal.variable], signal.tag.range.span, description.qualities[signal.tag.name]
    known, floor = ~_held(window, signal) & np.isfinite(read), _REST * span
    own, alike = np.diff(read[None], 2), np.diff(shown, 2)
    if _is_relative(signal, description):
        own, alike = (d / np.maximum(np.abs(v[:, 1:-1]), floor) for d, v in ((own, read[None]), (alike, shown)))
        known = known & (np.abs(read - shown[0]) < _NEAR * span) & (np.minimum(read, shown[0]) > floor)
    elif np.mean((alike[1:] - alike[:1]) ** 2) > _PROCESS * 6.0 * (rule.noise or 0.0) ** 2:
        return 0.0
    good = known[2:] & known[1:-1] & known[:-2]
    healthy, present = (part & good for part in parts)
    if np.count_nonzero(present) < SAMPLES:
        return 0.0
    return against_usual(own, alike, healthy, present)


def _is_relative(signal: Signal, description: PlantDescription) -> bool:
    """Whether the tables state an instrument's errors as a share of its reading."""
    own = (p.unit for p in description.parameters if p.component == signal.component)
    return signal.tag.unit != "1" and "1" in own


def _as_modelled(window: Window, description: PlantDescription, model: ProcessModel) -> Cube | None:
    """What the model shows under the commands of ``window``, shape (_MEMBERS, times, shown); the first without noise.

    None where the readings at its start, or what follows from them, are no state of the model.
    """
    if window.length < 2 * SAMPLES:
        return None
    inputs, followed = window.inputs.copy(), model.replay_inputs(window.readings, window.inputs)
    for manual in set(description.automatic) & set(model.inputs):
        inputs[:, model.inputs.index(manual)] = followed[:, model.inputs.index(manual)]
    states, noise = model.estimate(window.at(0))[None].repeat(_MEMBERS, axis=0), np.minimum(np.arange(_MEMBERS), 1.0)
    try:
        return _simulated(model, states, prior(model, description.parameters).mean[None], inputs[None], noise)
    except ProcessError:
        return None


def _simulated(model: ProcessModel, states: Table, parameters: Table, inputs: Cube, noise: Vec) -> Cube:
    """What each of ``states`` shows under ``inputs``, one schedule or one for each; shape (states, times, shown)."""
    members = len(states)
    none = np.zeros((members, len(model.faults)))
    batch = Batch(
        state=states, parameters=parameters.repeat(members, axis=0), severity=none, onset_s=none + np.inf,
        inputs=inputs, input_of=np.arange(members) % len(inputs), start_s=0.0, steps=inputs.shape[1], stride=1,
        record=tuple(model.shown.values()), seeds=np.arange(members), process_noise=noise, sensor_noise=noise,
    )  # fmt: skip
    return simulate(model.kernel, batch, model.states.__getitem__).record


def broken_laws(window: Window, description: PlantDescription, model: ProcessModel) -> tuple[Finding, ...]:
    """Controllers whose output is not what the tables' gains make of the readings and of their output before.

    The model's own controllers go on by one tick from each of the last readings, towards the setpoints that those of
    the plant followed: the inner one of a cascade answers for its own law, not for what it is sent. Not judged are
    ticks with an output in manual, with a commanded setpoint that moves or one that nobody knows, and with unknown
    readings; nor are controllers that move now and then only, because they work more slowly or more coarsely than
    they are looked at. Of an output at a limit nobody knows what was integrated beyond it, so that it is judged by
    departures alone that are far larger than that.
    """
    rows = _unbroken(window, description, model)
    if not description.loops or len(rows) < SAMPLES:
        return ()
    states, parameters = np.empty((len(rows), len(model.states))), prior(model, description.parameters).mean[None]
    for state, k in zip(states, rows, strict=True):
        state[:] = model.estimate(window.at(k - 1))
        model.resume(state[None], {v: r[k - 2 : k] for v, r in window.readings.items()}, parameters.copy())
    inputs = as_followed(window, description, model, rows)
    try:
        shown = _simulated(model, states, parameters, inputs[:, None], np.zeros(len(rows)))[:, 0]
    except ProcessError:  # some of the last readings are no state of the model
        return ()
    lawful = dict(zip(model.shown, shown.T, strict=True))
    found = (_broken(window, description, loop, rows, lawful) for loop in description.loops)
    return tuple(f for f in found if f is not None)


def _unbroken(window: Window, description: PlantDescription, model: ProcessModel) -> Indices:
    """Rows among the last that can be judged: their own readings and those of the two rows before are known."""
    clean = np.ones(window.length, dtype=bool)
    inner = {description.variables[loop.setpoint] for loop in description.loops if loop.setpoint in description.moved}
    for variable in window.readings.keys() & {*model.shown, *model.inputs}:
        if variable in window.held:
            clean &= ~window.held[variable]
        if variable not in description.automatic and variable not in inner:
            clean &= np.isfinite(window.readings[variable])
    rows = np.arange(max(2, window.length - LOOKED_AT), window.length)
    return np.asarray(rows[clean[rows] & clean[rows - 1] & clean[rows - 2]])


def _broken(
    window: Window, description: PlantDescription, loop: ControlLoop, rows: Indices, lawful: Mapping[str, Vec]
) -> Finding | None:
    """``lawful``: variable -> what it would be in ``rows``, shape (rows,)."""
    tag, variables = description.tag(loop.manipulated_variable), description.variables
    variable = variables[tag.name]
    if variable not in lawful:  # the outer loop of a cascade: what it moves shows in the inner one
        return None
    output, known = window.readings[variable], np.isfinite(followed(window, description, loop))
    commanded = window.readings.get(variables[loop.setpoint], np.full(window.length, np.nan))
    inside = (output > tag.range.low) & (output < tag.range.high)
    automatic = np.ones(window.length, dtype=bool)
    for manual, command in description.automatic.items():
        if command == variable:
            automatic &= np.isnan(window.readings[manual])
    still = (commanded[1:] == commanded[:-1]) | (np.isnan(commanded[1:]) & np.isnan(commanded[:-1]))
    free = still[rows - 1] & still[rows - 2] & known[rows] & known[rows - 1]
    free &= automatic[rows] & automatic[rows - 1] & automatic[rows - 2]
    judged, every = free & inside[rows] & inside[rows - 1] & inside[rows - 2], np.abs(output[rows] - lawful[variable])
    if np.count_nonzero(judged) < SAMPLES:
        far = free & (every > _FAR * tag.range.span)
        enough = np.count_nonzero(far) >= max(SAMPLES, int(np.count_nonzero(free)) // 2)
        return _unlawful(window, loop, tag, rows[far], every[far], _FAR * tag.range.span) if enough else None
    departures, moves = every[judged], np.abs(np.diff(output))
    idle = float(np.mean(moves[rows - 1][judged] == 0.0))
    resolution = float(np.min(moves, where=moves > 1e-12, initial=np.inf)) if idle < 1.0 else 0.0
    limit, value = LAW * tag.range.span + resolution, float(np.median(departures))
    if value <= limit or _IDLE < idle < 1.0:
        return None
    return _unlawful(window, loop, tag, rows[judged], departures, limit)


def _unlawful(window: Window, loop: ControlLoop, tag: Tag, rows: Indices, departures: Vec, limit: float) -> Finding:
    """A controller whose output departs from its law by ``departures`` in ``rows``."""
    value, since_s = float(np.median(departures)), window.at_s(float(rows[departures > limit][0]))
    text = (
        f"{loop.label}: {tag.name} departs from what {loop.controller}'s gains give by {value:.2g} a tick (tolerance "
        f"{limit:.2g}): the controller is not tuned as the tables say"
    )
    return Finding(tag.name, What.LAW, since_s, value, limit, tag.unit, text)
