"""Remarks of a language model: what its answers say besides a proposal, kept until recovery asks for it."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Final

from pydantic import BaseModel

from homeostat.agents.language.answers import MOST_REASONING, MOST_TEXT, Unusable, unusable
from homeostat.domain.quotation import quote, quoted
from homeostat.domain.remark import Remark, RemarkKind

_KINDS: Final = {
    "reasoning": RemarkKind.REASONING,
    "note": RemarkKind.NOTE,
    "maintenance_request": RemarkKind.MAINTENANCE,
    "doubt": RemarkKind.DOUBT,
    "unlisted_cause": RemarkKind.UNLISTED_CAUSE,
}
"""Field of an answer -> what it is."""
MOST_KEPT: Final = 64
"""Most remarks that are kept until somebody asks for them."""


@dataclass(slots=True)
class Said:
    """Implements :class:`homeostat.agents.roles.Remarks` for the agents of one model."""

    _kept: list[Remark] = field(default_factory=list)

    def take(self, agent: str, answer: BaseModel) -> None:
        """Keep what an ``answer`` of ``agent`` says besides its proposal."""
        self._kept = [*self._kept, *remarks_in(agent, answer)][-MOST_KEPT:]

    def drain(self) -> tuple[Remark, ...]:
        """What was said since somebody asked last."""
        kept, self._kept = tuple(self._kept), []
        return kept


def remarks_in(agent: str, answer: BaseModel) -> tuple[Remark, ...]:
    """The remarks of one answer; empty texts are none."""
    given: dict[str, Any] = answer.model_dump()
    found = []
    for name, kind in _KINDS.items():
        said = given.get(name)
        if said is None:
            continue
        about, text = ("", said) if isinstance(said, str) else (said.get("component") or said["about"], said["text"])
        line = quoted(text, MOST_REASONING if kind is RemarkKind.REASONING else MOST_TEXT)
        if line:
            found.append(Remark(kind, agent, about, line))
    return tuple(found)


def astray(answer: BaseModel, components: Collection[str]) -> Unusable | None:
    """Why an answer is unusable that speaks of a component which the plant does not have; None where none does."""
    given: dict[str, Any] = answer.model_dump()
    for name in ("maintenance_request", "unlisted_cause"):
        said = given.get(name)
        if said is not None and said["component"] not in components:
            text = f"{name}.component: {quote(said['component'], 40)} is no component of the plant"
            return unusable(f"{text}; name one as the graph has it, or answer null")
    return None
