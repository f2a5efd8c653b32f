"""Calibration: what a healthy stretch of operation says about the plant's parameters.

Linear Bayesian update: the model's response to each uncertain parameter is found by one finite difference per
parameter, all in one call of the engine; prior and measurement errors are normal (Kalman, 1960).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.domain.plant.parameter import ModelParameter
from homeostat.process.model import ProcessModel, column
from homeostat.process.types import Table, Vec
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import replay

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
class Posterior:
    """What is known of the parameters: a normal distribution."""

    mean: Vec
    """Expected values, shape (parameters,)."""
    root: Table
    """Square root of the covariance, shape (parameters, k): mean + root z with z standard normal is a draw."""
    usual: Usual | None = None
    """Where this was learned; None where nothing was."""

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
    present: Carried,
    errors: Mapping[str, tuple[float, float]],
    initial: Mapping[str, float],
) -> Posterior:
    """``posterior`` after ``window``, in which nothing but what is ``present`` was wrong.

    Args:
        present: one fault set.
        errors: variable -> (noise per reading, model error), standard deviations in the variable's unit.
        initial: state -> standard deviation of what smoothing may have got wrong at the window's start.
    """
    variables = tuple(errors)
    count = posterior.root.shape[1]
    offsets = np.zeros((1 + count + len(initial), len(model.states)))
    for k, (state, sd) in enumerate(initial.items()):
        offsets[1 + count + k, column(model.states, state)] = sd
    sets = np.vstack([posterior.mean, posterior.mean + posterior.root.T, np.tile(posterior.mean, (len(initial), 1))])
    run = replay(model, window, sets, present.repeated(len(sets)), variables, offsets)
    blocks = (window.length - 1) // BLOCK
    rows = blocks * BLOCK

    def in_blocks(values: Table) -> Table:
        return np.asarray(values[:, :rows].reshape(values.shape[0], blocks, BLOCK).mean(axis=2))

    predicted = np.concatenate([in_blocks(run.predicted[:, :, j]) for j in range(len(variables))], axis=1)
    seen = np.concatenate([in_blocks(window.readings[v][None, 1:])[0] for v in variables])
    spread = np.concatenate([np.full(blocks, np.hypot(n / np.sqrt(BLOCK), e)) for n, e in errors.values()])
    response = (predicted[1:] - predicted[0]).T / spread[:, None]
    surprise = (seen - predicted[0]) / spread
    # Posterior of the standard-normal coefficients z: precision I + H'H.
    precision = np.eye(response.shape[1]) + response.T @ response
    z = np.linalg.solve(precision, response.T @ surprise)[:count]
    covariance = np.linalg.inv(precision)[:count, :count]
    root = posterior.root @ np.linalg.cholesky(covariance + 1e-12 * np.eye(count))
    inputs = model.replay_inputs(window.readings, window.inputs).mean(axis=0)
    usual = Usual(inputs, {v: float(window.readings[v].mean()) for v in variables})
    return Posterior(posterior.mean + posterior.root @ z, root, usual)
