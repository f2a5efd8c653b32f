"""Questions as files: SPARQL templates with typed parameters that are bound as RDF terms.

A template is a file ``queries/<name>.rq`` that is valid SPARQL by itself. Its first lines are comments that declare it:

    # form: SELECT
    # doc: The transitions of a state machine.
    # param machine: iri -- the state machine
    # param faults: iri* -- faults to reckon with

In the text, ``$machine`` stands for the term. A parameter of several terms (``iri*``) may stand only in
``VALUES ?variable { $faults }``. Binding replaces whole tokens by terms that pyoxigraph has serialised, never text by
text, and never inside strings, IRIs or comments; so an argument cannot change the shape of a query.
"""

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib import resources
from typing import Final, TypeAlias

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.store.store import GraphStore, Solution
from homeostat.stl.spelling import near_matches

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


_TOKEN: Final = re.compile(
    r"""(?P<iri><[^<>"{}|^`\\\x00-\x20]*>)
      | (?P<string>\"\"\"(?:[^\\]|\\.)*?\"\"\"|'''(?:[^\\]|\\.)*?'''|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')
      | (?P<comment>\#[^\n]*)
      | \$(?P<parameter>[A-Za-z_]\w*)
      | \?(?P<variable>[A-Za-z_]\w*)""",
    re.VERBOSE | re.DOTALL,
)
_DECLARATION: Final = re.compile(r"param (?P<name>[a-z_]+): (?P<kind>[a-z]+\*?) -- (?P<doc>.+)")
_LIST_PLACE: Final = re.compile(r"VALUES \?\w+ \{ \$(\w+) \}")


class TemplateError(ValueError):
    """A template file that contradicts itself; the message names the file."""


class Form(StrEnum):
    """The form of a query or update, which decides the type of its answer."""

    SELECT = "SELECT"
    CONSTRUCT = "CONSTRUCT"
    ASK = "ASK"
    UPDATE = "UPDATE"


@dataclass(frozen=True, slots=True)
class Template:
    """One question, ready to be bound and asked."""

    name: str
    """Name of the file without its ending."""
    form: Form
    """Form of the query."""
    doc: str
    """What the answer is."""
    parameters: tuple[Parameter, ...]
    """Its parameters, in the order declared."""
    text: str
    """The file as read."""

    def bind(self, arguments: Mapping[str, Argument]) -> str:
        """The query with every parameter replaced by its term; ParameterError where an argument does not fit."""
        known = {parameter.name: parameter for parameter in self.parameters}
        if wrong := sorted(known.keys() ^ arguments.keys()):
            what = "unknown" if wrong[0] in arguments else "missing"
            takes = ", ".join(f"{parameter.name}: {parameter.kind.value}" for parameter in self.parameters)
            raise ParameterError(f"template {self.name!r}: parameter {wrong[0]!r} is {what}, takes {takes or 'none'}")
        terms = {name: known[name].serialise(self.name, value) for name, value in arguments.items()}
        return _TOKEN.sub(lambda token: terms[token["parameter"]] if token["parameter"] else token[0], self.text)

    def select(self, store: GraphStore, **arguments: Argument) -> tuple[Solution, ...]:
        """Ask a SELECT template."""
        self._expect(Form.SELECT)
        return store.select(self.bind(arguments))

    def construct(self, store: GraphStore, **arguments: Argument) -> tuple[Triple, ...]:
        """Ask a CONSTRUCT template."""
        self._expect(Form.CONSTRUCT)
        return store.construct(self.bind(arguments))

    def ask(self, store: GraphStore, **arguments: Argument) -> bool:
        """Ask an ASK template."""
        self._expect(Form.ASK)
        return store.ask(self.bind(arguments))

    def update(self, store: GraphStore, **arguments: Argument) -> None:
        """Carry an UPDATE template out."""
        self._expect(Form.UPDATE)
        store.update(self.bind(arguments))

    def _expect(self, form: Form) -> None:
        if self.form is not form:
            raise TypeError(f"template {self.name!r} has form {self.form}, not {form}")


def parse(name: str, text: str) -> Template:
    """The template in ``text``; TemplateError where its declarations and its text disagree."""
    heads: dict[str, str] = {}
    parameters: list[Parameter] = []
    for line in text.splitlines():
        if not line.startswith("# "):
            break
        declaration = _DECLARATION.fullmatch(line[2:])
        key, colon, value = line[2:].partition(": ")
        if declaration and declaration["kind"] in set(Kind):
            parameters.append(Parameter(declaration["name"], Kind(declaration["kind"]), declaration["doc"]))
        elif colon and key in ("form", "doc") and key not in heads:
            heads[key] = value.strip()
        else:
            raise TemplateError(f"template {name!r}: cannot read the declaration {line!r}")
    if heads.get("form") not in set(Form) or not heads.get("doc"):
        raise TemplateError(f"template {name!r}: needs '# form: {'|'.join(Form)}' and '# doc: ...' at its top")
    _check_use(name, parameters, text)
    return Template(name, Form(heads["form"]), heads["doc"], tuple(parameters), text)


def _check_use(name: str, parameters: list[Parameter], text: str) -> None:
    tokens = list(_TOKEN.finditer(text))
    used = {token["parameter"] for token in tokens if token["parameter"]}
    declared = [parameter.name for parameter in parameters]
    if used != set(declared) or len(declared) != len(set(declared)):
        raise TemplateError(f"template {name!r}: declares parameters {sorted(declared)}, uses {sorted(used)}")
    if clash := used & {token["variable"] for token in tokens}:
        raise TemplateError(f"template {name!r}: {sorted(clash)[0]!r} is both a parameter and a variable; rename one")
    places = {match.start(1) - 1 for match in _LIST_PLACE.finditer(text)}
    lists = {parameter.name for parameter in parameters if parameter.kind is Kind.IRIS}
    for token in tokens:
        wanted = token["parameter"]
        if wanted and (wanted in lists) != (token.start() in places):
            place = f"'VALUES ?variable {{ ${wanted} }}'"
            raise TemplateError(
                f"template {name!r}: '${wanted}' must stand in {place} if and only if its type ends in *"
            )


@functools.cache
def template(name: str) -> Template:
    """The template ``queries/<name>.rq`` of this package; KeyError naming the nearest names where there is none."""
    if name not in names():
        raise KeyError(f"no template {name!r}{near_matches(name, names())}")
    return parse(name, resources.files(__package__).joinpath("queries", f"{name}.rq").read_text("utf-8"))


@functools.cache
def names() -> tuple[str, ...]:
    """Names of all templates, sorted."""
    files = resources.files(__package__).joinpath("queries").iterdir()
    return tuple(sorted(file.name.removesuffix(".rq") for file in files if file.name.endswith(".rq")))
