"""Units that no other program will know: symbols that the table of units has not, where QUDT is not named either."""

from collections import defaultdict
from typing import Final

from pyoxigraph import NamedNode

from homeostat.knowledge.checks.statements import local_name
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.units import known_units
from homeostat.knowledge.vocabulary.vocabulary import HS, QUDT
from homeostat.stl.spelling import near_matches

_QUESTION: Final = f"""SELECT ?thing ?symbol WHERE {{
  ?thing {HS.unit} ?symbol FILTER(isIRI(?thing) && isLiteral(?symbol))
  FILTER NOT EXISTS {{ ?thing {QUDT.hasUnit} ?unit }}
}} ORDER BY ?symbol ?thing"""


def unknown_units(store: GraphStore) -> tuple[str, ...]:
    """One line for each symbol that has no unit of QUDT, sorted; nothing depends on it but what others can read."""
    having: dict[str, list[NamedNode]] = defaultdict(list)
    for row in store.select(_QUESTION):
        if (symbol := row.text("symbol")) not in known_units():
            having[symbol].append(row.iri("thing"))
    return tuple(_told(symbol, things) for symbol, things in having.items())


def _told(symbol: str, things: list[NamedNode]) -> str:
    more = f" and {len(things) - 1} more have" if len(things) > 1 else " has"
    near = near_matches(symbol, known_units())
    told = f"unit {symbol[:80]!r}: {local_name(things[0])!r}{more} it, and no unit of QUDT is known for it{near}"
    return f"{told}; write the symbol that the package has, or add a row to knowledge/vocabulary/units.csv"
