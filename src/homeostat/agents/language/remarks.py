"""Remarks of a language model: what its answers say besides a proposal, kept until recovery asks for it."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Final

from pydantic import BaseModel

from homeostat.agents.language.answers import MOST_REASONING, MOST_TEXT
from homeostat.domain.quotation import quoted
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

    def take(self, agent: str, answer: BaseModel, components: Collection[str]) -> None:
        """Keep what an ``answer`` of ``agent`` says besides its proposal; ``components`` are those of the plant."""
        said = (_placed(remark, components) for remark in remarks_in(agent, answer))
        self._kept = [*self._kept, *said][-MOST_KEPT:]

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


def _placed(remark: Remark, components: Collection[str]) -> Remark:
    """``remark``, or a note in its place where it speaks of a component that the plant does not have.

    A wrong name in what people read costs no proposal, and calls nobody to a place that does not exist.
    """
    if remark.kind not in (RemarkKind.MAINTENANCE, RemarkKind.UNLISTED_CAUSE) or remark.about in components:
        return remark
    text = f"{remark.kind.value} about {quoted(remark.about, 40)}, which the plant does not have: {remark.text}"
    return Remark(RemarkKind.NOTE, remark.agent, "", quoted(text, MOST_REASONING))
