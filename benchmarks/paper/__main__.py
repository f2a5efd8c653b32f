"""A study in the paper's layout, beside the published figures: ``python -m benchmarks.paper runs/paper``.

Reads the study's dataset and writes tables and heat maps into its folder ``paper``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.paper.heat_map import heat_map
from benchmarks.paper.names import distinct, file_name
from benchmarks.paper.tables import paper_latency, paper_tables
from homeostat.evaluate.report.groups import in_order, plants
from homeostat.evaluate.report.report import write_tables
from homeostat.evaluate.study.ledger import DATASET, read_dataset
from homeostat.record.row import Row

FOLDER = "paper"
"""Where it is written, in the study's folder."""


def write_paper(folder: Path, rows: Sequence[Row]) -> tuple[Path, ...]:
    """Write the tables and heat maps of ``rows`` into ``folder``; paths of the files."""
    written = [*write_tables(folder, distinct([*paper_tables(rows), *paper_latency(rows)]))]
    ordered = in_order(rows)
    for plant in plants(ordered):
        path = folder / f"{file_name('success', plant)}.svg"
        path.write_bytes(heat_map(plant, [row for row in ordered if row.case == plant]).svg)
        written.append(path)
    return tuple(written)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write everything and say where."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, help="folder of a study, as 'homeostat campaign' leaves it")
    options = parser.parse_args(arguments)
    rows = read_dataset(options.study / DATASET)
    print(*write_paper(options.study / FOLDER, rows), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
