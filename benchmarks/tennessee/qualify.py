"""Which candidates become the 13 scenarios of ``campaigns/tennessee.toml``: ``python -m benchmarks.tennessee.qualify``.

Nobody acts. It writes ``qualified.csv`` beside this file: one row for each candidate and seed, and what is taken.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.host import ROOT
from benchmarks.tennessee.alone import Ended, left_alone
from homeostat.evaluate.beginning import begun
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.plants.plant import Plant, load_plant

CANDIDATES: Final = ROOT / "campaigns" / "tennessee_candidates.toml"
QUALIFIED: Final = Path(__file__).with_name("qualified.csv")
CONFIGURATIONS: Final = ("normal", "trims_held", "by_separator", "by_stripper")
"""States that may have an answer to what trips, in the order in which they are tried."""
GRADE: Final = 5.0
"""How far the grade may be off on the mean of the last two hours [mol %], as Downs and Vogel (1993) have it."""
LAST_S: Final = 7200.0


class Kind(StrEnum):
    """What a candidate is good for."""

    NOTHING = "needs nothing"
    TRIPS = "trips"
    QUALITY = "misses the grade"
    HOPELESS = "trips, and no configuration helps"
    MIXED = "differs between seeds"


WANTED: Final = {Kind.NOTHING: 5, Kind.TRIPS: 5, Kind.QUALITY: 3}


@dataclass(frozen=True)
class Candidate:
    """What became of one candidate, seed by seed."""

    name: str
    ends: tuple[Ended, ...]
    """Under regulatory control."""
    kind: Kind
    helps: str = ""
    """Configuration that has an answer, of one that needs it; empty for none."""


def off_grade(ended: Ended) -> float:
    """How far the grade was off on the mean of the last two hours [mol %]."""
    truth = ended.truth
    last = truth.times_s >= truth.times_s[-1] - LAST_S
    return float(abs(np.mean(truth.signals["X11G.err"][0, last])))


def judged(plant: Plant, name: str, scenarios: Sequence[Scenario]) -> Candidate:
    """What ``scenarios`` of one candidate, a seed each, come to."""
    ends = tuple(left_alone(begun(plant, each), each) for each in scenarios)
    trips = [math.isfinite(ended.trip.hours) for ended in ends]
    if not any(trips):
        missed = [off_grade(ended) > GRADE for ended in ends]
        if not any(missed):
            return Candidate(name, ends, Kind.NOTHING)
        helps = _helps(plant, scenarios) if all(missed) else ""
        return Candidate(name, ends, Kind.QUALITY if helps else Kind.MIXED, helps)
    if not all(trips):
        return Candidate(name, ends, Kind.MIXED)
    helps = _helps(plant, scenarios)
    return Candidate(name, ends, Kind.TRIPS if helps else Kind.HOPELESS, helps)


def _helps(plant: Plant, scenarios: Sequence[Scenario]) -> str:
    """The first configuration that, from the beginning on, keeps limits and grade in all seeds; empty for none."""
    return next((name for name in CONFIGURATIONS if all(_kept(plant, each, name) for each in scenarios)), "")


def _kept(plant: Plant, scenario: Scenario, configuration: str) -> bool:
    """Whether ``scenario`` keeps every trip limit and its grade where the plant stands in ``configuration``."""
    chosen = replace(scenario, begins_in=configuration)
    ended = left_alone(begun(plant, chosen), chosen)
    return math.isinf(ended.trip.hours) and off_grade(ended) <= GRADE


def taken(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The 13: of each kind the first."""
    return [one for kind, most in WANTED.items() for one in [c for c in candidates if c.kind is kind][:most]]


def qualified() -> dict[str, Kind]:
    """Name of each scenario that was taken -> what it is good for, in the order of the study."""
    with QUALIFIED.open(encoding="utf-8", newline="") as file:
        found = {row["candidate"]: Kind(row["kind"]) for row in csv.DictReader(file) if row["taken"] == "yes"}
    return {name: kind for wanted in WANTED for name, kind in found.items() if kind is wanted}


def main() -> None:
    """Judge every candidate, print and write what it is."""
    plant, scenarios = load_plant("tennessee_eastman"), {}
    for job in jobs_of(read_plan(CANDIDATES), CANDIDATES.parent):
        scenarios.setdefault(job.label, []).append(job.scenario)
    found = []
    for name, each in scenarios.items():
        found.append(judged(plant, name, each))
        print(f"{name}: {found[-1].kind} {found[-1].helps}", flush=True)
    chosen = taken(found)
    with QUALIFIED.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("candidate", "seed", "ended", "off_grade", "kind", "helps", "taken"))
        for one in found:
            for scenario, ended in zip(scenarios[one.name], one.ends, strict=True):
                off = "" if math.isfinite(ended.trip.hours) else f"{off_grade(ended):.1f}"
                yes = "yes" if one in chosen else "no"
                table.writerow((one.name, scenario.seed, ended.trip.told, off, one.kind, one.helps, yes))
    print(f"{len(chosen)} of {sum(WANTED.values())} are taken: {', '.join(one.name for one in chosen)}")


if __name__ == "__main__":
    main()
