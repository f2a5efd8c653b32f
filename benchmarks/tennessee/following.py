"""What the twin leaves of healthy plants that it is not: ``python -m benchmarks.tennessee.following``.

The errors that the plant's settings state ([twin.errors] and gain_error) were chosen by this on seeds 11 to 14. Nothing
is wrong with these plants; each is moved by hand to another pressure, temperature and level in its sixth hour. What is
printed is the mean square of what is left of each variable per sample, in stated standard deviations, before the move
and after it, and how many looks at the last hour and a half are not explained.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterator, Mapping

import numpy as np

from benchmarks.arguments import numbers
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.twin.isolation.evidence import MEAN_SQUARE, WORST_BLOCK, Fit
from homeostat.twin.twin import Twin

LEARNED_S, MOVED_S = 15_840.0, 18_540.0
BEFORE_S = (16_500.0, 18_300.0)
AFTER_S = (20_280.0, 21_000.0, 22_800.0, 24_000.0, 25_200.0, 27_000.0)
MOVES = {"PR.sp": 2574.0, "TR.sp": 118.5, "LR.sp": 65.3}
MOST = 12
"""Variables that are printed."""


def looks(plant: Plant, seed: int) -> Iterator[tuple[bool, Mapping[str, Fit]]]:
    """Whether a healthy plant was moved before each look, and what its twin leaves of each variable then."""
    truth = departing(plant, scenario(plant, "none", seed, end_s=AFTER_S[-1]), (), "plant")
    link = SimulatedLink(open_process(plant, truth))
    twin = Twin(plant.model, plant.description, plant.twin, seed)
    while link.now_s < AFTER_S[-1]:
        seen = link.advance()
        twin.observe(seen)
        if seen.at_s == LEARNED_S:
            twin.calibrate(plant.monitoring.centre_s)
        if seen.at_s == MOVED_S:
            for tag, value in MOVES.items():
                link.operate(tag, value, plant.description.tag(tag).rate_limit)
        if seen.at_s in (*BEFORE_S, *AFTER_S):
            yield seen.at_s > MOVED_S, twin.nothing(plant.twin.replay_s)


def explained(fits: Collection[Fit]) -> bool:
    """Whether that nothing is wrong explains all variables together."""
    mean_square = sum(fit.mean_square for fit in fits) / len(fits)
    return mean_square <= MEAN_SQUARE and max(fit.worst_block for fit in fits) <= WORST_BLOCK


def main() -> int:
    """Carry out what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tennessee.following", description=__doc__)
    parser.add_argument("--seeds", type=numbers, default=[31, 32, 33, 34], help="as 31,32 or 31-34, the default")
    asked = parser.parse_args()
    if not asked.seeds:
        parser.error("--seeds names no seed")
    plant = load_plant("tennessee_eastman")
    every = [look for seed in asked.seeds for look in looks(plant, seed)]
    for moved, when in ((False, "before the move"), (True, "after it")):
        fits = [fit for after, fit in every if after is moved]
        bad = sum(not explained(fit.values()) for fit in fits)
        means = {name: float(np.mean([fit[name].mean_square for fit in fits])) for name in fits[0]}
        worst = sorted(means, key=lambda name: -means[name])[:MOST]
        print(f"{when}: {bad} of {len(fits)} looks are not explained")
        print("  " + ", ".join(f"{name} {means[name]:.2f}" for name in worst))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
