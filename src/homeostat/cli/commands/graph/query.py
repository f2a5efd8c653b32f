"""``homeostat graph query``: a question in SPARQL to a plant's graph."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from homeostat.cli.options.arguments import ENDINGS, UsageError

if TYPE_CHECKING:
    from homeostat.cli.commands.graph.graphs import Place
    from homeostat.cli.options.arguments import Commands
    from homeostat.knowledge.store.store import GraphStore, Term

_FORM: Final = re.compile(
    r"(?:\s|\#[^\n]*(?:\n|$)|(?:prefix\s*[^\s:]*:\s*|base\s*)<[^<>]*>)*(select|ask|construct|describe)\b", re.IGNORECASE
)
"""What stands before the word that says which form a query has."""


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "query",
        help="ask a plant's graph in SPARQL",
        description="Ask a plant's graph, together with the ontologies, or a SPARQL endpoint. SELECT is answered by a "
        "table, CONSTRUCT and DESCRIBE by Turtle, ASK by yes or no.",
        epilog="example: homeostat graph query cstr -e 'SELECT ?f ?l { ?f a hs:FaultMode ; rdfs:label ?l }'; "
        "the project's prefixes need not be declared.",
        allow_abbrev=False,
    )
    command.add_argument("case", nargs="?", metavar="CASE", help="name of the plant; not for other plants' graphs")
    question = command.add_mutually_exclusive_group()
    question.add_argument("file", nargs="?", type=Path, metavar="FILE.rq", help="file with the query")
    question.add_argument("-e", "--expression", metavar="SPARQL", help="the query itself")
    target = command.add_mutually_exclusive_group()
    target.add_argument("--graph", type=Path, metavar="FILE", help=f"file to ask instead; {ENDINGS}")
    target.add_argument("--endpoint", metavar="URL", help="SPARQL query service to ask instead")
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Print the answer."""
    case, file = _words(options)
    text = options.expression if file is None else _read(file)
    found = _FORM.match(text)
    if found is None:
        raise UsageError("only SELECT, ASK, CONSTRUCT and DESCRIBE can be asked; this query starts with none of them")
    from homeostat.cli.commands.graph.graphs import place, with_ontology
    from homeostat.knowledge.store.store import QueryRejected

    where = place(case, options.graph)
    store = with_ontology(where) if options.endpoint is None else _endpoint(options.endpoint)
    try:
        _answer(store, _with_prefixes(text, where), found[1].lower(), where)
    except QueryRejected as error:
        raise UsageError(_in_own_lines(str(error), len(where.prefixes))) from error
    return 0


def _words(options: argparse.Namespace) -> tuple[str | None, Path | None]:
    """Case and query file. A graph in a file needs no case: a single word is the query file then."""
    if options.file is not None or options.expression is not None:
        return options.case, options.file
    if options.case is None or options.graph is None:
        raise UsageError("there is no query; name a FILE.rq, or write it after -e")
    return None, Path(options.case)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise UsageError(f"query file {str(path)!r} is not UTF-8 text") from None


def _endpoint(url: str) -> GraphStore:
    from homeostat.knowledge.store.endpoint import SparqlEndpoint

    try:
        return SparqlEndpoint(url, url, url, url)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _with_prefixes(text: str, where: Place) -> str:
    """The query after the project's prefixes; those that it declares itself come later and count."""
    return "".join(f"PREFIX {name}: <{iri}>\n" for name, iri in where.prefixes.items()) + text


def _in_own_lines(message: str, added: int) -> str:
    """A parser's message with the line counted from the query's own first line."""
    return re.sub(r"\bat (\d+):(?=\d)", lambda found: f"at {int(found[1]) - added}:", message)


def _answer(store: GraphStore, query: str, form: str, where: Place) -> None:
    from homeostat.cli.table import table

    if form == "ask":
        print("yes" if store.ask(query) else "no")
    elif form == "select":
        rows = store.select(query)
        if not rows:
            print("no solution")
            return
        cells = [[_cell(term, where) for term in row.terms] for row in rows]
        for line in table([f"?{name}" for name in rows[0].variables], cells):
            print(line)
    else:
        from pyoxigraph import RdfFormat, serialize

        turtle = serialize(store.construct(query), format=RdfFormat.TURTLE, prefixes=where.prefixes)
        sys.stdout.flush()
        sys.stdout.buffer.write(turtle or b"")


def _cell(term: Term | None, where: Place) -> str:
    """A term as a reader wants it: names with prefixes, texts and numbers as they are."""
    from pyoxigraph import Literal, NamedNode

    if term is None:
        return ""
    if isinstance(term, Literal):
        return term.value
    if isinstance(term, NamedNode):
        for name, iri in where.prefixes.items():
            if term.value.startswith(iri):
                return f"{name}:{term.value.removeprefix(iri)}"
    return str(term)
