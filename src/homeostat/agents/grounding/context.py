"""Context: what a language model is shown of the plant, and that it may be shown nothing."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Final, Protocol

from homeostat.knowledge.context.context import Context


class GroundingKind(StrEnum):
    """How the prompts of a language model are grounded; what is asked of the graph otherwise stays the same."""

    GRAPH = "graph"
    """In a part of the graph that a query found, as compact Turtle."""
    DOCUMENTS = "documents"
    """In the same facts as plain text, found by the words of the question."""
    NONE = "none"
    """In nothing but the situation."""


class ContextFinder(Protocol):
    """Finds what a language model is shown of the plant, within a budget of tokens as they are estimated."""

    @property
    def kind(self) -> GroundingKind:
        """How it is found, which decides how prompts speak of it."""
        ...

    def planning_context(
        self, state: str, event: str, ahead: Sequence[str], faults: Sequence[str], budget: int
    ) -> Context:
        """What planning is shown: where ``event`` can lead from ``state`` with ``faults``; ``ahead``: on open paths."""
        ...

    def action_context(
        self, states: Sequence[str], tags: Sequence[str], faults: Sequence[str], needed: Sequence[str], budget: int
    ) -> Context:
        """What acting is shown: what ``tags`` move in ``states``, what ``faults`` mean, and ``needed`` limits."""
        ...

    def step_context(self, state: str, faults: Sequence[str], budget: int) -> Context:
        """What acting in one step is shown: what ``state`` admits for each tag, and what ``faults`` mean."""
        ...


class NoContext:
    """Implements :class:`ContextFinder` by showing nothing."""

    kind: Final = GroundingKind.NONE
    """Without any."""

    def planning_context(
        self, state: str, event: str, ahead: Sequence[str], faults: Sequence[str], budget: int
    ) -> Context:
        """Nothing."""
        return nothing(budget)

    def action_context(
        self, states: Sequence[str], tags: Sequence[str], faults: Sequence[str], needed: Sequence[str], budget: int
    ) -> Context:
        """Nothing."""
        return nothing(budget)

    def step_context(self, state: str, faults: Sequence[str], budget: int) -> Context:
        """Nothing."""
        return nothing(budget)


def nothing(budget: int) -> Context:
    """A context that shows nothing of what might have had ``budget`` tokens."""
    return Context(text="", tokens=0, budget=budget, shown=0, left_out=())
