"""Suspicion: texts of a graph that read as if they were written for a language model and not for people.

What such a text could do is limited elsewhere: it is quoted in prompts, and what a model makes of it is judged like
anything else. This check is for the engineer who looks after the graph and wants to know that it is there.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from pyoxigraph import NamedNode

from homeostat.domain.quotation import quoted
from homeostat.knowledge.query import template
from homeostat.knowledge.store import GraphStore
from homeostat.knowledge.vocabulary import HS, UML

LONGEST: Final = 600
"""Longest text that an engineer writes into a table [characters]."""
SHOWN: Final = 80
"""Characters of a text that are shown."""
FORMAL: Final = frozenset(
    term.value
    for term in (
        HS.formula, HS.settledWhen, HS.equationText, HS.featureExpression, HS.accumulationExpression, HS.sha256,
        UML.transitionGuard,
    )
)  # fmt: skip
"""Properties whose values are formulas or digests: they are parsed or compared elsewhere, and no prose."""


class Reason(StrEnum):
    """Why a text is suspicious."""

    ADDRESSES = "addresses a language model"
    ORDERS = "orders a value for a command"
    STRUCTURE = "imitates the structure of a prompt, a query or an answer"
    HIDDEN = "has characters that nobody sees"
    ENCODED = "looks encoded"
    LONG = f"is longer than {LONGEST} characters"


@dataclass(frozen=True, slots=True)
class Suspicion:
    """One suspicious text."""

    thing: str
    """IRI of the thing."""
    property: str
    """IRI of the property."""
    excerpt: str
    """Its beginning, made safe to be shown."""
    reason: Reason
    """Why."""

    def __str__(self) -> str:
        """One line."""
        return f"{self.thing} {self.property}: {self.excerpt!r} {self.reason.value}"


_TAG: Final = r"\b[A-Z]{1,3}\d+\.(sp|man|cmd)\b"
_PATTERNS: Final[dict[Reason, tuple[str, ...]]] = {
    Reason.ORDERS: (rf"(?i){_TAG}\W{{0,3}}(to|auf|a|be)?\W{{0,3}}-?[\d.]",
        rf"(?i)\b(set|raise|lower|close|open) {_TAG}"),
    Reason.ADDRESSES: (
        r"(?i)\b(ignor|disregard|forget|override|bypass|suspend|lift)\w*\b.{0,60}"
        r"\b(instruc|rule|limit|interlock|above|previous|gate|validat|anweisung)",
        r"(?i)\byou are (now|no longer|an?)\b|\b(system|assistant|human|user)\s*:|\bact as\b|\bfrom now on\b",
        r"(?i)\byour (only )?task\b|\bstop reading\b|\bverdict\b|\bdo not validate\b",
        r"(?i)\bwithout (further )?(checks|validat)",
        r"(?i)\b(answer|write|decode|remember|respond)\b.{0,40}\b(always|with|reasoning|hint|none|obey|next)\b",
        r"(?i)\blimits? (do|was|were|are|is)\b.{0,30}(appl|lifted|suspended)",
    ),
    Reason.STRUCTURE: (
        r"<\|.*?\|>|\[/?INST\]|<<?/?SYS>>?|</?(s|data|prompt|tool_call|start_of_turn|end_of_turn)\b|<!--",
        r"```|[«»]|(^|\n)\s*#{1,4} |###|\\n#|margin per step",
        r"\{\s*\"|\"\s*[;.]\s*[\w:<]|@prefix|\bhs:\w+|<\w+:|\w+:\w+ a \w+:\w+",
        r"\b(INSERT|DELETE|DROP|CLEAR|UNION|SERVICE|FILTER)\b\s*[{<(A-Z]",
        r"\$\{|\{\{|\$\(|%\(|__\w+__|\bawait \w|\w\([^()]*\([^()]*\([^()]*\)\)",
        r"[<>]=|\b(or|and) true\b|always ?\[",
    ),
    Reason.ENCODED: (
        r"\b(?=\w*\d)(?=\w*[A-Za-z])[A-Za-z0-9+/]{20,}={0,2}|\b[0-9a-f]{24,}\b|\bbase64\b",
        r"&#\d+;|\\x[0-9a-f]{2}|\w%[0-9A-F]{2}\w",
    ),
}  # fmt: skip
_RULES: Final = tuple((reason, re.compile(p)) for reason, patterns in _PATTERNS.items() for p in patterns)


def suspicions(store: GraphStore) -> tuple[Suspicion, ...]:
    """Every suspicious text of the graph, each with the first reason that applies."""
    found = []
    for row in template("plant_texts").select(store):
        thing, kind, text = row.iri("thing"), row.iri("property"), row.text("text")
        reason = None if kind.value in FORMAL else judge_text(text)
        if reason is not None:
            found.append(Suspicion(_short(thing), _short(kind), quoted(text, SHOWN), reason))
    return tuple(found)


def judge_text(text: str) -> Reason | None:
    """Why ``text`` is suspicious; None where it is not."""
    if any(unicodedata.category(c) in ("Cc", "Cf", "Co", "Cn", "Cs") and c not in "\n\r\t" for c in text) or _crowded(
        text
    ):
        return Reason.HIDDEN
    if len(text) > LONGEST:
        return Reason.LONG
    plain = unicodedata.normalize("NFKC", text)
    return next((reason for reason, pattern in _RULES if pattern.search(plain)), None)


def _crowded(text: str) -> bool:
    """Whether marks are piled up on one letter."""
    return re.search("[\u0300-\u036f]{4}", unicodedata.normalize("NFD", text)) is not None


def _short(node: NamedNode) -> str:
    """The end of an IRI, which names the thing."""
    return quoted(re.split("[#/]", node.value)[-1], SHOWN)
