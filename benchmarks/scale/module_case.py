"""One module of a site as a plant: the same equations and settings, but everything the graph says from the site's."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from pyoxigraph import NamedNode, RdfFormat, Triple

from benchmarks.scale.plant_graph import namespace
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.store import GraphStore, Solution
from homeostat.plants.files.graph import refuse_other_model
from homeostat.plants.plant import Plant

_T = TypeVar("_T")


class TimedStore:
    """Implements :class:`homeostat.knowledge.store.store.GraphStore` over another store, and times every question."""

    def __init__(self, store: GraphStore) -> None:
        self._store = store
        self.took_ms: list[float] = []
        """What each question took [ms]."""

    @property
    def median_ms(self) -> float:
        """Median of what the questions took [ms]."""
        return statistics.median(self.took_ms)

    def select(self, query: str) -> tuple[Solution, ...]:
        """As the store."""
        return self._timed(lambda: self._store.select(query))

    def construct(self, query: str) -> tuple[Triple, ...]:
        """As the store."""
        return self._timed(lambda: self._store.construct(query))

    def ask(self, query: str) -> bool:
        """As the store."""
        return self._timed(lambda: self._store.ask(query))

    def update(self, text: str) -> None:
        """As the store."""
        self._timed(lambda: self._store.update(text))

    def load(self, data: bytes, format: RdfFormat, graph: NamedNode | None = None) -> None:
        """As the store."""
        self._timed(lambda: self._store.load(data, format, graph))

    def dump(self, format: RdfFormat, graph: NamedNode | None = None) -> bytes:
        """As the store."""
        return self._timed(lambda: self._store.dump(format, graph))

    def _timed(self, action: Callable[[], _T]) -> _T:
        began = time.perf_counter()
        try:
            return action()
        finally:
            self.took_ms.append(1000.0 * (time.perf_counter() - began))


def module_case(plant: Plant, store: GraphStore, module: int) -> Plant:
    """``case``, a plant, as number ``module`` of the site in ``store``; its description is read from there."""
    own = namespace(module)
    description = read_plant(store, NamedNode(f"{own}system"))
    refuse_other_model(description, plant.model, plant.twin.horizon_s)
    described = replace(description, generated=plant.description.generated)
    return replace(plant, graph=store, namespace=own, description=described)
