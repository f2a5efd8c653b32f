"""A plant's graph from its engineering tables: statements, rules, checks, sorted Turtle with a seal.

``python -m homeostat.knowledge.build FOLDER`` writes ``FOLDER/plant.ttl`` unless something is wrong. ``--triples FILE``
compares what an RML processor made of ``mapping.rml.ttl``, so that neither is trusted alone; for such a processor,
``--whole FOLDER`` writes the tables with every row that follows from others.
"""

import argparse
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.knowledge.build.derive import complete
from homeostat.knowledge.build.provenance import namespace_of, seal, sources, timing
from homeostat.knowledge.build.statements import MAPPED, stated, table_files
from homeostat.knowledge.build.turtle import write_turtle
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.checks.units import unknown_units
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store import answers
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.error import Code, GraphError, Mistake, refuse
from homeostat.knowledge.vocabulary.vocabulary import XSD, CPSMod

GRAPH: Final = "plant.ttl"
"""Name of the graph in a plant's folder."""


def build(folder: Path) -> bytes:
    """The graph of the plant in ``folder`` as sorted Turtle, equal for equal tables; GraphError names what is bad."""
    from homeostat.knowledge.build.tables.check import (
        refuse_bad_tables,  # a plant whose graph is there already is loaded without the schemas
    )

    refuse_bad_tables(folder)
    return mapped(folder)


def mapped(folder: Path) -> bytes:
    """As `build`, without a look at the tables first: what is wrong in them is found in the graph, or not at all."""
    namespace = namespace_of(folder)
    said = stated(folder, namespace)
    check_numbers(said)
    system = NamedNode(f"{namespace}system")
    triples = complete({*said, *timing(system, folder)}).union(sources(system, folder, table_files(folder)))
    return seal(write_turtle(triples, namespace[:-1].rpartition(":")[2], namespace))


def refuse_difference(folder: Path, other: frozenset[Triple]) -> None:
    """GraphError where ``other``, what an RML processor made of the mapping, is not what `stated` says."""
    own = stated(folder, MAPPED)
    if own != other:
        odd = min(own ^ other, key=str)
        whose = "only mapping.rml.ttl" if odd in other else "only statements.csv"
        raise GraphError(Code.BAD_MAPPING, "mapping", f"{len(own ^ other)} triples differ; {whose} makes {odd}")


def refuse_incomplete(graph: bytes) -> None:
    """GraphError where the graph breaks a shape or cannot be read into the domain's types."""
    store = _stored(graph)
    refuse([Mistake(Code.BAD_SHAPE, broken.focus, broken.message) for broken in check_shapes(store)])
    plants = store.select(f"SELECT ?plant {{ ?plant a {CPSMod.SystemModel} }}")
    for row in plants:
        read_plant(store, row.iri("plant"))


def _made_by_a_processor(file: Path) -> frozenset[Triple]:
    """The triples in ``file``; GraphError where it is no N-Triples, OSError as the file."""
    try:
        return frozenset(quad.triple for quad in parse(file.read_bytes(), format=RdfFormat.N_TRIPLES))
    except (SyntaxError, ValueError) as error:
        raise GraphError(Code.BAD_MAPPING, repr(str(file)), f"is no N-Triples: {answers.one_line(error)}") from error


def _stored(graph: bytes) -> EmbeddedStore:
    store = EmbeddedStore()
    store.load(graph, RdfFormat.TURTLE)
    return store


def check_numbers(triples: Iterable[Triple]) -> None:
    """GraphError where a number cannot be read or is not finite."""
    for triple in sorted(triples, key=str):
        term = triple.object
        if isinstance(term, Literal) and not _readable(term):
            kind = term.datatype.value.rpartition("#")[2]
            subject = str(triple.subject).rpartition("#")[2].strip("<>")
            thing = f"{subject} {triple.predicate.value.rpartition('#')[2]}"
            raise GraphError(Code.BAD_NUMBER, thing, f"{term.value!r} is no finite {kind}; correct the cell")


def _readable(term: Literal) -> bool:
    try:
        if term.datatype == XSD.double:
            return math.isfinite(float(term.value)) and "_" not in term.value
        if term.datatype == XSD.integer:
            return str(int(term.value)) == term.value
    except ValueError:
        return False
    return True


def main(arguments: list[str] | None = None) -> int:
    """Command line; 0 when the graph was written, 1 with one line on standard error when a table or a file is wrong."""
    parser = argparse.ArgumentParser(prog="python -m homeostat.knowledge.build", description=__doc__)
    parser.add_argument("folder", type=Path, help="a plant's folder, with its engineering tables")
    parser.add_argument("--triples", type=Path, help="N-Triples by an RML processor, to compare with")
    parser.add_argument("--whole", type=Path, help="write every row of the tables below this folder, and nothing else")
    parser.add_argument("--out", type=Path, help=f"file to write; FOLDER/{GRAPH} where not given")
    options = parser.parse_args(arguments)
    try:
        if options.whole:
            from homeostat.knowledge.build.whole import write_whole

            write_whole(options.folder, options.whole)
            return 0
        graph = build(options.folder)
        if options.triples:
            refuse_difference(options.folder, _made_by_a_processor(options.triples))
        refuse_incomplete(graph)
        for line in unknown_units(_stored(graph)):
            print(f"{options.folder}: warning: {line}", file=sys.stderr)
        from homeostat.journal.beside import files  # whoever only reads a graph needs no journal

        files.write_whole(options.out or options.folder / GRAPH, graph)
    except GraphError as error:
        print(f"{options.folder}: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{options.folder}: {str(error.filename)!r} cannot be used: {error.strerror}", file=sys.stderr)
        return 1
    return 0
