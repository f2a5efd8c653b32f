"""Grounding in documents: the plant's facts as plain text, found by the words of what is asked."""

from collections.abc import Sequence
from typing import Final

from homeostat.agents.grounding.context import ContextFinder, GroundingKind, NoContext
from homeostat.agents.grounding.grounding import Grounding
from homeostat.knowledge.context.context import Context
from homeostat.knowledge.context.documents import LexicalIndex, documents
from homeostat.knowledge.store.store import GraphStore
from homeostat.llm.tokens import estimate


def context_finder(kind: GroundingKind, grounding: Grounding, store: GraphStore, namespace: str) -> ContextFinder:
    """What finds the context for a language model in the way of ``kind``.

    ``grounding`` asks the graph in ``store``, where the plant's things live in ``namespace``. ImportError, in one line,
    where a library is not installed that documents need.
    """
    match kind:
        case GroundingKind.GRAPH:
            return grounding
        case GroundingKind.DOCUMENTS:
            return DocumentContext(grounding, store, namespace)
        case GroundingKind.NONE:
            return NoContext()


class DocumentContext:
    """Implements :class:`ContextFinder` with one document per thing of the graph, ranked by the words asked."""

    kind: Final = GroundingKind.DOCUMENTS
    """In documents."""

    def __init__(self, grounding: Grounding, store: GraphStore, namespace: str) -> None:
        """Tell everything that ``store`` has in ``namespace``; ``grounding`` keeps what is asked and answered."""
        told = documents(store, namespace)
        self._grounding = grounding
        self._labels = {document.name: document.label for document in told}
        self._index = LexicalIndex(told)

    def planning_context(
        self, state: str, event: str, ahead: Sequence[str], faults: Sequence[str], budget: int
    ) -> Context:
        """The documents nearest to the state, the event, the states ahead and the faults."""
        asked = self._words(("state", [state]), ("event", [event]), ("state", ahead), ("fault", faults))
        return self._found("planning_documents", (state, *ahead, *faults), asked, budget)

    def action_context(
        self, states: Sequence[str], tags: Sequence[str], faults: Sequence[str], needed: Sequence[str], budget: int
    ) -> Context:
        """The documents nearest to the states, the tags, the faults and the limits that are needed."""
        asked = self._words(("state", states), ("tag", tags), ("fault", faults), ("limit", needed))
        return self._found("action_documents", (*states, *faults), asked, budget)

    def step_context(self, state: str, faults: Sequence[str], budget: int) -> Context:
        """The documents nearest to the state and the faults."""
        asked = self._words(("state", [state]), ("fault", faults))
        return self._found("step_documents", (state, *faults), asked, budget)

    def _found(self, question: str, about: tuple[str, ...], asked: str, budget: int) -> Context:
        """The best documents that fit; one that does not fit does not end the list."""
        lines: list[str] = []
        left_out: list[str] = []
        tokens = 0
        for document in self._index.matching(asked):
            cost = estimate(f"{document.text}\n")
            if tokens + cost <= budget:
                lines.append(document.text)
                tokens += cost
            else:
                left_out.append(document.name)
        text = "\n".join(lines)
        self._grounding.record_text(question, about, asked, f"{len(lines)} documents shown", text)
        return Context(text, tokens, budget, len(lines), tuple(left_out))

    def _words(self, *named: tuple[str, Sequence[str]]) -> str:
        """What is asked about, in words: of every kind the names, each with its label."""
        return " ".join(
            f"{kind} {name} {self._labels.get(f'{kind}_{name}', '')}".strip() + "."
            for kind, names in named
            for name in names
        )
