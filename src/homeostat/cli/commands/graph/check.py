"""``homeostat graph check``: does a graph have lint, and does a plant's own fit shapes, tables and model?"""

import argparse
from collections.abc import Iterator

from pyoxigraph import RdfFormat

from homeostat.cli.commands.graph.graphs import Place, PlantGraph, opened, place
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable
from homeostat.knowledge.build.build import GRAPH, build
from homeostat.knowledge.build.provenance import source_words, stale_tables
from homeostat.knowledge.build.tables.check import mistakes
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.checks.consistency import inconsistencies
from homeostat.knowledge.checks.injection_scan import injection_findings
from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.checks.units import unknown_units
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore
from homeostat.plants.equations import unit_mistakes
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines, refuse_altered
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import refuse_altered_graph
from homeostat.plants.files.graph import interface
from homeostat.plants.model import find_model
from homeostat.plants.settings.check import refuse_misfit, refuse_misnamed
from homeostat.plants.settings.defaults import completed


def carry_out(options: argparse.Namespace) -> int:
    """Print every problem; 1 where there is any."""
    where = place(options.case, options.graph, fresh=False)
    if where.plant is not None and where.own:
        refuse_altered_graph(where.plant.files)
        if BASELINES in where.plant.files.contents:
            refuse_altered(where.plant.files.contents[BASELINES])
    store = opened(where)
    count = 0
    for problem in _problems(where, store):
        print(" ".join(problem.split()))
        count += 1
    suspicious = injection_findings(store)
    for finding in suspicious:
        print(f"warning: {finding}")
    warnings = len(suspicious)
    unknown = unknown_units(store)
    for line in unknown:
        print(f"warning: {printable(line)}")
    told = f"{count} problem{'' if count == 1 else 's'}" if count else "no problem"
    print(
        f"{where.path}: {told}"
        + (f", {warnings} suspicious text{'' if warnings == 1 else 's'}" if warnings else "")
        + (f", {len(unknown)} unknown unit{'' if len(unknown) == 1 else 's'}" if unknown else "")
    )
    return 1 if count else 0


def _problems(where: Place, store: GraphStore) -> Iterator[str]:
    yield from map(str, lint(store))
    if where.plant is not None:
        found = [*_disagreements(where.plant, store)]
        if where.own:
            bad = tuple(map(str, mistakes(where.plant.files.folder)))
            found += bad or _other_than_built(where.plant)
        yield from found
        if not found:  # the plant's code runs after what can be checked without it
            yield from _misfits(where.plant, read_plant(store, where.plant.system))


def _other_than_built(plant: PlantGraph) -> Iterator[str]:
    """Where the plant's graph is not what its tables make, although it says that they have not changed."""
    graph = plant.files.content(GRAPH)
    try:
        if stale_tables(plant.files.folder, graph) or build(plant.files.folder) == graph:
            return
    except GraphError as error:
        yield str(error)
        return
    yield (
        f"[{Code.STALE_GRAPH}] {GRAPH}: is not what its tables make: another version built it, or it was altered and "
        f"given a new hash; run 'python -m homeostat.knowledge.build {plant.files.folder}'"
    )


def _disagreements(plant: PlantGraph, store: GraphStore) -> Iterator[str]:
    """Where the graph does not have the shapes, or does not fit the plant's tables and settings."""
    for table in stale_tables(plant.files.folder, store.dump(RdfFormat.N_TRIPLES), RdfFormat.N_TRIPLES):
        remedy = f"run 'python -m homeostat.knowledge.build {plant.files.folder}'"
        yield f"[{Code.STALE_GRAPH}] {source_words(table)}: changed after the graph was built; {remedy}"
    yield from map(str, check_shapes(store))
    try:
        described = read_plant(store, plant.system)
    except GraphError as error:
        yield str(error)  # what cannot be read cannot be compared
        return
    try:
        refuse_misnamed(plant.name, completed(plant.name, plant.settings, described), described)
    except PlantError as error:
        yield str(error)


def _misfits(plant: PlantGraph, described: PlantDescription) -> Iterator[str]:
    """Where the graph, settings or reference values do not fit the plant's process model."""
    model = find_model(plant.files, plant.settings.model, described)
    yield from map(str, inconsistencies(described, interface(model, plant.settings.twin.settings.horizon_s)))
    yield from unit_mistakes(plant.name, described, model)
    try:
        refuse_misfit(plant.name, completed(plant.name, plant.settings, described), described, model)
        if BASELINES in plant.files.contents:
            read_baselines(plant.files.contents[BASELINES], described)
    except (PlantError, GraphError) as error:
        yield str(error)
