"""Carry out the two large studies and write ``docs/results/campaigns.md``: ``python -m benchmarks.campaign_results``.

What was run before is not run again, so an interrupted measurement goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.host import measured_on
from benchmarks.paper.tables import paper_tables
from homeostat.evaluate.report.contents import contents
from homeostat.evaluate.report.tables.formats import markdown
from homeostat.evaluate.study.ledger import DATASET, LEDGER, read_dataset
from homeostat.record.row import DO_NOTHING, HINDSIGHT, SEARCH, WALL, WHOLE, Row

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "campaigns.md"
RUNS = ROOT / "runs"
TEMPLATE = Path(__file__).with_suffix(".md")
PAPER, ROBUST = "paper", "robust"
SHOWN = {
    PAPER: ("paper_mixing_module", "paper_cstr", "safety", "reference_policies"),
    ROBUST: ("success", "safety", "reference_policies", "diagnosis", "comparison", "success_by_scenario"),
}
"""Names of the tables that the page has of each study."""


@dataclass(frozen=True)
class Taken:
    """How long a study took."""

    runs: int
    """Runs that were carried out."""
    wall_s: float
    """From start to report [s]; NaN where it was done in several parts."""


def carried_out(name: str, workers: int, folder: Path | None = None) -> Taken:
    """Carry a study out; the time is kept beside its rows, of the start that found none."""
    target = folder or RUNS / name
    kept = target / "taken.json"
    fresh = not (target / LEDGER).exists()
    begin = time.monotonic()
    source = f"campaigns/{name}.toml"
    command = [sys.executable, "-m", "homeostat", "campaign", source, "--workers", str(workers), "--out", str(target)]
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    if fresh:
        kept.write_text(json.dumps(asdict(Taken(len(read_dataset(target / DATASET)), time.monotonic() - begin))))
    found = Taken(**json.loads(kept.read_text())) if kept.exists() else None
    return found or Taken(len(read_dataset(target / DATASET)), math.nan)


def speed(workers: int, several: Taken) -> str:
    """Time of the published evaluation with one worker beside that with ``workers``, and whether rows are the same."""
    one = carried_out(PAPER, 1, folder=RUNS / f"{PAPER}-1")
    rows, others = (without_times(read_dataset(RUNS / name / DATASET)) for name in (f"{PAPER}-1", PAPER))
    same = "the same" if rows == others else "NOT the same"
    return (
        f"`homeostat campaign campaigns/{PAPER}.toml`, {one.runs} runs: {one.wall_s:.0f} s with one worker, "
        f"{several.wall_s:.0f} s with {workers}, {one.wall_s / several.wall_s:.2f} times as fast; all columns but those"
        f" of time are {same}."
    )


def kills() -> str:
    """What the benchmark of kills prints."""
    command = [sys.executable, "-m", "benchmarks.campaign_kills"]
    return subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.PIPE, text=True).stdout.strip()


def without_times(rows: Sequence[Row]) -> list[dict[str, object]]:
    """The columns that do not depend on the machine."""
    return [{name: value for name, value in asdict(row).items() if not name.startswith(WALL)} for row in rows]


def tables(name: str, wanted: Sequence[str]) -> str:
    """The ``wanted`` tables of a study, the paper's among them."""
    rows = read_dataset(RUNS / name / DATASET)
    every = {table.name: table for table in (*contents(rows).tables, *paper_tables(rows))}
    return "\n\n".join(markdown(every[want]).replace("# ", "### ", 1).strip() for want in wanted)


def missed(name: str) -> str:
    """Runs of the search, with nothing left out, that were no success, beside what was possible and what nobody did."""
    rows = read_dataset(RUNS / name / DATASET)
    known = {(*row.pair, row.proposer): row for row in rows if row.ablation == WHOLE}
    lines = ["| case | scenario | fault | severity | believed | ended in | why | possible | if nobody acts |",
             "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for row in rows:
        if row.proposer == SEARCH and row.ablation == WHOLE and not row.success:
            best, idle = known[*row.pair, HINDSIGHT], known[*row.pair, DO_NOTHING]
            severity = ", ".join(f"{s:.3g}" for s in row.severity)
            cells = (row.case, row.scenario, row.fault, severity, row.believed, row.state, row.reason,
                     "yes" if best.success else "no", _outside(idle))  # fmt: skip
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _outside(row: Row) -> str:
    if row.exposure_s:
        return f"{row.exposure_s:.0f} s outside a hard limit"
    return "inside every limit" if row.success else "not complete"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    paper = carried_out(PAPER, options.workers)
    faster = speed(options.workers, paper)
    robust = carried_out(ROBUST, options.workers)
    values = {
        "paper_runs": paper.runs, "paper_min": f"{paper.wall_s / 60:.1f}", "robust_runs": robust.runs,
        "workers": options.workers, "speed": faster, "kills": kills(),
        "paper": tables(PAPER, SHOWN[PAPER]), "robust": tables(ROBUST, SHOWN[ROBUST]),
        "missed": missed(ROBUST), "measured": measured_on(),
    }  # fmt: skip
    PAGE.write_text(TEMPLATE.read_text(encoding="utf-8").format(**values), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
