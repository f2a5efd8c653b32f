"""Trips of the published code, where somebody has installed it: ``python -m benchmarks.tennessee.published``.

It needs the package ``tep-studio``, which is no dependency of Homeostat, and writes ``published.csv`` beside this file.
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


def run(idv: int, seed: float) -> tuple[float | None, str]:
    """Hour at which disturbance ``idv`` shuts the plant down, and what it says then; None where it does not."""
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
    disturbances[idv - 1] = 1.0
    ended = loop.run(seed=seed, disturbances=disturbances, record_every=2000)
    said = str(ended.results[-1].shutdown_status.get("message", "")).partition("!")[0]
    return (float(ended.final_time), said) if ended.terminated else (None, "")


def main() -> None:
    """Run disturbances 1 to 20, each with every seed, and write the table."""
    with PUBLISHED.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("idv", "seed", "hours", "why"))
        for idv in range(1, 21):
            for seed in SEEDS:
                hours, said = run(idv, seed)
                table.writerow((idv, f"{seed:.0f}", "" if hours is None else f"{hours:.2f}", said))
                file.flush()


if __name__ == "__main__":
    main()
