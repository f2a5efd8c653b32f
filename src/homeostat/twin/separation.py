"""Separation: how far readings that are still to come would tell hypotheses apart, before anything is moved.

Each hypothesis is one member that agrees with the present. What two of them already say differently of the next tick
is what constant errors of instruments and model explain; only how that changes counts. With d_a and d_b for how far
hypotheses a and b depart from a plant in which nothing is wrong, in standard deviations of what a reading of that
moment may be wrong by, and b free to be larger or smaller than it was thought,

    nats(a, b) = min over s of (|d_a - s d_b|^2 + ((s - 1) / SIZE)^2) / (2 TEMPER)

is the evidence that would be expected for a against b if a is true. Where two differ by less than the model is wrong
by, only the share of it counts that isolation would count, too (:mod:`homeostat.twin.isolation.alike`). Source: the
auxiliary signal that makes the outputs of two models most different (Campbell and Nikoukhah, Auxiliary Signal Design
for Failure Detection, 2004).

Hand check: d_a = (3, 0, 0, 0), d_b = 0 gives 9 / (2 TEMPER) = 1.5 nats at TEMPER = 3.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from homeostat.process.model import ProcessModel
from homeostat.process.sequence import InputSequence, run_sequences
from homeostat.process.types import Cube, Flags, Table, Vec
from homeostat.twin.forecast import Ensemble, copies
from homeostat.twin.isolation.alike import TOLD_APART
from homeostat.twin.isolation.evidence import TEMPER, Accuracy

SIZE = 0.3
"""Share by which a hypothesis may be larger or smaller than it is thought to be, one standard deviation [1]."""


def separation(
    model: ProcessModel,
    ensemble: Ensemble,
    sequences: Sequence[InputSequence],
    present: Vec,
    ticks: int,
    accuracy: Accuracy,
    per_sample: Mapping[str, int] = MappingProxyType({}),
) -> tuple[Cube, Flags]:
    """Expected evidence for each hypothesis against each other one under each of K ``sequences`` [nats].

    ``ensemble`` has one member for each of H hypotheses and, last, one in which nothing is wrong; the first of the
    ``sequences`` is what follows anyway. All are carried out in one call of the engine, without noise. Returns nats of
    shape (K, H, H), the true hypothesis first; and whether no member takes a later step within ``ticks`` by which
    anything else is commanded, shape (K,). ``per_sample``: variable -> readings that show one sample of an analyser,
    which count as one.
    """
    count, members = len(sequences), len(ensemble.states)
    quiet = np.zeros(count * members)
    batch = replace(copies(model, ensemble, count, ticks, 1, sensor_noise=False), process_noise=quiet)
    run = run_sequences(model, batch, sequences, present)
    shown = [model.shown[v] for v in accuracy.errors]
    readings = run.record[:, :, shown].reshape(count, members, ticks, len(shown))
    moved, effect = readings - readings[0, :, :1], readings[:, :-1] - readings[:, -1:]
    noise = np.array([noise for noise, _ in accuracy.errors.values()])
    spread = np.hypot(noise, accuracy.gain * np.abs(moved[:, -1:]))
    spread *= np.sqrt([per_sample.get(v, 1) for v in accuracy.errors])
    departed = ((moved[:, :-1] - moved[:, -1:]) / spread).reshape(count, members - 1, -1)
    wrong = TOLD_APART * accuracy.gain * np.linalg.norm((effect / spread).reshape(count, members - 1, -1), axis=2)
    latest = np.maximum(run.step.max(axis=1), run.reached).reshape(count, -1).max(axis=1)
    still = latest <= [_calm(sequence, present) for sequence in sequences]
    return np.stack([_expected(d, w) for d, w in zip(departed, wrong, strict=True)]), still


def _calm(sequence: InputSequence, present: Vec) -> int:
    """How many of its later steps command nothing but what stands after the first, before one that does."""
    stands = np.where(np.isnan(sequence.targets[0]), present, sequence.targets[0])
    same = [bool(np.all(np.isnan(own) | (own == stands))) for own in sequence.targets[1:]]
    return same.index(False) if False in same else len(same)


def _expected(departed: Table, wrong: Vec) -> Table:
    """Expected evidence [nats], shape (H, H), of departures of shape (H, readings).

    ``wrong``: how different readings must be to be told apart in full from those of each hypothesis, shape (H,).
    """
    product = departed @ departed.T
    own = np.diag(product)
    between = own[:, None] + own[None, :] - 2.0 * product
    # s = 1 + x: |(d_a - d_b) - x d_b|^2 + (x / SIZE)^2 is least at x = (d_a - d_b) d_b / (|d_b|^2 + SIZE^-2).
    explained = (product - own[None, :]) ** 2 / (own[None, :] + SIZE**-2)
    counted = np.minimum(between / np.maximum(wrong[:, None], 1e-12) ** 2, 1.0)
    return np.asarray(counted * np.maximum(between - explained, 0.0) / (2.0 * TEMPER))
