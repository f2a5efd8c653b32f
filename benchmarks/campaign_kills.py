"""Is a study that is killed again and again the same as one that nobody disturbed?

Usage: python -m benchmarks.campaign_kills [--kills 10] [--seed 1] [--workers 1]

A small study runs once undisturbed, and once with ``--kills`` SIGKILLs at moments drawn from a seed: after so many
rows, and so many milliseconds. Then dataset and tables, without what depends on the machine, must be the same, and no
job may have been carried out twice.
"""

from __future__ import annotations

import argparse
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

from tests.cli.campaigns import JOBS, ended, prints, rows_in, started, stop, table, tables, wait_for

LATEST_S = 0.3
"""Longest wait after a row before a kill [s]."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=10, metavar="N")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--workers", type=int, default=1, metavar="N")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        return _compared(Path(scratch), options.kills, random.Random(options.seed), str(options.workers))


def _compared(scratch: Path, kills: int, draw: random.Random, workers: str) -> int:
    whole, broken = scratch / "whole", scratch / "broken"
    for folder in (whole, broken):
        folder.mkdir()
    _finish(whole, workers)
    print("| kill | after row | and ms | rows on disk | torn line |")
    print("|---:|---:|---:|---:|---|")
    ledger = broken / "out" / "rows.jsonl"
    for number in range(1, kills + 1):
        row, wait_s = min(rows_in(broken / "out") + draw.randint(0, 2), JOBS - 1), draw.uniform(0.0, LATEST_S)
        process = started(broken, "--workers", workers)
        wait_for(lambda row=row: rows_in(broken / "out") >= row, f"row {row}")  # type: ignore[misc]
        time.sleep(wait_s)
        status, _, _ = stop(process, signal.SIGKILL)
        torn = "yes" if ledger.exists() and not ledger.read_bytes().endswith(b"\n") else "no"
        ending = torn if status == -signal.SIGKILL else f"{torn}; it had ended"
        print(f"| {number} | {row} | {1000 * wait_s:.0f} | {rows_in(broken / 'out')} | {ending} |", flush=True)
    _finish(broken, workers)
    made = prints(broken / "out")
    checks = {
        "rows are the same": table(broken / "out") == table(whole / "out"),
        "tables are the same": tables(broken / "out") == tables(whole / "out"),
        f"{JOBS} jobs, none twice": len(made) == len(set(made)) == JOBS,
    }
    print("", *(f"{'ok' if holds else 'NO'}: {what}" for what, holds in checks.items()), sep="\n")
    return 0 if all(checks.values()) else 1


def _finish(folder: Path, workers: str) -> None:
    status, _, errors = ended(started(folder, "--workers", workers))
    if status:
        raise SystemExit(f"the study ended with {status}: {errors}")


if __name__ == "__main__":
    sys.exit(main())
