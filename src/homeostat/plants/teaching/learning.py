"""Learning: a plant's reference values from fault-free runs of its model.

Every run has its own true parameters, so the reference knows how much healthy plants of one design differ. A plant that
is not well without a fault teaches nothing: it is refused with what is wrong.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.snapshot import Trajectory
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.equations import refuse_wrong_units
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines, write_baselines
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import ProcessError, tick_of
from homeostat.process.seeds import Stream, noise_seed

FIRST_SEED = 100_000
"""Seeds from here on are for learning; evaluation uses smaller ones."""
RUNS = 40
"""Fault-free runs that are learned from."""


def feature_values(plant: Plant, seed: int) -> NDArray[np.float64]:
    """Feature values of one fault-free run once it has settled, shape (times, features).

    Raises PlantError where the run does not start or settle, leaves the physical world, or violates a hard limit.
    """
    noise = noise_seed(seed, Stream.TRUTH_NOISE)
    configuration = PlantConfiguration(plant.true_parameters(seed), plant.start, (), plant.end_s, noise)
    process = TrueProcess(plant.model, plant.description, configuration)
    link = SimulatedLink(process, recipe=new_sequencer(plant).sample)
    filters = [FeatureFilter(f, tick_of(plant.model.kernel)) for f in plant.description.features]
    rows: list[list[float]] = []
    unknown = {f.name for f in plant.description.features}
    started: float | None = None
    try:
        while not link.ended:
            snapshot = link.advance()
            values = [f.update(snapshot) for f in filters]
            unknown -= {
                f.name for f, value in zip(plant.description.features, values, strict=True) if value is not None
            }
            if started is None and plant.started.holds(snapshot.values):
                started = snapshot.at_s
            if started is not None and snapshot.at_s - started >= plant.monitoring.settle_s and None not in values:
                rows.append([v for v in values if v is not None])
    except ProcessError as broke:
        raise _sick(seed, f"{broke}; mend the model, or its parameters") from None
    if started is None:
        raise _sick(
            seed,
            f"it does not leave start-up in {plant.end_s:g} s, because '{plant.started}' never holds; "
            "correct that guard, the setpoints or the model, or give it more time (end_s)",
        )
    if not rows:
        text = f"its features are never all known after it started at {started:g} s and settled"
        never = f" ({', '.join(sorted(unknown)[:5])} at no moment)" if unknown else ""
        raise _sick(seed, f"{text}{never}; shorten settle_s or their windows, or correct the features")
    _refuse_violated(plant, process.truth(), started, seed)
    return np.array(rows)


def learn(plant: Plant, runs: int, told: Callable[[int, int], None] = lambda done, of: None) -> tuple[Baseline, ...]:
    """Reference values of every feature from ``runs`` fault-free runs; ``told`` how many are done after each.

    Raises PlantError where one of them is not well.
    """
    found = []
    for k in range(runs):
        found.append(feature_values(plant, FIRST_SEED + k))
        told(k + 1, runs)
    shortest = min(len(v) for v in found)
    values = np.stack([v[:shortest] for v in found])
    means = values.mean(axis=1)
    within = (values - means[:, None]).std(axis=(0, 1))
    percentiles = np.percentile(values, [1, 5, 50, 95, 99], axis=(0, 1))
    columns = np.vstack([means.mean(axis=0), within, means.std(axis=0), percentiles]).T.tolist()
    return tuple(Baseline(f.name, *values) for f, values in zip(plant.description.features, columns, strict=True))


def learned(plant: Plant, told: Callable[[int, int], None] = lambda done, of: None) -> bytes:
    """The file of reference values for ``plant``, learned now: some seconds to minutes.

    Raises PlantError where a fault-free run is not well or units of equations do not agree, GraphError where what was
    learned is absurd.
    """
    refuse_wrong_units(plant.name, plant.description, plant.model)
    content = write_baselines(learn(plant, RUNS, told), baseline_sources(plant))
    read_baselines(content, plant.description)
    return content


def _refuse_violated(plant: Plant, truth: Trajectory, from_s: float, seed: int) -> None:
    """PlantError where a hard limit is violated from ``from_s`` on [s]."""
    judged = truth.times_s >= from_s
    for limit in plant.description.limits.hard:
        outside = judged & ~(limit.formula.margins(truth.signals, truth.dt_s)[0] >= 0.0)
        if outside.any():
            first_s, seconds = float(truth.times_s[outside][0]), float(outside.sum()) * truth.dt_s
            raise _sick(
                seed,
                f"'{limit.formula}' ({limit.name}) does not hold for {seconds:g} s, first at {first_s:g} s; "
                "correct the limit, the setpoints or the model",
            )


def _sick(seed: int, why: str) -> PlantError:
    return PlantError(f"a fault-free run (seed {seed}) is not well: {why}")
