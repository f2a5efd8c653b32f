"""A question about one module has the same answer however large the plant around it is."""

from __future__ import annotations

import pytest
from pyoxigraph import RdfFormat, Triple

from benchmarks.graph_scaling import questions
from benchmarks.synthetic_plant import plant
from homeostat.knowledge.questions.query import Form, template
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.store import Solution

SMALL, LARGE = 3, 60
SIZES = {
    "state_machine": 24,
    "candidate_faults": 20,
    "is_admissible_step": 1,
}


@pytest.fixture(scope="module")
def stores() -> tuple[EmbeddedStore, EmbeddedStore]:
    """A small and a large plant that agree about their first modules."""
    small, large = EmbeddedStore(), EmbeddedStore()
    small.load(plant(SMALL), RdfFormat.N_TRIPLES)
    large.load(plant(LARGE), RdfFormat.N_TRIPLES)
    return small, large


def answer(store: EmbeddedStore, name: str) -> tuple[Solution, ...] | tuple[Triple, ...] | tuple[bool]:
    """The answer of a template about module 1."""
    item, arguments = template(name), questions(1)[name]
    match item.form:
        case Form.SELECT:
            return item.select(store, **arguments)
        case Form.ASK:
            return (item.ask(store, **arguments),)
        case _:
            return item.construct(store, **arguments)


@pytest.mark.parametrize("name", SIZES)
def test_the_answer_does_not_depend_on_the_rest_of_the_plant(
    stores: tuple[EmbeddedStore, EmbeddedStore], name: str
) -> None:
    small, large = (answer(store, name) for store in stores)
    assert small == large
    assert len(small) == SIZES[name]


def test_every_question_of_the_benchmark_is_covered() -> None:
    assert set(SIZES) == set(questions(0))


def test_one_module_has_the_size_it_says() -> None:
    text = plant(1).decode()
    kinds = {"State>": 12, "Action>": 24, "Transition>": 24, "Fault>": 6, "Symptom>": 8, "#Tag>": 20, "Envelope>": 10}
    for kind, count in kinds.items():
        assert sum(line.endswith(f"{kind} .") and "#type>" in line for line in text.splitlines()) == count
    assert len(set(plant(4).splitlines())) == len(plant(4).splitlines())
