"""The study of one size: load the site, ask its graph, decide about faults in its modules, simulate all of it."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.scale.decisions import FAULTS, Decision, decide
from benchmarks.scale.module_case import module_case
from benchmarks.scale.plant_graph import KINDS, kind_of, load_site
from benchmarks.scale.retrieval import Retrieval, retrievals
from benchmarks.scale.site import BLOCK_S, Site
from homeostat.knowledge.store.store import GraphStore
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.seeds import generator as draws

SIZES = (1, 3, 10, 30, 100, 300, 1000)
"""Modules of the sites."""
ASKED = 3
"""Modules of each plant whose retrieval is measured."""
SIMULATED_S = 600
"""Process time of the simulation without any fault [s]."""


@dataclass(frozen=True)
class Footprint:
    """What a site costs before anything goes wrong."""

    modules: int
    """Size of the site."""
    triples: int
    """Triples of its graph, the T-Box not counted."""
    load_s: float
    """Time to write and load the graph [s]."""
    memory_mb: float
    """Memory that the process holds more than before [MB]."""
    describe_ms: float
    """Time to read one module's description, done once when its supervisor starts; median [ms]."""
    simulate_s: float
    """Wall-clock time to simulate ten minutes of all modules with their headers [s]."""
    simulate_cpu_s: float
    """Processor time of all threads for the same [s]."""
    programs: float
    """Programs that wanted a core when the measurement began: load average of one minute [1]."""


@dataclass(frozen=True)
class Study:
    """Everything that was measured at one size."""

    footprint: Footprint
    """What the site costs."""
    retrievals: tuple[Retrieval, ...]
    """Questions to its graph."""
    decisions: tuple[Decision, ...]
    """Faults in its modules."""


def study(modules: int) -> Study:
    """Measure a site of ``modules``; one module is measured as each of the plants."""
    cases = {kind: load_plant(kind) for kind in KINDS}
    firsts = KINDS if modules == 1 else KINDS[:1]
    found = [_study(cases, modules, first) for first in firsts]
    return Study(
        _mean([s.footprint for s in found]), tuple(r for s in found for r in s.retrievals),
        tuple(d for s in found for d in s.decisions),
    )  # fmt: skip


def alone() -> tuple[Retrieval, ...]:
    """The same questions to the plants' own graphs, without any site."""
    return tuple(r for kind in KINDS for r in retrievals(load_plant(kind)))


def _study(cases: Mapping[str, Plant], modules: int, first: str) -> Study:
    programs = os.getloadavg()[0]
    before, began = _memory_mb(), time.perf_counter()
    store = load_site(modules, first)
    load_s, memory = time.perf_counter() - began, _memory_mb() - before
    asked = {kind: chosen(modules, kind, first, ASKED) for kind in KINDS}
    times: list[float] = []
    found: list[Retrieval] = []
    for kind, numbers in asked.items():
        for number in numbers:
            began = time.perf_counter()
            plant = module_case(cases[kind], store, number)
            times.append(1000.0 * (time.perf_counter() - began))
            found += retrievals(plant)
    kinds = [kind_of(k, first) for k in range(1, modules + 1)]
    Site(cases, KINDS, (1, 2)).run(BLOCK_S)  # whatever is compiled or read from the disk once
    site, began, busy = Site(cases, kinds, range(1, modules + 1)), time.perf_counter(), time.process_time()
    site.run(SIMULATED_S)
    footprint = Footprint(
        modules, _triples(store), load_s, memory, float(np.median(times)), time.perf_counter() - began,
        time.process_time() - busy, programs,
    )  # fmt: skip
    decisions = [
        decide(cases, store, modules, number, fault, seed, first)
        for kind in KINDS
        for seed, (fault, number) in enumerate(
            zip(FAULTS[kind], chosen(modules, kind, first, len(FAULTS[kind])), strict=False), start=1
        )
    ]
    return Study(footprint, tuple(found), tuple(decisions))


def chosen(modules: int, kind: str, first: str, number: int) -> tuple[int, ...]:
    """Modules of ``kind`` drawn from a site, again and again where it has fewer than ``number``."""
    mine = [k for k in range(1, modules + 1) if kind_of(k, first) == kind]
    if not mine:
        return ()
    generator = draws(modules, "study/site", kind)
    drawn = generator.permutation(mine).tolist()
    return tuple(drawn[i % len(drawn)] for i in range(number))


def _triples(store: GraphStore) -> int:
    return int(store.select("SELECT (COUNT(*) AS ?n) { ?s ?p ?o }")[0].number("n"))


def _memory_mb() -> float:
    """Resident memory of this process [MB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return float(line.split()[1]) / 1024.0
    raise RuntimeError("/proc/self/status has no VmRSS; run this on Linux")


def _mean(footprints: list[Footprint]) -> Footprint:
    """The mean of the footprints of two sites of the same size."""
    names = ("load_s", "memory_mb", "describe_ms", "simulate_s", "simulate_cpu_s", "programs")
    means = (float(np.mean([getattr(f, name) for f in footprints])) for name in names)
    return Footprint(footprints[0].modules, round(float(np.mean([f.triples for f in footprints]))), *means)
