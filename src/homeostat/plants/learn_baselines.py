"""Learn a plant's reference values from fault-free runs: ``python -m homeostat.plants.learn_baselines cstr``.

Every run has its own true parameters, so the reference knows how much healthy plants of one design differ.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.domain.plant.baseline import Baseline
from homeostat.journal.beside.files import write_whole
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.assembly import new_sequencer
from homeostat.plants.files.baselines import read_baselines, write_baselines
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.seeds import Stream, noise_seed

FIRST_SEED = 100_000
"""Seeds from here on are for learning; evaluation uses smaller ones."""
RUNS = 40
"""Fault-free runs that are learned from."""


def feature_values(plant: Plant, seed: int) -> NDArray[np.float64]:
    """Feature values of one fault-free run once it has settled, shape (times, features)."""
    noise = noise_seed(seed, Stream.TRUTH_NOISE)
    configuration = PlantConfiguration(plant.true_parameters(seed), plant.start, (), plant.end_s, noise)
    process = TrueProcess(plant.model, plant.description, configuration, record=False)
    link = SimulatedLink(process, recipe=new_sequencer(plant).sample)
    filters = [FeatureFilter(f) for f in plant.description.features]
    settle_s = plant.monitoring.settle_s
    rows: list[list[float]] = []
    started: float | None = None
    while not link.ended:
        snapshot = link.advance()
        values = [f.update(snapshot) for f in filters]
        if started is None and plant.started.holds(snapshot.values):
            started = snapshot.at_s
        if started is not None and snapshot.at_s - started >= settle_s and None not in values:
            rows.append([v for v in values if v is not None])
    return np.array(rows)


def learn(plant: Plant, runs: int) -> tuple[Baseline, ...]:
    """Reference values of every feature from ``runs`` fault-free runs."""
    found = [feature_values(plant, FIRST_SEED + k) for k in range(runs)]
    shortest = min(len(v) for v in found)
    values = np.stack([v[:shortest] for v in found])
    means = values.mean(axis=1)
    within = (values - means[:, None]).std(axis=(0, 1))
    percentiles = np.percentile(values, [1, 5, 50, 95, 99], axis=(0, 1))
    columns = np.vstack([means.mean(axis=0), within, means.std(axis=0), percentiles]).T.tolist()
    return tuple(Baseline(f.name, *values) for f, values in zip(plant.description.features, columns, strict=True))


def learned(plant: Plant) -> bytes:
    """The file of reference values for ``plant``, learned now: some seconds to minutes."""
    return write_baselines(learn(plant, RUNS), baseline_sources(plant))


def main(arguments: list[str]) -> int:
    """Learn and write the reference values of the named plant."""
    plant = load_plant(arguments[0], learned=False)
    content = learned(plant)
    read_baselines(content, plant.description)
    write_whole(plant.files.folder / BASELINES, content)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
