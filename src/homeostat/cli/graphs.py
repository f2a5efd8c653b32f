"""The graph that a graph command works on: a case's own, or one in a file, of a case or of any plant."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pyoxigraph import NamedNode

from homeostat.cases.case import case_folder
from homeostat.cli.arguments import UsageError
from homeostat.knowledge.embedded import EmbeddedStore
from homeostat.knowledge.graph_file import UnreadableGraph, load_file
from homeostat.knowledge.tbox import ONTOLOGY_GRAPH, load_ontology
from homeostat.knowledge.vocabulary import PREFIXES

GRAPH: Final = "plant.ttl"
"""Name of the graph in a case's folder."""


@dataclass(frozen=True, slots=True)
class Plant:
    """An installed case, as far as graph commands need it."""

    name: str
    """Name of the case."""
    folder: Path
    """Folder of the case."""
    system: NamedNode
    """The plant in its graph."""
    model: str
    """The case's process model, as ``module:class``."""
    horizon_s: float
    """Length of a rollout [s]."""

    @property
    def namespace(self) -> str:
        """What the names of its things begin with, without the #."""
        return self.system.value.rpartition("#")[0]


@dataclass(frozen=True, slots=True)
class Place:
    """Which graph is meant."""

    path: Path
    """File of the graph."""
    plant: Plant | None
    """The case that it is of; None for the graph of any other plant."""

    @property
    def prefixes(self) -> dict[str, str]:
        """Prefix -> namespace IRI, a case's own included."""
        own = {} if self.plant is None else {self.plant.name: self.plant.namespace + "#"}
        return {**dict(PREFIXES), **own}


def place(case: str | None, file: Path | None) -> Place:
    """The graph in ``file``, or else that of ``case``; CaseError where there is no such case."""
    plant = None if case is None else _plant(case)
    if file is not None:
        return Place(file, plant)
    if plant is None:
        raise UsageError("no graph is named; name a CASE, or a file with --graph FILE")
    return Place(plant.folder / GRAPH, plant)


def opened(where: Place) -> EmbeddedStore:
    """The graph alone."""
    store = EmbeddedStore()
    _load(store, where, None)
    return store


def with_ontology(where: Place) -> EmbeddedStore:
    """The graph and the ontologies in one store; a query that names no graph sees both."""
    store = EmbeddedStore()
    load_ontology(store)
    graph = NamedNode("urn:homeostat:file" if where.plant is None else where.plant.namespace)
    _load(store, where, graph)
    return store.seeing(graph, ONTOLOGY_GRAPH)


def _plant(case: str) -> Plant:
    folder = case_folder(case)
    settings = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    return Plant(
        name=case,
        folder=folder,
        system=NamedNode(settings["system"]),
        model=settings["model"],
        horizon_s=float(settings["twin"]["horizon_s"]),
    )


def _load(store: EmbeddedStore, where: Place, graph: NamedNode | None) -> None:
    try:
        load_file(store, where.path, graph)
    except UnreadableGraph as error:
        raise UsageError(str(error)) from error
