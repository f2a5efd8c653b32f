"""``homeostat graph export``: a plant's graph in one of the RDF formats."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.options.arguments import ENDINGS, UsageError

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands

FORMATS = ("turtle", "nt", "trig", "jsonld")
"""Names of the formats, the default first."""


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "export",
        help="write a plant's graph as Turtle or another RDF format",
        description="Write a plant's graph, or that in FILE, without the ontologies, to standard output or to a file.",
        allow_abbrev=False,
    )
    command.add_argument("case", nargs="?", metavar="CASE", help="name of the plant; not for other plants' graphs")
    command.add_argument("--format", choices=FORMATS, default=FORMATS[0], help="default: turtle")
    command.add_argument("--out", type=Path, metavar="FILE", help="file to write; it is replaced as a whole")
    command.add_argument("--graph", type=Path, metavar="FILE", help=f"file to export instead; {ENDINGS}")
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Write the graph."""
    from pyoxigraph import RdfFormat, serialize

    from homeostat.cli.commands.graph.graphs import opened, place
    from homeostat.journal.files import write_whole

    formats = dict(
        zip(FORMATS, (RdfFormat.TURTLE, RdfFormat.N_TRIPLES, RdfFormat.TRIG, RdfFormat.JSON_LD), strict=True)
    )
    where = place(options.case, options.graph)
    triples = opened(where).construct("CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }")
    written = serialize(triples, format=formats[options.format], prefixes=where.prefixes) or b""
    if options.out is None:
        sys.stdout.flush()
        sys.stdout.buffer.write(written)
    else:
        try:
            write_whole(options.out, written)
        except OSError as error:  # it names the temporary file
            raise UsageError(f"{str(options.out)!r} cannot be written: {error.strerror}") from error
    return 0
