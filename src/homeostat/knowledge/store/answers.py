"""Reading what pyoxigraph hands out: solutions, graphs, and parser messages.

What a store answers must be let go of in the thread that asked. A frame can outlive its call, in the hands of a
traceback or of a profiler in another thread, and its variables with it; so whoever has an answer in one deletes it.
"""

from collections.abc import Iterable

from pyoxigraph import QueryResultsFormat, QuerySolutions, Triple, parse_query_results

from homeostat.knowledge.store.store import Solution


def rows(solutions: QuerySolutions) -> tuple[Solution, ...]:
    """Solutions as rows, in the order given."""
    names = tuple(variable.value for variable in solutions.variables)
    try:
        found = list(map(tuple, solutions))  # a comprehension has a frame of its own in some versions of Python
    finally:
        del solutions
    return tuple(Solution(names, values) for values in found)


def results(body: bytes) -> tuple[Solution, ...] | bool:
    """What a document of SPARQL JSON results says; SyntaxError or ValueError where it is none."""
    parsed = parse_query_results(body, QueryResultsFormat.JSON)
    try:
        return rows(parsed) if isinstance(parsed, QuerySolutions) else bool(parsed)
    finally:
        del parsed


def graph(triples: Iterable[Triple]) -> tuple[Triple, ...]:
    """Triples as a graph: each once, sorted by its N-Triples text."""
    try:
        found = set(triples)
    finally:
        del triples
    return tuple(sorted(found, key=str))


def one_line(text: object, limit: int = 300) -> str:
    """``text`` without line breaks, cut after ``limit`` characters, for messages."""
    flat = " ".join(str(text).split())
    return flat if len(flat) <= limit else flat[: limit - 3] + "..."
