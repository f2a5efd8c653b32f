"""Trips of the published code, where somebody has installed it: ``python -m benchmarks.tennessee.published``.

It needs the package ``tep-studio``, which is no dependency of Homeostat, and writes ``spread.csv`` and
``published.csv`` beside this file.
Control acts every 1.8 s with the published trims and overrides on, towards the published base case.
"""

from __future__ import annotations

import csv
import importlib
from pathlib import Path
from typing import Any

import numpy as np

HOURS = 24
"""How long a disturbance is watched [h]."""
PUBLISHED = Path(__file__).with_name("published.csv")
"""What the published code does."""
SPREAD = Path(__file__).with_name("spread.csv")
"""How much its outputs vary."""
VARYING = (0, 8, 12, 13, 14, 17, 19)
"""Disturbances of which that is known; 0 for none."""
OUTPUTS = {"PR": 6, "TR": 8, "LR": 7, "TS": 10, "F11": 16}
"""Our name of an output -> its place among the published measurements, from 0."""
SETTLED_H = 4.0
"""Time after which it counts [h]."""
EVERY_S = 1.8
SEEDS = (4651207995.0, 7854912354.0)
"""Of its own generator of random numbers."""
BASE = {
    "production_rate": 22.949,
    "reactor_level": 75.0,
    "reactor_pressure": 2705.0,
    "reactor_temperature": 120.4,
    "separator_level": 50.0,
    "stripper_level": 50.0,
    "pct_g": 53.724,
    "ya": 54.9446,
    "yac": 58.5708,
}
"""What it is to hold."""


def run(idv: int, seed: float) -> Any:
    """The published code under disturbance ``idv`` from its start on, a reading every 36 s."""
    control: Any = importlib.import_module("tep_studio.control.controller")
    runner: Any = importlib.import_module("tep_studio.control.runner")
    process: Any = importlib.import_module("tep_studio.simulation.core")
    setpoints = control.ControllerSetpoints(**BASE)
    controller = control.RickerMultiLoopController(enable_composition=True, enable_overrides=True, setpoints=setpoints)
    loop = runner.ClosedLoopSimulation(
        simulator=process.TennesseeEastmanProcess(),
        controller=controller,
        control_interval=EVERY_S / 3600.0,
        horizon=float(HOURS),
    )
    disturbances = np.zeros(28)
    if idv:
        disturbances[idv - 1] = 1.0
    return loop.run(seed=seed, disturbances=disturbances, record_every=20)


def trip(idv: int, seed: float) -> tuple[float | None, str]:
    """Hour at which disturbance ``idv`` shuts the plant down, and what it says then; None where it does not."""
    ended = run(idv, seed)
    said = str(ended.results[-1].shutdown_status.get("message", "")).partition("!")[0]
    return (float(ended.final_time), said) if ended.terminated else (None, "")


def spread(idv: int, seed: float) -> list[float]:
    """Standard deviation of each of the :data:`OUTPUTS` as read, in its unit, once settled."""
    results = run(idv, seed).results
    read = np.array([result.measurements for result in results])
    settled = np.arange(len(read)) * 20 * EVERY_S / 3600.0 >= SETTLED_H
    return [float(np.std(read[settled, place])) for place in OUTPUTS.values()]


def main() -> None:
    """Run disturbances 1 to 20, each with every seed, and write both tables."""
    with SPREAD.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("idv", "seed", *OUTPUTS))
        for idv in VARYING:
            for seed in SEEDS:
                table.writerow((idv, f"{seed:.0f}", *(f"{sd:.4g}" for sd in spread(idv, seed))))
                file.flush()
    with PUBLISHED.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("idv", "seed", "hours", "why"))
        for idv in range(1, 21):
            for seed in SEEDS:
                hours, said = trip(idv, seed)
                table.writerow((idv, f"{seed:.0f}", "" if hours is None else f"{hours:.2f}", said))
                file.flush()


if __name__ == "__main__":
    main()
