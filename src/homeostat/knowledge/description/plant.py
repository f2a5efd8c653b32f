"""The whole plant, read once when a case is opened."""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.domain.plant_description import PlantDescription

from ..store import GraphStore
from .behaviour import state_machine
from .diagnosis import faults, features, symptom_rules
from .fallback import fallback_strategies
from .guarding import qualities, start_up, trips, writables
from .limits import limits
from .parameters import model_parameters
from .signals import signals
from .structure import components, equations, loops, root


def read_plant(store: GraphStore, system: NamedNode) -> PlantDescription:
    """Everything that the graph says about ``system``, a ``CPSMod:SystemModel``.

    Raises GraphError that names the first thing which is incomplete or wrong, and StoreError as the store does.
    """
    name, label = root(store, system)
    found = signals(store, system)
    tags = tuple(signal.tag for signal in found)
    stated = limits(store, system, tags)
    return PlantDescription(
        name=name,
        label=label,
        components=components(store, system),
        signals=found,
        loops=loops(store, system),
        machine=state_machine(store, system, tags),
        limits=stated,
        faults=faults(store, system),
        features=features(store, system, tags),
        symptom_rules=symptom_rules(store, system),
        parameters=model_parameters(store, system),
        fallback_strategies=fallback_strategies(store, system),
        equations=equations(store, system),
        qualities=qualities(store, system),
        trips=trips(store, system, tags),
        writables=writables(store, system),
        start_up=start_up(store, system, tags, stated),
    )
