"""How much modules feel of each other: what a fault in one reactor does to the cooling water of its neighbours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from benchmarks.scale.decisions import END_S
from benchmarks.scale.plant_graph import GROUP, kind_of
from benchmarks.scale.site import Site
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import Plant

REACTOR = 2
"""The module with the fault."""


def colder_neighbours(cases: Mapping[str, Plant], fault: str = "cool_stuck_closed") -> float:
    """By how much the cooling water of a group is colder in the end where nobody acts on ``fault`` [K]."""
    return _supply_t(cases, "none") - _supply_t(cases, fault)


def _supply_t(cases: Mapping[str, Plant], fault: str) -> float:
    kinds = [kind_of(k) for k in range(1, GROUP + 1)]
    site, plant = Site(cases, kinds, range(1, GROUP + 1), REACTOR), cases[kind_of(REACTOR)]
    within = replace(plant, model=site.join(plant.model))
    unsupervised(within, scenario(plant, fault, REACTOR, end_s=END_S[plant.name]))
    return float(site.supply_t[0])
