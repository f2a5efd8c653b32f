"""Measure the detectors on SKAB and Tennessee Eastman and write the page: ``python -m benchmarks.monitor``."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.host import ROOT
from benchmarks.monitor.data import DATA, skab
from benchmarks.monitor.on_skab import Score, found, score
from benchmarks.monitor.on_tep import Detection, at_equal_rate, at_stated_rate
from benchmarks.monitor.page import write
from homeostat.detectors.catalogue import KINDS, USUAL

STATED = (0.05, 0.10, 0.135, 0.15)
"""Rates of false alarms that are stated on SKAB; the third is what the best published detector has."""
HEADLINE = 0.135
"""The rate that the bar is measured at."""
RATE = 0.01
"""The same on Tennessee Eastman."""


def main() -> int:
    """Carry out what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.monitor", description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA, help="folder with skab/ and tep/")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "monitor.md")
    asked = parser.parse_args()
    write(asked.out, *_on_skab(asked.data / "skab"), *_on_tep(asked.data / "tep"))
    print(f"{asked.out}: written")
    return 0


def _on_skab(folder: Path) -> tuple[dict[tuple[str, float], Score], dict[str, Score]]:
    """What each detector scores at each rate, and what the usual combination does in each folder."""
    experiments, free = skab(folder)
    wanted = [(USUAL, rate) for rate in STATED] + [(USUAL[:1], rate) for rate in STATED]
    wanted += [((name,), HEADLINE) for name in KINDS if name not in USUAL[:1]]
    scores = {}
    for names, rate in wanted:
        scores[" + ".join(names), rate] = score(experiments, found(experiments, free, names, rate))
        print(" + ".join(names), rate, f"{scores[' + '.join(names), rate].f1:.3f}", flush=True)
    over = found(experiments, free, USUAL, HEADLINE)
    of = {e.name.partition("/")[0] for e in experiments}
    return scores, {n: score([e for e in experiments if e.name.startswith(n)], over) for n in sorted(of)}


def _on_tep(folder: Path) -> tuple[dict[str, Detection], dict[str, Detection]]:
    """What each detector detects at the same measured rate, and at a stated one."""
    wanted = [(name,) for name in KINDS] + [USUAL]
    equal, stated = {}, {}
    for names in wanted:
        equal[" + ".join(names)] = at_equal_rate(folder, names, RATE)
        stated[" + ".join(names)] = at_stated_rate(folder, names, RATE)
        print(" + ".join(names), f"{equal[' + '.join(names)].mean:.3f}", flush=True)
    return equal, stated


if __name__ == "__main__":
    raise SystemExit(main())
