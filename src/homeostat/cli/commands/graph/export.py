"""``homeostat graph export``: a plant's graph in one of the RDF formats."""

import argparse
import sys
from typing import Final

from pyoxigraph import RdfFormat, serialize

from homeostat.cli.arguments import UsageError, apart
from homeostat.cli.commands.graph.graphs import opened, place
from homeostat.journal.beside.files import write_whole

_FORMATS: Final = dict(turtle=RdfFormat.TURTLE, nt=RdfFormat.N_TRIPLES, trig=RdfFormat.TRIG, jsonld=RdfFormat.JSON_LD)


def carry_out(options: argparse.Namespace) -> int:
    """Write the graph."""
    where = place(options.case, options.graph)
    if options.out is not None and where.plant is not None:
        apart(options.out, where.plant.files.folder, where.plant.files.contents)
    triples = opened(where).construct("CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }")
    written = serialize(triples, format=_FORMATS[options.format], prefixes=where.prefixes) or b""
    if options.out is None:
        sys.stdout.flush()
        sys.stdout.buffer.write(written)
    else:
        try:
            write_whole(options.out, written)
        except OSError as error:  # it names the temporary file
            raise UsageError(f"{str(options.out)!r} cannot be written: {error.strerror}") from error
    return 0
