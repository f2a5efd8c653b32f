"""The graph that a graph command works on: the case's own, a file, or a store behind an address."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pyoxigraph import NamedNode, RdfFormat

from homeostat.cases.case import case_folder
from homeostat.cli.arguments import UsageError
from homeostat.knowledge.embedded import EmbeddedStore
from homeostat.knowledge.store import QueryRejected
from homeostat.knowledge.tbox import ONTOLOGY_GRAPH, load_ontology
from homeostat.knowledge.vocabulary import PREFIXES

GRAPH: Final = "plant.ttl"
"""Name of the graph in a case's folder."""


@dataclass(frozen=True, slots=True)
class Place:
    """Which graph is meant."""

    name: str
    """Name of the case."""
    folder: Path
    """Folder of the case."""
    path: Path
    """File of the graph, in Turtle."""
    system: NamedNode
    """The plant in it."""
    model: str
    """The case's process model, as ``module:class``."""
    horizon_s: float
    """Length of a rollout [s]."""

    @property
    def prefixes(self) -> dict[str, str]:
        """Prefix -> namespace IRI, the plant's own included."""
        return {**dict(PREFIXES), self.name: self.system.value.rpartition("#")[0] + "#"}


def place(case: str, file: Path | None) -> Place:
    """The graph of ``case``, or ``file`` in its stead; CaseError where there is no such case."""
    folder = case_folder(case)
    settings = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    return Place(
        name=case,
        folder=folder,
        path=file or folder / GRAPH,
        system=NamedNode(settings["system"]),
        model=settings["model"],
        horizon_s=float(settings["twin"]["horizon_s"]),
    )


def opened(where: Place) -> EmbeddedStore:
    """The graph alone."""
    store = EmbeddedStore()
    _load(store, where, None)
    return store


def with_ontology(where: Place) -> EmbeddedStore:
    """The graph and the ontologies in one store; a query that names no graph sees both."""
    store = EmbeddedStore()
    load_ontology(store)
    graph = NamedNode(where.system.value.rpartition("#")[0])
    _load(store, where, graph)
    return store.seeing(graph, ONTOLOGY_GRAPH)


def _load(store: EmbeddedStore, where: Place, graph: NamedNode | None) -> None:
    try:
        store.load(where.path.read_bytes(), RdfFormat.TURTLE, graph)
    except QueryRejected as error:
        raise UsageError(f"{str(where.path)!r} is no Turtle: {error}") from error
