"""Injection scan: texts of a graph that read as if they were written for a language model and not for people.

What such a text could do is limited elsewhere: it is quoted in prompts, and what a model makes of it is judged like
anything else. This check is for the engineer who looks after the graph and wants to know that it is there. It finds
what uses the common forms and disguises. Of orders in words of their own it finds about one in four, so a graph
without findings is no graph that can be trusted.
"""

import re
import tomllib
import unicodedata
from dataclasses import dataclass
from enum import StrEnum
from importlib import resources
from typing import Final

from pyoxigraph import NamedNode

from homeostat.domain.quotation import is_unseen, most_marks, quoted
from homeostat.knowledge.questions.query import template
from homeostat.knowledge.store.store import GraphStore, Term
from homeostat.knowledge.vocabulary.vocabulary import HS, UML

LONGEST: Final = 1500
"""Longest text that an engineer writes; the longest comment in the published graphs has 1202 [characters]."""
SHOWN: Final = 80
"""Characters of a text that are shown."""
_FORMULAS: Final = (
    HS.formula,
    HS.settledWhen,
    HS.equationText,
    HS.carrierFormula,
    HS.fallenCarrierFormula,
    HS.startUpFormula,
)
_EXPRESSIONS: Final = (HS.featureExpression, HS.accumulationExpression, HS.fastestFallExpression, UML.transitionGuard)
FORMAL: Final = frozenset(term.value for term in (*_FORMULAS, *_EXPRESSIONS, HS.sha256))
"""Properties whose values are formulas or digests: no prose, and whatever else stands there is a problem already."""
MOST_MARKS: Final = 3
"""Most combining marks that a letter of any living script carries."""
ALLOWED: Final = frozenset("\n\r\t\ufe0e\ufe0f")
"""Unseen characters of honest texts: line breaks, and what chooses between the text and the picture of a sign."""


class Reason(StrEnum):
    """Why a text is suspicious."""

    ADDRESSES = "addresses a language model"
    ORDERS = "orders a value for a command"
    STRUCTURE = "imitates the structure of a prompt, a formula, a query or an answer"
    HIDDEN = "has characters that nobody sees"
    DISGUISED = "mixes alphabets within a word"
    ENCODED = "looks encoded"
    LONG = f"is longer than {LONGEST} characters"


@dataclass(frozen=True, slots=True)
class InjectionFinding:
    """One suspicious text."""

    thing: str
    """Local name of the thing; the whole IRI where it has none."""
    property: str
    """Local name of the property."""
    excerpt: str
    """Its beginning, made safe to be shown."""
    reason: Reason
    """Why."""

    def __str__(self) -> str:
        """One line."""
        return f"{self.thing} {self.property}: {self.excerpt!r} {self.reason.value}"


_TAG: Final = r"\b[A-Z]{1,3}\d+\.(sp|man|cmd)\b"
_LIFT: Final = r"(?i)\b(ignore|disregard|discard|forget|skip)\b.{0,40}\b"
_TEXT: Final = resources.files(__package__).joinpath("injection.toml").read_text("utf-8")
_PATTERNS: Final = tomllib.loads(_TEXT.replace("@TAG@", _TAG).replace("@LIFT@", _LIFT))
_RULES: Final = tuple((Reason[name], re.compile(p)) for name, patterns in _PATTERNS.items() for p in patterns)


def injection_findings(store: GraphStore) -> tuple[InjectionFinding, ...]:
    """Every suspicious text of the store's default graph, each with the first reason that applies."""
    found = []
    for row in template("plant_texts").select(store):
        thing, kind, text = row.term("thing"), row.iri("property"), row.term("text")
        reason = judge_text(text.value) if text is not None and kind.value not in FORMAL else None
        if text is not None and reason is not None:
            found.append(InjectionFinding(_short(thing), _short(kind), quoted(text.value, SHOWN), reason))
    return tuple(found)


def judge_text(text: str) -> Reason | None:
    """Why ``text`` is suspicious; None where it is not."""
    if any(is_unseen(c) and c not in ALLOWED for c in text) or most_marks(text) > MOST_MARKS:
        return Reason.HIDDEN
    if len(text) > LONGEST:
        return Reason.LONG
    plain = unicodedata.normalize("NFKC", text)
    return next((reason for reason, pattern in _RULES if pattern.search(plain)), None)


def _short(node: Term | None) -> str:
    """The end of an IRI, which names the thing. What a store calls a thing without a name is no name."""
    if not isinstance(node, NamedNode):
        return "(no name)"
    return quoted(re.split("[#/]", node.value)[-1] or node.value, SHOWN)
