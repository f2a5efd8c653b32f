"""What decisions cost, and how repaired plants come back: ``python -m benchmarks.decisions``, resumable."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial

from benchmarks.arguments import MISMATCHES, names, numbers
from benchmarks.decisions.better import Better, measure_better
from benchmarks.decisions.better import causes as better_causes
from benchmarks.decisions.ledger import Ledger
from benchmarks.decisions.measure import Decision, measure
from benchmarks.decisions.models import SEATS, Seat, Seated
from benchmarks.decisions.optimisers import Tuned, measure_tuned, taken
from benchmarks.decisions.page import against_constants, against_routes, way_back, write
from benchmarks.decisions.page_models import beside, better_answers, side_by_side
from benchmarks.decisions.page_risk import risks, speeds, worst_runs
from benchmarks.decisions.repair import Repair, measure_repair
from benchmarks.decisions.risk import ENSEMBLE, NOMINAL, SPREADS, Released, measure_nominal, measure_risk
from benchmarks.decisions.speed import Thought, measure_thought, rollouts_s
from benchmarks.decisions.worst import causes as worst_causes
from benchmarks.decisions.worst import measure_worst
from benchmarks.host import ROOT
from benchmarks.unknown.causes import Cause, known_faults
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads

PARTS = ("constant", "worst", "route", "repair", "risk", "speed", "models", "optimisers", "page")
"""Hold the reactor against the best constant, also in the three worst runs of a review, and batches against the best
route; repair every fault of the reactor; count what violates a limit; take the time; seat a model beside the search;
take other optimisers in the place of its own; write the page of what is in."""
NOMINAL_AT = "twice"
"""Mismatch under which one nominal rollout is held against the ensemble."""


class Study:
    """Every ledger of one study."""

    def __init__(self, mismatch: str, seeds: Sequence[int], wanted: Sequence[str]) -> None:
        """``wanted``: faults by name; every one of the tables where there are none."""
        self._reactor, self._module = plants = load_plant("cstr"), load_plant("mixing_module")
        self._first = min(seeds)
        self._causes: dict[str, list[tuple[Cause, int]]] = {
            plant.name: [(c, s) for s in seeds for c in known_faults(plant, s) if not wanted or c.id in wanted]
            for plant in plants
        }
        self._constant = Ledger("constant", self._reactor, mismatch, Decision, measure)
        self._worst = Ledger("worst", self._reactor, mismatch, Decision, measure_worst)
        self._route = Ledger("route", self._module, mismatch, Decision, measure)
        self._repair = Ledger("repair", self._reactor, mismatch, Repair, measure_repair)
        self._plants = {plant.name: plant for plant in plants}  # a plant has no hash
        self._speed = {p.name: Ledger("speed", p, mismatch, Thought, measure_thought) for p in plants}
        alone = {self._reactor.name: self._constant.kept, self._module.name: self._route.kept}
        self._seats = {
            (p.name, arm): Ledger(f"models-{arm}", p, mismatch, Seated, Seat(arm, alone[p.name]).measure)
            for p in plants
            for arm in SEATS
        }
        self._better = Ledger("better", self._reactor, mismatch, Better, measure_better)
        self._tuned = {p.name: Ledger("optimisers", p, mismatch, Tuned, measure_tuned) for p in plants}
        told = [(plant, spread, ENSEMBLE) for plant in plants for spread in SPREADS]
        told += [(plant, NOMINAL_AT, NOMINAL) for plant in plants]
        self._risk = {(plant.name, *rest): _of_risk(plant, *rest) for plant, *rest in told}

    def fill(self, parts: Sequence[str]) -> None:
        """Measure what is lacking of each of ``parts``."""
        reactor, module = (self._causes[plant.name] for plant in (self._reactor, self._module))
        todo: dict[str, list[Callable[[], None]]] = {
            "constant": [partial(self._constant.fill, reactor)],
            "worst": [partial(self._worst.fill, worst_causes())],
            "route": [partial(self._route.fill, module)],
            "repair": [partial(self._repair.fill, reactor)],
            "risk": [partial(each.fill, self._causes[plant]) for (plant, _, _), each in self._risk.items()],
            "speed": [partial(each.fill, self._causes[plant]) for plant, each in self._speed.items()],
            "models": [
                partial(self._better.fill, better_causes()),
                *(partial(each.fill, self._causes[plant]) for (plant, _), each in self._seats.items()),
            ],
            "optimisers": [
                partial(each.fill, taken(self._plants[plant], self._first)) for plant, each in self._tuned.items()
            ],
        }
        for part in parts:
            for fill in todo.get(part, []):
                fill()

    def sections(self) -> tuple[str, ...]:
        """What the page says of what is in."""
        reactor, module = (len(self._causes[plant.name]) for plant in (self._reactor, self._module))
        title = {name: plant.title for name, plant in self._plants.items()}
        seats: dict[str, dict[str, list[Seated]]] = {}
        for (plant, arm), ledger in self._seats.items():
            seats.setdefault(title[plant], {})[arm] = list(ledger.kept())
        return (
            against_constants(list(self._constant.kept()), reactor),
            worst_runs(list(self._worst.kept())),
            against_routes(list(self._route.kept()), module),
            risks({(title[p], s, v): list(ledger.kept()) for (p, s, v), ledger in self._risk.items()}),
            way_back(list(self._repair.kept()), reactor),
            speeds({title[plant]: list(ledger.kept()) for plant, ledger in self._speed.items()}, rollouts_s()),
            beside(seats, {title[name]: len(causes) for name, causes in self._causes.items()}),
            better_answers(list(self._better.kept())),
            side_by_side({title[plant]: list(ledger.kept()) for plant, ledger in self._tuned.items()}),
        )


def _of_risk(plant: Plant, spread: str, validator: str) -> Ledger[Released]:
    measured = measure_risk if validator == ENSEMBLE else measure_nominal
    return Ledger(f"risk-{validator}", plant, spread, Released, measured)


def main() -> None:
    """Measure every fault of both plants with each seed, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS), metavar="PART", help=", ".join(PARTS))
    parser.add_argument(
        "--seeds", type=numbers, default=numbers("701-720"), help="as 701-720; whatever was chosen was chosen below 700"
    )
    parser.add_argument("--faults", type=names, default=[], help="names joined by commas; all by default")
    parser.add_argument("--mismatch", default="plant", choices=MISMATCHES, help="how the true plant is not its model")
    asked = parser.parse_args()
    if wrong := [part for part in asked.parts if part not in PARTS]:
        parser.error(f"there is no part {wrong[0]!r}; there are {', '.join(PARTS)}")
    if not asked.seeds:
        parser.error("--seeds names none; give some, as 701-720")
    use_threads(1)
    study = Study(asked.mismatch, asked.seeds, asked.faults)
    study.fill(asked.parts)
    if "page" in asked.parts:
        write(ROOT / "docs" / "results" / "decisions.md", study.sections())


if __name__ == "__main__":
    main()
