"""Closed namespaces: a class whose attributes are all the terms there are, so that a typo cannot pass."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NoReturn

from pyoxigraph import NamedNode

from homeostat.stl.spelling import near_matches


class ClosedNamespace(type):
    """Metaclass: turns every annotated name of the class body into the term of that name, and refuses all others.

    ``class UML(metaclass=ClosedNamespace, iri="http://...#"): State: NamedNode`` gives ``UML.State``.
    A type checker sees the annotations; at run time an unknown name raises AttributeError naming the nearest terms.
    """

    iri: str
    """The namespace IRI that every term starts with."""
    terms: tuple[NamedNode, ...]
    """All terms, in the order written."""

    def __new__(mcs, name: str, bases: tuple[type, ...], body: dict[str, Any], *, iri: str) -> ClosedNamespace:
        """Fill the annotated names in with terms of namespace ``iri``."""
        filled = {term: NamedNode(iri + term) for term in body.get("__annotations__", {})}
        return super().__new__(mcs, name, bases, {**body, **filled, "iri": iri, "terms": tuple(filled.values())})

    def __init__(cls, name: str, bases: tuple[type, ...], body: dict[str, Any], *, iri: str) -> None:
        """Accept the keyword that ``__new__`` used."""
        super().__init__(name, bases, body)

    if not TYPE_CHECKING:  # a type checker must go by the annotations alone

        def __getattr__(cls, name: str) -> NoReturn:
            """Refuse a name that is no term."""
            raise AttributeError(cls._unknown(name))

    def __setattr__(cls, name: str, value: object) -> None:
        """Refuse to add or change a term, except what the interpreter itself keeps on classes."""
        if not name.startswith("__"):
            raise AttributeError(f"namespace {cls.__name__} is closed: {name!r} cannot be set")
        super().__setattr__(name, value)

    def __getitem__(cls, name: str) -> NamedNode:
        """The term of local name ``name``, for names read from data; KeyError naming the nearest terms otherwise."""
        term = NamedNode(cls.iri + name)
        if term not in cls.terms:
            raise KeyError(cls._unknown(name))
        return term

    def __contains__(cls, term: object) -> bool:
        """Whether ``term`` is one of the terms."""
        return term in cls.terms

    def __iter__(cls) -> Iterator[NamedNode]:
        """All terms, in the order written."""
        return iter(cls.terms)

    def _unknown(cls, name: str) -> str:
        known = [term.value.removeprefix(cls.iri) for term in cls.terms]
        return f"term {name!r} is not in namespace {cls.__name__} <{cls.iri}>{near_matches(name, known)}"
