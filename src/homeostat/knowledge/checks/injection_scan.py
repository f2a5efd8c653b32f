"""Injection scan: texts of a graph that read as if they were written for a language model and not for people.

What such a text could do is limited elsewhere: it is quoted in prompts, and what a model makes of it is judged like
anything else. This check is for the engineer who looks after the graph and wants to know that it is there. It finds
what uses the common forms and disguises. Of orders in words of their own it finds about one in four, so a graph
without findings is no graph that can be trusted.
"""

import re
import unicodedata
from dataclasses import dataclass
from enum import StrEnum
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
_FORMULAS: Final = (HS.formula, HS.settledWhen, HS.equationText, HS.carrierFormula, HS.startUpFormula)
_EXPRESSIONS: Final = (HS.featureExpression, HS.accumulationExpression, UML.transitionGuard)
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
# Words alone prove nothing in a plant: there are bypass valves, gate valves, limits that apply, SERVICE WATER pumps.
# So a pattern is a word together with what only a model, a prompt or a parser has use for.
_PATTERNS: Final[dict[Reason, tuple[str, ...]]] = {
    Reason.DISGUISED: (r"[A-Za-z][\u0400-\u04ff]|[\u0400-\u04ff][A-Za-z]",),
    Reason.ORDERS: (
        rf"(?i){_TAG}\W{{0,3}}(to|auf|a|à|be|is|на|设为)?\W{{0,3}}-?[\d.]",
        rf"(?i)\b(set|raise|lower|close|open) {_TAG}",
    ),
    Reason.ADDRESSES: (
        # lifts what was said before, in the imperative
        _LIFT + r"(instructions?|guidelines?|directions?|previous|commands)\b",
        _LIFT + r"(rules|limits|interlocks?|gate|safety checks)\b",
        r"(?i)\b(ignore|disregard|discard|forget|override) (every|all|any)|\boverride code\b",
        r"(?i)\bnew (instruction|task|goal)|\b(previous|prior) (instruction|rules)",
        r"(?i)\b(ignor|vergiss|oubli|olvid)\w*.{0,40}\b(anweisung|regel|règle|regla|instruc|consigne)",
        r"(?i)\b(игнорир|забуд)\w*.{0,40}(инструкц|правил)|(忽略|无视|忘记).{0,20}(指令|指示|规则)|指示を無視",
        r"(?i)\b(instructions?|guidelines|rules|words) (above|before|you were)\b",
        r"(?i)\blimits? ((do|does) not apply|(was|were|is|are) (lifted|suspended))\b",
        r"(?i)\bwithout (further )?(checks|validation)\b|\bdo not validate\b",
        # speaks to a reader that is a model
        r"(?i)\byou are (now|no longer|an?)\b|\bas an AI\b|\bfrom now on,? you\b|\bwhoever reads\b",
        r"(?i)(^|[\n.!?»-])\s*(assistant|human)\s*:|\bstop reading (here|this)\b",
        r"(?i)\b(note|message) (to|for) (the|any) (agent|assistant|model|reader)\b",
        r"(?i)\bthe (assistant|validator) (should|must|will|may|is|has)\b",
        r"(?i)\b(language model|LLM|chatbot|jailbreak|system (prompt|message)|end of (data|prompt|context))\b",
        r"(?i)\bact as (the|an?) (operator|engineer|assistant|model|agent|gate|system)\b",
        # speaks of what only a model is asked for
        r"(?i)\byour (\w+ )?(task|goal|answer|reply|response|output|proposal|instructions?|role|rules)\b",
        r"(?i)\b(answer|respond|reply) (none|only|with)\b|\bverdict\b|\breasoning\b|\b(into|in) the hint\b",
        r"(?i)\bremember (this|for the next)\b|\band obey\b",
    ),
    Reason.STRUCTURE: (
        r"<\|.*?\|>|\[/?(INST|SYSTEM)\]|<</?SYS>>|</?(s|bos|eos|data|prompt|system|[a-z]+_[a-z_]+)>|<!--",
        r"```|^\W*»\s|»\s*[#\n]|«\s*«|»\s*»|(^|\n)\s*#{1,4} [A-Za-z]|###|\\n#",
        rf"(?i)margin per step|holds only just|refused so far|operator's note:|{_TAG} «",
        r"\{\s*\"|\"\s*[;.]\s*[<:]|\"\s*;\s*\w+:|\"@\w+\s*[.;]|@prefix|\bhs:\w+ (true|false|-?\d|[\"<:])",
        r"<\w+:[^>]*>\s*<\w+:|(?<!\S)\w*:\w+ a \w*:\w+",
        r"\b(INSERT|DELETE) (DATA|WHERE|\{)|\b(DROP|CLEAR) (ALL|DEFAULT|GRAPH|NAMED|SILENT)\b",
        r"\b(UNION|WHERE|OPTIONAL)\s*\{|\bSERVICE\s*<|\bFILTER\s*\(\s*(\?|true|false|regex|not|bound)",
        r"\$\{|\{\{|\$\(|%\(|__\w+__|\bawait \w+\.|\w\([^()]*\([^()]*\([^()]*\)\)",
        r"\b[A-Z]{1,3}\d+ ?[<>]= ?-?\d|\balways ?\[",
    ),
    Reason.ENCODED: (
        r"\b(?=\w*\d)(?=\w*[a-z])(?=\w*[A-Z])[A-Za-z0-9+/]{20,}={0,2}|\b[0-9a-f]{24,}\b|\bbase64\b",
        r"&#\d+;|\\x[0-9a-f]{2}|\w%[0-9A-F]{2}\w",
    ),
}
_RULES: Final = tuple((reason, re.compile(p)) for reason, patterns in _PATTERNS.items() for p in patterns)


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
