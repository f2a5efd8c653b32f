"""Contexts: an answer of the graph as the compact Turtle that an agent is shown, within a stated budget of tokens."""

import json
import re
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.domain.quotation import quoted
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, RDF, RDFS, VDI3682, XSD

UNREACHED: Final = 99
"""Distance of what is not connected to the seeds [hops]."""
NAMED: Final = frozenset({RDFS.label, VDI3682.isAssignedTo})
"""What is said of things that are told apart by it rather than explained."""
TEXT_LIMIT: Final = 120
"""Longest text that is shown [characters]."""
_NUMBER: Final = re.compile(r"[+-]?(\d{1,20}(\.\d{0,20})?|\.\d{1,20})([eE][+-]?\d{1,3})?", re.ASCII)
PLAIN: Final = {kind: _NUMBER for kind in (XSD.integer, XSD.decimal, XSD.double)} | {
    XSD.boolean: re.compile("true|false")
}
"""Datatype -> what is written without quotes. A literal may claim any type, so its text is looked at as well."""


@dataclass(frozen=True, slots=True)
class Context:
    """The part of a subgraph, or of what was found otherwise, that fits a budget."""

    text: str
    """One thing per line, nearest first: compact Turtle with the T-Box's prefixes, ``:`` is the plant's; or text."""
    tokens: int
    """Tokens of the text."""
    budget: int
    """Tokens that it might have had."""
    shown: int
    """Things that are shown."""
    left_out: tuple[str, ...]
    """Things that did not fit, nearest first."""

    @property
    def omission(self) -> str:
        """One sentence on what was left out; empty where nothing was."""
        if not self.left_out:
            return ""
        return f"{len(self.left_out)} things did not fit and are left out: {', '.join(self.left_out[:6])}" + (
            ", ..." if len(self.left_out) > 6 else ""
        )


def context(
    triples: Iterable[Triple], seeds: Sequence[NamedNode], namespace: str, budget: int, count: Callable[[str], int]
) -> Context:
    """The things nearest to ``seeds`` that fit ``budget`` tokens as ``count`` counts them.

    Nearness is the number of statements between a thing and the nearest seed, whatever their direction. Of what is
    connected to the seeds, things with a label or a place among the modules come last: equations and loops say more.
    A thing is shown with everything that ``triples`` say about it, or not at all; one that does not fit does not end
    the list. ``namespace`` is the plant's own.
    """
    about: dict[str, list[Triple]] = {}
    for triple in set(triples):
        assert isinstance(triple.subject, NamedNode)
        about.setdefault(triple.subject.value, []).append(triple)
    hops = _hops(about, seeds)
    lines: list[str] = []
    left_out: list[str] = []
    tokens = 0

    def order(thing: str) -> tuple[bool, bool, bool, int, str]:
        far = hops.get(thing, UNREACHED)
        return far > 0, far >= UNREACHED, any(t.predicate in NAMED for t in about[thing]), far, thing

    for thing in sorted(about, key=order):
        line = _line(about[thing], namespace)
        cost = count(f"{line}\n")
        if tokens + cost <= budget:
            lines.append(line)
            tokens += cost
        else:
            left_out.append(_name(NamedNode(thing), namespace).removeprefix(":"))
    return Context("\n".join(lines), tokens, budget, len(lines), tuple(left_out))


def _hops(about: dict[str, list[Triple]], seeds: Sequence[NamedNode]) -> dict[str, int]:
    """IRI -> statements between it and the nearest seed."""
    near: dict[str, set[str]] = {}
    for thing, triples in about.items():
        for triple in triples:
            if isinstance(triple.object, NamedNode) and triple.predicate != RDF.type:
                near.setdefault(thing, set()).add(triple.object.value)
                near.setdefault(triple.object.value, set()).add(thing)
    found = {seed.value: 0 for seed in seeds}
    queue = deque(found)
    while queue:
        here = queue.popleft()
        for there in sorted(near.get(here, ())):
            if there not in found:
                found[there] = found[here] + 1
                queue.append(there)
    return found


def _line(triples: list[Triple], namespace: str) -> str:
    """Everything about one thing in one line; equal triples give equal lines."""
    by_predicate: dict[str, list[str]] = {}
    subject = triples[0].subject
    for triple in sorted(triples, key=lambda t: (t.predicate != RDF.type, t.predicate.value, str(t.object))):
        verb = "a" if triple.predicate == RDF.type else _name(triple.predicate, namespace)
        by_predicate.setdefault(verb, []).append(_term(triple.object, namespace))
    said = "; ".join(f"{verb} {', '.join(objects)}" for verb, objects in by_predicate.items())
    return f"{_name(subject, namespace)} {said}."


def _term(term: object, namespace: str) -> str:
    if isinstance(term, Literal):
        form = PLAIN.get(term.datatype)
        plain = form is not None and form.fullmatch(term.value) is not None
        return term.value if plain else json.dumps(quoted(term.value, TEXT_LIMIT), ensure_ascii=False)
    return _name(term, namespace)


def _name(term: object, namespace: str) -> str:
    assert isinstance(term, NamedNode)
    for prefix, iri in (("", namespace), *PREFIXES):
        if term.value.startswith(iri):
            return f"{prefix}:{quoted(term.value[len(iri) :], TEXT_LIMIT)}"
    return f"<{quoted(term.value, TEXT_LIMIT)}>"
