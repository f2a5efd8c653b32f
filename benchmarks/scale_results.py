"""Measure sites of 1 to 1,000 modules and write ``docs/results/scale.md``: ``python -m benchmarks.scale_results``.

Each size is measured in a process of its own, so that its memory can be told. Sizes that were measured before are read
back from the cache folder, so an interrupted measurement goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.host import kept, measured_on
from benchmarks.scale import study as scale
from benchmarks.scale.decisions import Decision
from benchmarks.scale.figure import draw
from benchmarks.scale.page import page
from benchmarks.scale.retrieval import Retrieval
from benchmarks.scale.study import SIZES, Footprint, Study

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "scale.md"
FIGURE = ROOT / "docs" / "images" / "scale.png"
FEWEST = 3
"""Fewest sizes that tell a slope and how sure it is."""


def measured(modules: int) -> Study:
    """The study of a site of ``modules``, from the cache where it is there."""
    file = kept("scale") / f"{modules}.json"
    if not file.exists():
        began = time.perf_counter()
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            found = pool.submit(scale.study, modules).result()
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(asdict(found), indent=1) + "\n", encoding="utf-8")
        print(f"{modules:5} modules: {time.perf_counter() - began:.0f} s", flush=True)
    return read(json.loads(file.read_text(encoding="utf-8")))


def read(saved: dict[str, Any]) -> Study:
    """The study that was written as ``saved``."""
    return Study(
        Footprint(**saved["footprint"]), tuple(Retrieval(**row) for row in saved["retrievals"]),
        tuple(Decision(**row) for row in saved["decisions"]),
    )  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Measure what is missing and write page and figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, help="modules of the sites")
    options = parser.parse_args(arguments)
    if min(options.sizes) < 1 or len({*options.sizes}) < FEWEST:
        parser.error(f"--sizes are at least {FEWEST} different numbers from 1 on: growth with the size is a slope")
    studies = [measured(modules) for modules in options.sizes]
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    draw(studies, FIGURE)
    PAGE.write_text(page(studies, scale.alone(), measured_on()), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)} and {FIGURE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
