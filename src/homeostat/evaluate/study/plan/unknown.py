"""Unknown faults: the plant has them, its tables and its graph do not."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from pyoxigraph import RdfFormat

from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.plants.plant import Plant


def without_faults(plant: Plant, names: Collection[str]) -> Plant:
    """What agents know of ``plant`` where nobody thought of the faults called ``names``: no cause, no symptom of it.

    Symptoms that indicate other faults as well go on indicating those; the rest are watched and explain nothing.
    """
    graph = EmbeddedStore()
    graph.load(plant.graph.dump(RdfFormat.TURTLE), RdfFormat.TURTLE)
    for name in names:
        fault = f"<{plant.namespace}fault_{name}>"
        graph.update(f"DELETE WHERE {{ {fault} ?p ?o }}")
        graph.update(f"DELETE WHERE {{ ?s ?p {fault} }}")
    d = plant.description
    rules = tuple(replace(r, faults=tuple(f for f in r.faults if f not in names)) for r in d.symptom_rules)
    description = replace(d, faults=tuple(f for f in d.faults if f.name not in names), symptom_rules=rules)
    return replace(plant, graph=graph, description=description)
