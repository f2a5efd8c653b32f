"""What agents ask the graph: one typed function per question, each a template of ``queries/``.

None of them knows a plant: every question starts at things that the caller names, and costs what its answer costs.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from pyoxigraph import NamedNode

from homeostat.knowledge.questions.query import template
from homeostat.knowledge.store.store import GraphStore, Solution


@dataclass(frozen=True, slots=True)
class TransitionFact:
    """One transition of a state machine, as the graph has it."""

    transition: NamedNode
    """The transition."""
    source: NamedNode
    """State it leaves."""
    target: NamedNode
    """State it enters."""
    event: NamedNode | None
    """Event that fires it; None where none is stated."""
    guard: str | None
    """Guard in the rule language; None where none is stated."""
    priority: int | None
    """Order among transitions enabled together, smallest first; None where none is stated."""
    recovery: bool
    """Whether it is taken on decision only."""
    label: str | None
    """In the operator's words."""
    comment: str | None
    """What engineering says about it."""


@dataclass(frozen=True, slots=True)
class CandidateFault:
    """A fault that symptoms speak for."""

    fault: NamedNode
    """The fault."""
    symptoms: tuple[NamedNode, ...]
    """Those of the given symptoms that speak for it, sorted."""
    prior: float | None
    """Share among all faults before any symptom [1]; None where none is stated."""
    affected: tuple[NamedNode, ...]
    """Parts of the plant that are no longer as they should be, sorted."""
    disabled: tuple[NamedNode, ...]
    """What can no longer be used, sorted."""


def transitions(store: GraphStore, machine: NamedNode) -> tuple[TransitionFact, ...]:
    """The transitions of a state machine, sorted by IRI."""
    return tuple(
        TransitionFact(
            transition=row.iri("transition"),
            source=row.iri("source"),
            target=row.iri("target"),
            event=row.optional_iri("event"),
            guard=row.optional_text("guard"),
            priority=None if (order := row.optional_number("priority")) is None else int(order),
            recovery=row.optional_flag("recovery") or False,
            label=row.optional_text("label"),
            comment=row.optional_text("comment"),
        )
        for row in template("state_machine").select(store, machine=machine)
    )


def candidate_faults(store: GraphStore, symptoms: Sequence[NamedNode]) -> tuple[CandidateFault, ...]:
    """The faults that at least one of ``symptoms`` speaks for, sorted by IRI."""
    rows = template("candidate_faults").select(store, symptoms=tuple(symptoms))
    by_fault = sorted(rows, key=_fault)
    groups = ((fault, tuple(group)) for fault, group in groupby(by_fault, _fault))
    return tuple(
        CandidateFault(
            fault=NamedNode(fault),
            symptoms=_sorted(row.iri("symptom") for row in rows),
            prior=next((prior for row in rows if (prior := row.optional_number("prior")) is not None), None),
            affected=_sorted(iri for row in rows if (iri := row.optional_iri("affected"))),
            disabled=_sorted(iri for row in rows if (iri := row.optional_iri("disabled"))),
        )
        for fault, rows in groups
    )


def reachable_states(store: GraphStore, start: NamedNode, event: NamedNode) -> tuple[NamedNode, ...]:
    """The states that ``event`` can lead to from ``start``, itself first, in the order of the steps that it takes.

    One question per step: a property path cannot be kept to the transitions of one event.
    """
    found: dict[NamedNode, None] = {start: None}
    step: tuple[NamedNode, ...] = (start,)
    while step:
        rows = template("event_targets").select(store, states=step, event=event)
        step = tuple(target for row in rows if (target := row.iri("target")) not in found)
        found |= dict.fromkeys(step)
    return tuple(found)


def is_admissible_path(
    store: GraphStore, machine: NamedNode, path: Sequence[NamedNode], faults: Sequence[NamedNode]
) -> bool:
    """Whether ``machine`` may pass through the states of ``path`` in this order while ``faults`` are present.

    Guards are not judged: the graph does not know what the plant measures now. ValueError for fewer than two states.
    """
    if len(path) < 2:
        raise ValueError(f"a path needs at least 2 states, not {len(path)}; name the state it starts in as well")
    step = template("is_admissible_step")
    return all(step.ask(store, machine=machine, source=a, target=b, faults=tuple(faults)) for a, b in pairwise(path))


def _fault(row: Solution) -> str:
    return row.iri("fault").value


def _sorted(nodes: Iterable[NamedNode]) -> tuple[NamedNode, ...]:
    return tuple(sorted(set(nodes), key=lambda node: node.value))
