"""Compare the plant with its published code, look after it, and write the page: ``python -m benchmarks.tennessee``.

Runs with everything on take many minutes each. Those that were made for the present sources are not made again, so
that a study that was ended goes on; ``--only-there`` writes the page of those that are there.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from benchmarks.arguments import names, numbers
from benchmarks.host import ROOT
from benchmarks.tennessee.alone import HEALTHY, ONSET_S, Trip, ended, published, upsets
from benchmarks.tennessee.campaign import rows_of
from benchmarks.tennessee.engine import speed
from benchmarks.tennessee.operated import everything, looked, there
from benchmarks.tennessee.page import Beside, write
from benchmarks.tennessee.qualify import qualified
from benchmarks.tennessee.spread import published_spread, spread
from homeostat.plants.plant import Plant, load_plant

SEEDS = (1, 2, 3)
PUBLISHED_PLANT = "published"
"""How the true plant is not the model beside the published code: it has the stated parameters, as that has."""


def main() -> int:
    """Carry out what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tennessee", description=__doc__)
    parser.add_argument("--only-there", action="store_true", help="make no run, write what is there")
    parser.add_argument("--only", type=names, default=[], help="make these runs alone, as 'IDV 6,V10 closed'")
    parser.add_argument("--seeds", type=numbers, default=list(SEEDS), help="as 1,2 or 1-3; the study's own by default")
    parser.add_argument("--campaign", type=Path, help="folder of the study that campaigns/tennessee.toml was run into")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "tennessee.md")
    asked = parser.parse_args()
    plant = load_plant("tennessee_eastman")
    beside = _beside(plant)
    every = everything(plant)
    if wrong := set(asked.only) - {one.name for one in every}:
        parser.error(f"there is no {min(wrong)!r}; there are {', '.join(one.name for one in every)}")
    runs = []
    for seed in SEEDS:
        for one in every:
            wanted = seed in asked.seeds and (not asked.only or one.name in asked.only)
            if there(one, seed) or (wanted and not asked.only_there):
                runs.append(looked(plant, one, seed))
                print(f"{one.name} seed {seed}: {runs[-1].outcome}", flush=True)
    campaign = rows_of(asked.campaign, qualified())
    write(asked.out, beside, runs, len(SEEDS) * len(every), speed(plant), campaign)
    print(f"{asked.out}: written")
    return 0


def _beside(plant: Plant) -> Beside:
    """Every run with nobody that the published code has, too."""
    trips: dict[int, list[Trip]] = {}
    spreads: dict[int, list[Mapping[str, float]]] = {}
    theirs, varying = published(), published_spread()
    for upset in (HEALTHY, *upsets().values()):
        for seed in SEEDS if upset.idv in theirs or upset.idv in varying else ():
            trip, truth = ended(plant, upset, seed, PUBLISHED_PLANT)
            trips.setdefault(upset.idv, []).append(trip)
            spreads.setdefault(upset.idv, []).append(spread(truth, ONSET_S))
    return Beside(upsets(), trips, theirs, spreads, varying)


if __name__ == "__main__":
    raise SystemExit(main())
