"""Commands on plants: cases, graph check, query and export, plant keygen, sign and verify."""

from pathlib import Path
from typing import Final

from homeostat.cli.options.arguments import ENDINGS, Commands, command

FORMATS: Final = ("turtle", "nt", "trig", "jsonld")
"""Names of the formats of an exported graph, the default first."""
_OWN: Final = "name of the plant; not for other plants' graphs"


def cases(commands: Commands) -> None:
    """Declare ``homeostat cases``."""
    about = "List the installed plants, and the faults of each with nominal severity, range and unit."
    command(commands, "cases", "cases:carry_out", "list the plants and their faults", about)


def graph_check(commands: Commands) -> None:
    """Declare ``homeostat graph check``."""
    about = (
        "Check a graph. The graph of a CASE: its shapes (SHACL), its consistency, its agreement with the "
        "engineering tables that it was built from and with the process model, and whether settings and reference "
        "values fit it. That and any other graph in FILE: "
        "references to nothing, misspelt terms, swapped prefixes, transitions without guard and event, machines "
        "without an initial state, components that were left unconnected. Every problem is one line. So is every text "
        "that reads as if it were written for a language model, but that is a warning and no problem."
    )
    ending = (
        "Exit status: 0 no problem, 1 problems were found, 2 the graph cannot be read, or a generated file of "
        "CASE was altered by hand."
    )
    what = "check a plant's graph against shapes, tables and process model, or any graph for what is odd about it"
    add = command(commands, "check", "graph.check:carry_out", what, about, ending).add_argument
    add("case", nargs="?", metavar="CASE", help=_OWN)
    add("--graph", type=Path, metavar="FILE", help=f"file to check instead; {ENDINGS}")


def graph_query(commands: Commands) -> None:
    """Declare ``homeostat graph query``."""
    about = (
        "Ask a plant's graph, together with the ontologies, or a SPARQL endpoint. SELECT is answered by a "
        "table, CONSTRUCT and DESCRIBE by Turtle, ASK by yes or no."
    )
    ending = (
        "example: homeostat graph query cstr -e 'SELECT ?f ?l { ?f a hs:FaultMode ; rdfs:label ?l }'; "
        "the project's prefixes need not be declared."
    )
    made = command(commands, "query", "graph.query:carry_out", "ask a plant's graph in SPARQL", about, ending)
    made.add_argument("case", nargs="?", metavar="CASE", help=_OWN)
    question = made.add_mutually_exclusive_group().add_argument
    question("file", nargs="?", type=Path, metavar="FILE.rq", help="file with the query")
    question("-e", "--expression", metavar="SPARQL", help="the query itself")
    target = made.add_mutually_exclusive_group().add_argument
    target("--graph", type=Path, metavar="FILE", help=f"file to ask instead; {ENDINGS}")
    target("--endpoint", metavar="URL", help="SPARQL query service to ask instead")


def graph_export(commands: Commands) -> None:
    """Declare ``homeostat graph export``."""
    about = "Write a plant's graph, or that in FILE, without the ontologies, to standard output or to a file."
    what = "write a plant's graph as Turtle or another RDF format"
    add = command(commands, "export", "graph.export:carry_out", what, about).add_argument
    add("case", nargs="?", metavar="CASE", help=_OWN)
    add("--format", choices=FORMATS, default=FORMATS[0], help="default: turtle")
    add("--out", type=Path, metavar="FILE", help="file to write; it is replaced as a whole")
    add("--graph", type=Path, metavar="FILE", help=f"file to export instead; {ENDINGS}")


def plant(commands: Commands) -> None:
    """Declare ``homeostat plant keygen``, ``sign`` and ``verify``."""
    about = (
        "Write a new private key (Ed25519) to FILE, readable by its owner only, and its public half to "
        "FILE.pub. Whoever is to trust the signatures gets the public half."
    )
    key = command(commands, "keygen", "plant:keygen", "make a key to sign with", about)
    key.add_argument("file", type=Path, metavar="FILE", help="new file")
    about = (
        "Check a plant as a run would and sign the digest of its configuration: settings, tables, mapping, "
        "graph, reference values and its own code. Any later change of these makes the signature void."
    )
    add = command(commands, "sign", "plant:sign", "sign the configuration of a plant", about).add_argument
    add("case", metavar="CASE", help="name of the plant, or path of its folder")
    add("--key", type=Path, required=True, metavar="FILE", help="private key, as 'keygen' wrote it")
    add("--person", required=True, metavar="NAME", help="who signs")
    add("--reason", required=True, metavar="TEXT", help="why, for example the number of the review")
    whole = "file to write; it is replaced as a whole (default: plant.sig of the plant)"
    add("--out", type=Path, metavar="FILE", help=whole)
    about = "Say whether a trusted key has signed the configuration as it is now."
    ending = "Exit status: 0 signed by a trusted key, 1 not signed, altered since, or by another key, 2 bad usage."
    what = "check the signature under a plant's configuration"
    add = command(commands, "verify", "plant:verify", what, about, ending).add_argument
    add("case", metavar="CASE", help="name of the plant, or path of its folder")
    form = "a file, or 32 bytes in hexadecimal or base64; may be given several times"
    trusted = f"public key that is trusted: {form}"
    add("--key", action="append", required=True, metavar="PUBLIC", help=trusted)
    add("--signature", type=Path, metavar="FILE", help="signature elsewhere than with the plant")
