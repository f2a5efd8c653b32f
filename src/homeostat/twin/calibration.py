"""Calibration: what a healthy stretch of operation says about the plant's parameters.

Linear Bayesian update: the model's response to each uncertain parameter is found by one finite difference per
parameter, all in one call of the engine; prior and measurement errors are normal (Kalman, 1960).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.parameter import ModelParameter
from homeostat.process.model import ProcessModel, column
from homeostat.process.types import Table, Vec
from homeostat.twin.carried import Carried, FaultSet, joined
from homeostat.twin.history import Window
from homeostat.twin.replay import Replay, replay

BLOCK = 60
"""Readings are compared as means over blocks of so many."""


@dataclass(frozen=True, slots=True)
class Usual:
    """Where the plant stood while its parameters were learned."""

    inputs: Vec
    """Mean inputs of the replay, shape (inputs,)."""
    readings: Mapping[str, float]
    """Variable -> its mean reading, in its unit."""


@dataclass(frozen=True, slots=True)
class GoesWith:
    """How parameters go with the size of a fault: what one of them explains the other need not."""

    fault: str
    """Name of the fault."""
    size: float
    """Its size for which the expected values are, in the fault's unit."""
    per_unit: Vec
    """Change of the expected values per unit of size, shape (parameters,)."""

    def change(self, faults: Iterable[FaultState]) -> Vec:
        """Change of the expected values where ``faults`` are present; nothing where the fault is none of them."""
        off = sum(fault.severity - self.size for fault in faults if fault.fault == self.fault)
        return off * self.per_unit


@dataclass(frozen=True, slots=True)
class Present:
    """Faults that are assumed to be present, as they are and as the engine takes them."""

    faults: FaultSet
    carried: Carried


@dataclass(frozen=True, slots=True)
class Posterior:
    """What is known of the parameters: a normal distribution."""

    mean: Vec
    """Expected values, shape (parameters,)."""
    root: Table
    """Square root of the covariance, shape (parameters, k): mean + root z with z standard normal is a draw."""
    usual: Usual | None = None
    """Where this was learned; None where nothing was."""
    goes_with: GoesWith | None = None
    """What the expected values depend on; None where it is nothing."""

    def change(self, faults: Iterable[FaultState]) -> Vec | float:
        """By how much the expected values are others where ``faults`` are present, shape (parameters,)."""
        return 0.0 if self.goes_with is None else self.goes_with.change(faults)

    def draws(self, count: int, generator: np.random.Generator) -> Table:
        """``count`` parameter sets, shape (count, parameters); the first is the mean."""
        z = generator.standard_normal((count, self.root.shape[1]))
        z[0] = 0.0
        return np.asarray(self.mean + z @ self.root.T)


def prior(model: ProcessModel, parameters: tuple[ModelParameter, ...]) -> Posterior:
    """What the engineering tables say."""
    by_symbol = {p.symbol: p for p in parameters}
    mean = np.array([by_symbol[s].value for s in model.parameters])
    sd = np.array([by_symbol[s].sd for s in model.parameters])
    return Posterior(mean, np.diag(sd)[:, sd > 0])


def calibrate(
    model: ProcessModel,
    window: Window,
    posterior: Posterior,
    present: Sequence[Present],
    errors: Mapping[str, tuple[float, float]],
    initial: Mapping[str, float],
) -> Posterior:
    """``posterior`` after ``window``, in which nothing but what is ``present`` was wrong.

    Args:
        posterior: what was known before; it depends on the size of no fault.
        present: what was present; then, where the size of that one fault is not known exactly, the same with the size
            off by a standard deviation.
        errors: variable -> (noise per reading, model error), standard deviations in the variable's unit.
        initial: state -> standard deviation of what smoothing may have got wrong at the window's start.
    """
    variables = tuple(errors)
    count = posterior.root.shape[1]
    offsets = np.zeros((1 + count + len(initial) + len(present) - 1, len(model.states)))
    for k, (state, sd) in enumerate(initial.items()):
        offsets[1 + count + k, column(model.states, state)] = sd
    same = np.tile(posterior.mean, (len(initial) + len(present) - 1, 1))
    sets = np.vstack([posterior.mean, posterior.mean + posterior.root.T, same])
    members = [0] * (1 + count + len(initial)) + list(range(1, len(present)))
    run = replay(model, window, sets, joined([present[m].carried for m in members]), variables, offsets)
    response, surprise = _compared(run, window, errors)
    # Posterior of the standard-normal coefficients z: precision I + H'H.
    precision = np.eye(response.shape[1]) + response.T @ response
    z, covariance = np.linalg.solve(precision, response.T @ surprise), np.linalg.inv(precision)
    goes_with = None
    own, others = slice(count), slice(count + len(initial), None)
    if len(present) > 1:  # given the size: what is learned of the parameters is for each size what it leaves to them
        gain = covariance[own, others] @ np.linalg.inv(covariance[others, others])
        z[own] -= gain @ z[others]
        covariance[own, own] -= gain @ covariance[others, own]
        goes_with = _goes_with(present, posterior.root @ gain[:, 0])
    root = posterior.root @ np.linalg.cholesky(covariance[own, own] + 1e-12 * np.eye(count))
    inputs = model.replay_inputs(window.readings, window.inputs).mean(axis=0)
    usual = Usual(inputs, {v: float(window.readings[v].mean()) for v in variables})
    return Posterior(posterior.mean + posterior.root @ z[own], root, usual, goes_with)


def _goes_with(present: Sequence[Present], change: Vec) -> GoesWith:
    """How parameters go with the size, that change by ``change`` where it is off."""
    (fault,), (other,) = present[0].faults, present[1].faults
    return GoesWith(fault.fault, fault.severity, change / (other.severity - fault.severity))


def _compared(run: Replay, window: Window, errors: Mapping[str, tuple[float, float]]) -> tuple[Table, Vec]:
    """Response of what is read to each member but the first, and what surprises the first, in standard deviations."""
    blocks = (window.length - 1) // BLOCK
    rows = blocks * BLOCK

    def in_blocks(values: Table) -> Table:
        return np.asarray(values[:, :rows].reshape(values.shape[0], blocks, BLOCK).mean(axis=2))

    predicted = np.concatenate([in_blocks(run.predicted[:, :, j]) for j in range(len(errors))], axis=1)
    seen = np.concatenate([in_blocks(window.readings[v][None, 1:])[0] for v in errors])
    samples = {v: max(BLOCK / window.per_sample.get(v, 1), 1.0) for v in errors}  # those of an analyser are fewer
    spread = np.concatenate([np.full(blocks, np.hypot(n / np.sqrt(samples[v]), e)) for v, (n, e) in errors.items()])
    return (predicted[1:] - predicted[0]).T / spread[:, None], (seen - predicted[0]) / spread
