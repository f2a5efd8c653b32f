"""Hold decisions against the best constant: ``python -m benchmarks.decisions``; it goes on where it stopped."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from benchmarks.decisions.measure import Decision, measure
from benchmarks.host import ROOT, commit
from benchmarks.unknown.causes import known_faults
from homeostat.plants.plant import load_plant
from homeostat.process.batch import use_threads

FOLDER = ROOT / "build" / "decisions"


def main() -> None:
    """Measure every fault of the reactor with each seed, and print what it cost."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("--seeds", default="1-3", help="as 1-20; thresholds are chosen on those below 400")
    parser.add_argument("--faults", default="", help="names joined by commas; all by default")
    parser.add_argument("--mismatch", default="plant", help="how the true plant is not the model that its twin has")
    asked = parser.parse_args()
    first, _, last = asked.seeds.partition("-")
    use_threads(1)
    plant, path = load_plant("cstr"), FOLDER / f"{asked.mismatch}-{commit('src', 'benchmarks/decisions')}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    known = {(d.fault, d.seed): d for d in kept(path)}
    wanted = [name for name in asked.faults.split(",") if name]
    for seed in range(int(first), int(last or first) + 1):
        for cause in known_faults(plant, seed):
            if wanted and cause.id not in wanted:
                continue
            found = known.get((cause.fault, seed))
            if found is None:
                found = measure(plant, cause, seed, asked.mismatch)
                with path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(found)) + "\n")
            print(line(found), flush=True)


def kept(path: Path) -> Iterator[Decision]:
    """What was measured before."""
    for text in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        yield Decision(**json.loads(text))


def line(found: Decision) -> str:
    """One decision for people: costs in points of the design production from detection on."""
    cost, best, alone = ("  none" if x is None else f"{x:6.1f}" for x in (found.cost, found.best, found.alone))
    dearest = sorted(found.items.items(), key=lambda item: -item[1])[:4]
    paid = ", ".join(f"{name} {amount:.1f}" for name, amount in dearest)
    what = f"{found.fault:17} {found.severity:8.3f} seed {found.seed:3} {found.outcome:15} {found.releases:2} releases"
    return f"{what}, cost {cost}, best {best}, alone {alone}, outside {found.outside_s:.0f} s: {paid}"


if __name__ == "__main__":
    main()
