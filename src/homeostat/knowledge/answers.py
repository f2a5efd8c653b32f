"""Reading what pyoxigraph hands out: solutions, graphs, and parser messages."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import QueryResultsFormat, QuerySolutions, Triple, parse_query_results

from .store import Row


def rows(solutions: QuerySolutions) -> tuple[Row, ...]:
    """Solutions as rows, in the order given."""
    names = tuple(variable.value for variable in solutions.variables)
    return tuple(Row(names, tuple(solution)) for solution in solutions)


def results(body: bytes) -> tuple[Row, ...] | bool:
    """What a document of SPARQL JSON results says; SyntaxError or ValueError where it is none."""
    parsed = parse_query_results(body, QueryResultsFormat.JSON)
    return rows(parsed) if isinstance(parsed, QuerySolutions) else bool(parsed)


def graph(triples: Iterable[Triple]) -> tuple[Triple, ...]:
    """Triples as a graph: each once, sorted by its N-Triples text."""
    return tuple(sorted(set(triples), key=str))


def one_line(text: object, limit: int = 300) -> str:
    """``text`` without line breaks, cut after ``limit`` characters, for messages."""
    flat = " ".join(str(text).split())
    return flat if len(flat) <= limit else flat[: limit - 3] + "..."
