"""Grounding: what agents ask the knowledge graph, by name, with every question and answer kept."""

from collections.abc import Sequence
from typing import Final, TypeAlias

from pyoxigraph import NamedNode, Triple

from homeostat.agents.grounding.context import GroundingKind
from homeostat.domain.events.recovery import Retrieved
from homeostat.journal.beside.archive import Archive, MemoryArchive
from homeostat.knowledge.build.turtle import write_turtle
from homeostat.knowledge.context.context import Context, context
from homeostat.knowledge.questions import questions
from homeostat.knowledge.questions.query import template
from homeostat.knowledge.store.store import GraphStore
from homeostat.llm.tokens import estimate

Arguments: TypeAlias = dict[str, NamedNode | tuple[NamedNode, ...]]
"""Parameter of a template -> what it is bound to."""
TEXT: Final = "BM25"
"""Form of a question that looks for words in documents."""


class Grounding:
    """Questions to one plant's graph; identical questions are asked once, but every use is recorded."""

    kind: Final = GroundingKind.GRAPH
    """The context is a part of the graph; see :class:`homeostat.agents.grounding.context.ContextFinder`."""

    def __init__(self, store: GraphStore, namespace: str, archive: Archive | None = None) -> None:
        """Ask ``store`` about one plant.

        ``namespace``: where the plant's things live; a thing is ``namespace`` + kind + ``_`` + name.
        """
        self._store = store
        self._namespace = namespace
        self._archive = archive or MemoryArchive()
        self._pending: list[Retrieved] = []
        self._graphs: dict[tuple[str, tuple[str, ...]], tuple[tuple[Triple, ...], str]] = {}

    def candidate_faults(self, symptoms: Sequence[str]) -> tuple[str, ...]:
        """Names of the faults that the named symptoms indicate, those with most symptoms first (SELECT)."""
        nodes = self._nodes("symptom", symptoms)
        found = questions.candidate_faults(self._store, nodes)
        ranked = sorted(found, key=lambda c: (-len(c.symptoms), c.fault.value))
        names = tuple(self._name("fault", c.fault) for c in ranked)
        self._note("candidate_faults", symptoms, {"symptoms": nodes}, ", ".join(names))
        return names

    def allows(self, states: Sequence[str], faults: Sequence[str]) -> bool:
        """Whether the machine may pass through ``states`` while ``faults`` are present (ASK per step)."""
        path, present = self._nodes("state", states), self._nodes("fault", faults)
        machine = NamedNode(self._namespace + "machine")
        answer = questions.is_admissible_path(self._store, machine, path, present)
        step: Arguments
        step = {"machine": machine, "source": path[-2], "target": path[-1], "faults": present}
        self._note("is_admissible_step", (*states, *faults), step, "yes" if answer else "no")
        return answer

    def planning_context(
        self, state: str, event: str, ahead: Sequence[str], faults: Sequence[str], budget: int
    ) -> Context:
        """What planning is shown (CONSTRUCT): what ``event`` can lead to from ``state``, and what ``faults`` block.

        ``ahead``: states on the paths that are open, whose guards are awaited.
        """
        (here,), present = self._nodes("state", [state]), self._nodes("fault", faults)
        (trigger,) = self._nodes("event", [event])
        reached = questions.reachable_states(self._store, here, trigger)
        shown = tuple(dict.fromkeys((*reached, *self._nodes("state", ahead))))
        bound: Arguments = {"states": shown, "event": trigger, "faults": present}
        return self._context("planning_fragment", (state, *ahead, *faults), bound, (here, *present), budget)

    def action_context(
        self, states: Sequence[str], tags: Sequence[str], faults: Sequence[str], needed: Sequence[str], budget: int
    ) -> Context:
        """What acting is shown: from the setpoints of ``states`` to what they move and what limits it.

        ``tags`` may be commanded there; ``needed``: limits that are never left out before anything else is.
        """
        present = self._nodes("fault", faults)
        seeds = (*present, *self._nodes("tag", tags), *self._nodes("limit", needed))
        bound: Arguments = {"states": self._nodes("state", states), "faults": present}
        return self._context("action_fragment", (*states, *faults), bound, seeds, budget)

    def step_context(self, state: str, faults: Sequence[str], budget: int) -> Context:
        """What acting in one step is shown: what ``state`` admits for each tag (CONSTRUCT)."""
        (here,), present = self._nodes("state", [state]), self._nodes("fault", faults)
        bound: Arguments = {"state": here, "faults": present}
        return self._context("step_fragment", (state, *faults), bound, (here,), budget)

    def drain(self) -> tuple[Retrieved, ...]:
        """What was asked since the last call, in order."""
        pending, self._pending = tuple(self._pending), []
        return pending

    def record_text(self, question: str, about: Sequence[str], asked: str, answer: str, shown: str) -> None:
        """Record that the words of ``asked`` found documents; ``answer`` in short, ``shown`` as a model sees them."""
        query = self._archive.store_prompt(asked)
        kept = self._archive.store_prompt(shown).sha256 if shown else ""
        self._pending.append(Retrieved(question, TEXT, tuple(about), query.sha256, answer, kept))

    def _context(
        self, question: str, about: tuple[str, ...], arguments: Arguments, seeds: Sequence[NamedNode], budget: int
    ) -> Context:
        key = (question, about)
        if key not in self._graphs:
            triples = template(question).construct(self._store, **arguments)
            prefix = self._namespace.rstrip("#").rpartition(":")[2]
            self._graphs[key] = triples, write_turtle(triples, prefix, self._namespace).decode("utf-8")
        triples, text = self._graphs[key]
        found = context(triples, seeds, self._namespace, budget, estimate)
        self._note(question, about, arguments, f"{len(triples)} triples; {found.shown} things shown", text)
        return found

    def _note(self, question: str, about: Sequence[str], arguments: Arguments, answer: str, graph: str = "") -> None:
        asked = template(question)
        query = self._archive.store_query(asked.bind(arguments))
        kept = self._archive.store_subgraph(graph).sha256 if graph else ""
        self._pending.append(Retrieved(question, asked.form.value, tuple(about), query.sha256, answer, kept))

    def _nodes(self, kind: str, names: Sequence[str]) -> tuple[NamedNode, ...]:
        return tuple(NamedNode(f"{self._namespace}{kind}_{name}") for name in names)

    def _name(self, kind: str, node: NamedNode) -> str:
        return node.value.removeprefix(f"{self._namespace}{kind}_")
