"""``homeostat plant learn``: reference values from fault-free runs of a plant."""

import argparse
import sys

from homeostat.journal.beside.files import write_whole
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.learning import RUNS, learned
from homeostat.plants.plant import load_plant

TOLD_EVERY = 10
"""Runs after which a line says how far it is, where nobody watches a terminal."""


def carry_out(options: argparse.Namespace) -> int:
    """Learn and write the reference values; 0."""
    plant = load_plant(options.case, learned=False)
    content = learned(plant, _told)
    path = plant.files.folder / BASELINES
    write_whole(path, content)
    print(f"{path}: {len(plant.description.features)} features, learned from {RUNS} fault-free runs")
    return 0


def _told(done: int, of: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{done} of {of} fault-free runs", end="\n" if done == of else "", file=sys.stderr, flush=True)
    elif done % TOLD_EVERY == 0:
        print(f"homeostat: {done} of {of} fault-free runs", file=sys.stderr)
