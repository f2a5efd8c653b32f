"""Forecast: what a set of actions would do under the hypotheses, over the uncertainty of the parameters."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.diagnosis import Hypothesis
from homeostat.process.batch import Batch, simulate, tick_of
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves, move_all_parameters, moved_inputs
from homeostat.process.sequence import Guard, InputSequence, run_sequences
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.twin.carried import Carried, Carrier
from homeostat.twin.history import Window
from homeostat.twin.replay import correct, replay

LATEST = 15
"""Readings whose mean difference from the replay corrects the state."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Members that share the present moment: hypotheses times parameter draws, synchronised with the plant."""

    start_s: float
    """Process time of the present moment [s]."""
    states: Table
    """Present states, shape (members, states)."""
    parameters: Table
    """Parameters, shape (members, parameters)."""
    carried: Carried
    """What each member has that is wrong; parameters are moved by it already."""
    hypothesis: Indices
    """Which hypothesis each member follows, shape (members,)."""
    weights: Vec
    """Probability of each member, shape (members,)."""
    seeds: Indices
    """Noise seeds, shape (members,)."""


@dataclass(frozen=True, slots=True)
class Past:
    """What was read until now."""

    replayed: Window
    """What is replayed."""
    whole: Window
    """As far back as there is anything: what a controller remembers may be older than what the process does."""


def synchronise(
    model: ProcessModel,
    carrier: Carrier,
    past: Past,
    draws: Table,
    hypotheses: Sequence[Hypothesis],
    follows: Indices,
    variables: tuple[str, ...],
    noise: np.random.Generator,
) -> Ensemble:
    """Bring every member to the present and make it agree with the last readings.

    The members that follow one hypothesis share its probability.

    Args:
        draws: parameter set of each member, shape (members, parameters).
        follows: which hypothesis each member follows, shape (members,).
        variables: readings that the model is corrected by.
        noise: what each member's own noise seed is drawn from.
    """
    window = past.replayed
    sets = [hypotheses[h].faults for h in follows]
    parameters = draws.copy()
    carried = carrier.carry(sets, window)
    run = replay(model, window, parameters, carried, variables)
    states = run.state
    newest_onset = max((f.onset_s for h in hypotheses for f in h.faults), default=window.start_s)
    rows = int(np.clip((window.end_s - newest_onset) / tick_of(model.kernel) - 1, 3, LATEST))
    residuals = {
        v: np.mean(window.readings[v][-rows:] - run.predicted[:, -rows:, j], axis=1) for j, v in enumerate(variables)
    }
    correct(model, states, residuals, carried, window.end_s)
    carried = replace(carried, moves=move_all_parameters(parameters, carried.moves, window.end_s))
    model.resume(states, past.whole.readings, parameters)
    seeds = noise.integers(1, 2**62, size=len(sets), dtype=np.int64)
    weights = (np.array([h.probability for h in hypotheses]) / np.bincount(follows, minlength=len(hypotheses)).clip(1))[
        follows
    ]
    return Ensemble(window.end_s, states, parameters, carried, follows, weights, seeds)


@dataclass(frozen=True, slots=True)
class Forecast:
    """True values under every schedule: schedule-major members, shape (schedules * members, times) per variable."""

    values: Mapping[str, np.ndarray]
    """Variable -> true values, the present moment excluded."""
    dt_s: float
    """Sampling period [s]."""
    steps_left: tuple[int, ...] = ()
    """Steps that each member had not taken at the end; empty for schedules."""
    taken_s: Table | None = None
    """Process times at which each member took each later step, infinite where it did not, shape (members, steps) [s];
    None for schedules."""


def forecast(
    model: ProcessModel,
    ensemble: Ensemble,
    schedules: Cube,
    stride: int,
    sensor_noise: bool = True,
    refuse: bool = True,
) -> Forecast:
    """Roll every schedule (shape (K, steps, inputs)) out over every member of ``ensemble``.

    Every schedule sees the same disturbances (common random numbers), so that schedules can be compared. Where a member
    leaves the physical world, a ProcessError is raised, or, without ``refuse``, its values are NaN from then on.
    """
    count, steps = schedules.shape[0], schedules.shape[1]
    batch = copies(model, ensemble, count, steps, stride, sensor_noise)
    inputs, follows = _arriving(schedules, ensemble, tick_of(model.kernel))
    batch = replace(batch, inputs=inputs, input_of=follows)
    result = simulate(model.kernel, batch, lambda i: model.states[i], refuse)
    sampled = np.repeat(schedules[:, stride - 1 :: stride][:, : result.record.shape[1]], len(ensemble.states), axis=0)
    return Forecast(model.truth(result.record, sampled), stride * tick_of(model.kernel))


def after(ticks: int) -> Guard:
    """A guard of a first step that holds from so many ticks on, whatever is read; for one run of one sequence."""
    looks = itertools.count(1)

    def holds(shown: Mapping[str, Vec]) -> NDArray[np.bool_]:
        return np.full(len(next(iter(shown.values()))), next(looks) >= ticks)

    return holds


def follow(
    model: ProcessModel,
    ensemble: Ensemble,
    sequences: Sequence[InputSequence],
    present: Vec,
    steps: int,
    refuse: bool = True,
) -> Forecast:
    """Let every member of ``ensemble`` carry out every sequence from inputs ``present`` on, for ``steps`` ticks.

    With sensor noise, because what the instruments show decides when a step ends. ``refuse`` as in :func:`forecast`.
    """
    batch = copies(model, ensemble, len(sequences), steps, 1, sensor_noise=True)
    result = run_sequences(model, batch, sequences, present, refuse)
    waited_for = np.repeat([len(s.guards) for s in sequences], len(ensemble.states))
    left = tuple((waited_for - result.reached).tolist())
    most = max(len(s.guards) for s in sequences)
    taken = np.stack([ensemble.start_s + tick_of(model.kernel) * result.taken(k + 1) for k in range(most)], axis=1)
    return Forecast(model.truth(result.record, result.inputs), tick_of(model.kernel), left, taken)


def _arriving(schedules: Cube, ensemble: Ensemble, tick_s: float) -> tuple[Cube, Indices]:
    """What arrives of ``schedules``, as inputs of a batch, and which of them each of its members follows.

    Actuators need not stand as they are commanded; what is on automatic is left to its controller.
    """
    inputs, follows, before = [], [], 0
    for schedule in schedules:
        mine, which = moved_inputs(schedule, ensemble.carried.moves, ensemble.start_s, tick_s)
        inputs.append(mine)
        follows.append(before + which)
        before += len(mine)
    return np.concatenate(inputs), np.concatenate(follows)


def copies(model: ProcessModel, ensemble: Ensemble, count: int, steps: int, stride: int, sensor_noise: bool) -> Batch:
    """``count`` copies of the ensemble, one after the other, without inputs yet."""
    members = len(ensemble.states)

    def repeat(table: Table) -> Table:
        return np.ascontiguousarray(np.tile(table, (count, 1)))

    return Batch(
        state=repeat(ensemble.states),
        parameters=repeat(ensemble.parameters),
        severity=repeat(ensemble.carried.severity),
        onset_s=repeat(ensemble.carried.onset_s),
        inputs=np.empty((count, 0, len(model.inputs))),
        input_of=np.repeat(np.arange(count), members),
        start_s=ensemble.start_s,
        steps=steps,
        stride=stride,
        record=tuple(range(len(model.states))),
        seeds=np.tile(ensemble.seeds, count),
        process_noise=np.ones(count * members),
        sensor_noise=np.full(count * members, float(sensor_noise)),
        moves=Moves.of(ensemble.carried.moves * count),
    )
