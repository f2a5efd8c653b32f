"""The whole plant, read once when a plant is opened."""

from dataclasses import replace

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.knowledge.description.behaviour import fallback_strategies, limits, prices, state_machine
from homeostat.knowledge.description.diagnosis import faults, features, symptom_rules
from homeostat.knowledge.description.guarding import qualities, start_up, trips, writables
from homeostat.knowledge.description.structure import components, equations, loops, model_parameters, root, signals
from homeostat.knowledge.store.store import GraphStore


def read_plant(store: GraphStore, system: NamedNode) -> PlantDescription:
    """What the graph says of ``system``, a ``CPSMod:SystemModel``; GraphError names the first thing that is wrong."""
    name, label, timing = root(store, system)
    found = signals(store, system)
    tags = {signal.tag.name: signal.tag for signal in found}
    stated = limits(store, system, tags, timing)
    read = PlantDescription(
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
        fallback_strategies=fallback_strategies(store, system, timing),
        equations=equations(store, system),
        qualities=qualities(store, system, timing),
        trips=trips(store, system, tags, timing),
        writables=writables(store, system, timing),
        prices=prices(store, system),
        start_up=start_up(store, system, tags, stated, timing),
        timing=timing,
    )
    return replace(read, limits=stated.with_manual(read.overridden))
