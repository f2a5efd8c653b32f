"""Parameters of a template: which arguments they take, and how these are written as SPARQL terms."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, TypeAlias

from pyoxigraph import Literal, NamedNode

Argument: TypeAlias = NamedNode | str | int | float | bool | tuple[NamedNode, ...]
"""What a parameter can be bound to."""

_ESCAPE: Final = re.compile(r"\\\\([uU])|\\.")
"""An escape sequence of N-Triples text; captures the letter that follows an escaped backslash, where it is u or U."""


class ParameterError(ValueError):
    """An argument that a template cannot take; the message names template, parameter, value and expected type."""


class Kind(StrEnum):
    """The type of a parameter."""

    IRI = "iri"
    IRIS = "iri*"
    STRING = "string"
    INTEGER = "integer"
    DOUBLE = "double"
    BOOLEAN = "boolean"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A place in a template that a term is bound to."""

    name: str
    """Name, as in ``$name``."""
    kind: Kind
    """Which terms it takes."""
    doc: str
    """What it means."""

    def serialise(self, template: str, value: object) -> str:
        """``value`` as SPARQL terms; ParameterError, naming ``template``, where it is not of the declared kind."""
        text = _terms(self.kind, value)
        if text is None:
            shown = repr(value)
            shown = shown if len(shown) <= 120 else f"{shown[:117]}..."
            raise ParameterError(f"template {template!r}: parameter {self.name!r} is {shown}, needs {self.kind.value}")
        return text


def _terms(kind: Kind, value: object) -> str | None:
    match kind, value:
        case Kind.IRI, NamedNode():
            return str(value)
        case Kind.IRIS, tuple() if all(isinstance(item, NamedNode) for item in value):
            return " ".join(map(str, value))
        case Kind.STRING, str():
            return _text(value)
        case Kind.BOOLEAN, bool(truth):
            return str(Literal(truth))
        case _, bool():  # which is an int to Python
            return None
        case Kind.DOUBLE, float(number) if math.isfinite(number):
            return str(Literal(float(number)))
        case Kind.DOUBLE, int(number) if abs(number) < 2**63:
            return str(Literal(float(number)))
        case Kind.INTEGER, int(number) if abs(number) < 2**63:
            return str(Literal(number))
    return None


def _text(value: str) -> str | None:
    try:
        text = str(Literal(value))
    except ValueError:  # half of a surrogate pair is no character
        return None
    # Some stores decode \uXXXX before they look for the end of a string; a text that holds those very characters would
    # then be decoded too, and could end its string. Writing the u itself as an escape leaves nothing to decode twice.
    return _ESCAPE.sub(lambda found: f"\\\\\\u00{ord(found[1]):02X}" if found[1] else found[0], text)
