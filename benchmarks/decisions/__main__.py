"""What decisions cost, and how repaired plants come back: ``python -m benchmarks.decisions``, resumable."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Generic, TypeAlias, TypeVar

from benchmarks.decisions.measure import Decision, measure
from benchmarks.decisions.page import against_constants, against_routes, way_back, write
from benchmarks.decisions.repair import Repair, measure_repair
from benchmarks.host import ROOT, commit
from benchmarks.unknown.causes import Cause, known_faults
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads

FOLDER = ROOT / "build" / "decisions"
PARTS = ("constant", "route", "repair", "page")
"""Hold the reactor against the best constant and batches against the best route, repair every fault of the reactor,
write the page of what is in."""

R = TypeVar("R", Decision, Repair)
Measured: TypeAlias = Callable[[Plant, Cause, int, str], R]
"""Carries out one run of a cause, with a seed and under a mismatch."""


class Ledger(Generic[R]):
    """What one part measured, a line for each run."""

    def __init__(
        self, part: str, mismatch: str, kind: type[R], measured: Callable[[Plant, Cause, int, str], R]
    ) -> None:
        """``measured`` carries out one run."""
        self._path = FOLDER / f"{part}-{mismatch}-{commit('src', 'benchmarks/decisions')}.jsonl"
        self._mismatch, self._kind, self._measured = mismatch, kind, measured

    def kept(self) -> Iterator[R]:
        """What is in."""
        for text in self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else ():
            yield self._kind(**json.loads(text))

    def fill(self, plant: Plant, causes: list[tuple[Cause, int]]) -> None:
        """Measure what is lacking, and print each run."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        known = {(r.fault, r.seed) for r in self.kept()}
        for cause, seed in causes:
            if (cause.fault, seed) in known:
                continue
            found = self._measured(plant, cause, seed, self._mismatch)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(found)) + "\n")
            print(found, flush=True)


def main() -> None:
    """Measure every fault of both plants with each seed, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS), metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--seeds", default="401-420", help="as 401-420; thresholds are chosen on those below 400")
    parser.add_argument("--faults", default="", help="names joined by commas; all by default")
    parser.add_argument("--mismatch", default="plant", help="how the true plant is not the model that its twin has")
    asked = parser.parse_args()
    if wrong := [part for part in asked.parts if part not in PARTS]:
        parser.error(f"there is no part {wrong[0]!r}; there are {', '.join(PARTS)}")
    first, _, last = asked.seeds.partition("-")
    seeds, wanted = range(int(first), int(last or first) + 1), [name for name in asked.faults.split(",") if name]
    use_threads(1)
    reactor, module = load_plant("cstr"), load_plant("mixing_module")
    causes, batches = (
        [(c, s) for s in seeds for c in known_faults(plant, s) if not wanted or c.id in wanted]
        for plant in (reactor, module)
    )
    constant = Ledger("constant", asked.mismatch, Decision, measure)
    route = Ledger("route", asked.mismatch, Decision, measure)
    repair = Ledger("repair", asked.mismatch, Repair, measure_repair)
    if "constant" in asked.parts:
        constant.fill(reactor, causes)
    if "route" in asked.parts:
        route.fill(module, batches)
    if "repair" in asked.parts:
        repair.fill(reactor, causes)
    if "page" in asked.parts:
        sections = (
            against_constants(list(constant.kept()), len(causes)),
            against_routes(list(route.kept()), len(batches)),
            way_back(list(repair.kept()), len(causes)),
        )
        write(ROOT / "docs" / "results" / "decisions.md", sections)


if __name__ == "__main__":
    main()
