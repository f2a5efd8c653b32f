"""Reading rows: every gap and every term of another kind is an error that names the variable."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from pyoxigraph import BlankNode, Literal, NamedNode

from homeostat.knowledge.store.store import Solution, StoreError, Term, UnexpectedAnswer
from homeostat.knowledge.vocabulary.vocabulary import XSD

IRI = NamedNode("urn:x")
TERMS: dict[str, tuple[Term, object]] = {
    "iri": (IRI, IRI),
    "text": (Literal("a"), "a"),
    "tagged": (Literal("b", language="de"), "b"),
    "double": (Literal(1.5), 1.5),
    "whole": (Literal(3), 3.0),
    "float": (Literal("2.5", datatype=NamedNode(XSD.iri + "float")), 2.5),
    "flag": (Literal(True), True),
    "zero": (Literal("0", datatype=XSD.boolean), False),
    "blank": (BlankNode("n"), None),
    "ill": (Literal("", datatype=XSD.double), None),
    "ill_flag": (Literal("", datatype=XSD.boolean), None),
    "date": (Literal("2026-01-01", datatype=NamedNode(XSD.iri + "date")), None),
}
ROW = Solution((*TERMS, "unbound"), (*(term for term, _ in TERMS.values()), None))
READERS: dict[str, tuple[Callable[[Solution, str], object], Callable[[Solution, str], object], set[str]]] = {
    "an IRI": (Solution.iri, Solution.optional_iri, {"iri"}),
    "a text": (Solution.text, Solution.optional_text, {"text", "tagged"}),
    "a number": (Solution.number, Solution.optional_number, {"double", "whole", "float"}),
    "a truth value": (Solution.flag, Solution.optional_flag, {"flag", "zero"}),
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("name", TERMS)
def test_a_term_is_read_as_its_kind_and_no_other(kind: str, name: str) -> None:
    needed, optional, fits = READERS[kind]
    for read in (needed, optional):
        if name in fits:
            assert read(ROW, name) == TERMS[name][1] and type(read(ROW, name)) is type(TERMS[name][1])
            continue
        with pytest.raises(UnexpectedAnswer) as error:
            read(ROW, name)
        assert repr(name) in str(error.value) and kind in str(error.value) and str(TERMS[name][0]) in str(error.value)


@pytest.mark.parametrize("kind", READERS)
def test_a_gap_is_none_or_an_error(kind: str) -> None:
    needed, optional, _ = READERS[kind]
    assert optional(ROW, "unbound") is None
    with pytest.raises(UnexpectedAnswer, match=f"'unbound' is unbound where {kind} is needed"):
        needed(ROW, "unbound")


@pytest.mark.parametrize("kind", READERS)
def test_an_unknown_variable_is_an_error(kind: str) -> None:
    for read in READERS[kind][:2]:
        with pytest.raises(UnexpectedAnswer, match="no variable 'irl' in the answer; it has iri, text"):
            read(ROW, "irl")


def test_an_unexpected_answer_is_a_store_error() -> None:
    assert issubclass(UnexpectedAnswer, StoreError)
