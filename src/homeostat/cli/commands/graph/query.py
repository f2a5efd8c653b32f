"""``homeostat graph query``: a question in SPARQL to a plant's graph."""

import argparse
import re
import sys
from pathlib import Path
from typing import Final

from pyoxigraph import Literal, NamedNode, RdfFormat, serialize

from homeostat.cli.arguments import UsageError
from homeostat.cli.commands.graph.graphs import Place, place, with_ontology
from homeostat.cli.table import show_table
from homeostat.knowledge.store.endpoint import SparqlEndpoint
from homeostat.knowledge.store.store import GraphStore, QueryRejected, Term
from homeostat.knowledge.vocabulary.former import TERMS
from homeostat.knowledge.vocabulary.vocabulary import HS

_FORM: Final = re.compile(
    r"(?:\s|\#[^\n]*(?:\n|$)|(?:prefix\s*[^\s:]*:\s*|base\s*)<[^<>]*>)*(select|ask|construct|describe)\b", re.IGNORECASE
)
"""What stands before the word that says which form a query has."""


def carry_out(options: argparse.Namespace) -> int:
    """Print the answer."""
    plant, file = _words(options)
    text = options.expression if file is None else _read(file)
    found = _FORM.match(text)
    if found is None:
        raise UsageError("only SELECT, ASK, CONSTRUCT and DESCRIBE can be asked; this query starts with none of them")

    for former, term in TERMS.items():
        if re.search(rf"(\bhs:|{re.escape(HS.iri)}){former.value.removeprefix(HS.iri)}\b", text):
            print(f"homeostat: {_short(former)} is called {_short(term)} today; ask for that", file=sys.stderr)
    where = place(plant, options.graph, fresh=options.endpoint is None)
    store = with_ontology(where) if options.endpoint is None else _endpoint(options.endpoint)
    try:
        # The project's prefixes come before the query's own, which count; lines are counted from its own first one.
        _answer(
            store,
            "".join(f"PREFIX {n}: <{iri}>\n" for n, iri in where.prefixes.items()) + text,
            found[1].lower(),
            where,
        )
    except QueryRejected as error:
        own = re.sub(r"\bat (\d+):(?=\d)", lambda at: f"at {int(at[1]) - len(where.prefixes)}:", str(error))
        raise UsageError(own) from error
    return 0


def _short(term: NamedNode) -> str:
    return f"hs:{term.value.removeprefix(HS.iri)}"


def _words(options: argparse.Namespace) -> tuple[str | None, Path | None]:
    """Plant and query file. A graph in a file needs no plant: a single word is the query file then."""
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
    try:
        return SparqlEndpoint(url, url, url, url)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _answer(store: GraphStore, query: str, form: str, where: Place) -> None:
    if form == "ask":
        print("yes" if store.ask(query) else "no")
    elif form == "select":
        rows = store.select(query)
        if not rows:
            print("no solution")
            return
        cells = [[_cell(term, where) for term in row.terms] for row in rows]
        show_table([f"?{name}" for name in rows[0].variables], cells)
    else:
        turtle = serialize(store.construct(query), format=RdfFormat.TURTLE, prefixes=where.prefixes)
        sys.stdout.flush()
        sys.stdout.buffer.write(turtle or b"")


def _cell(term: Term | None, where: Place) -> str:
    """A term as a reader wants it: names with prefixes, texts and numbers as they are."""
    if term is None:
        return ""
    if isinstance(term, Literal):
        return term.value
    if isinstance(term, NamedNode):
        for name, iri in where.prefixes.items():
            if term.value.startswith(iri):
                return f"{name}:{term.value.removeprefix(iri)}"
    return str(term)
