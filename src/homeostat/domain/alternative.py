"""Alternatives: everything that could be done now, with what it costs and how safe it is, in one list."""

from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost


class AlternativeKind(StrEnum):
    """What is done."""

    LEAVE = "leave alone"
    """Nothing; what goes on goes on."""
    RELEASE = "release"
    """A proposal is written."""
    WAIT = "wait"
    """Nothing for a while; then the plant is looked at again."""
    HOLD = "hold"
    """A proposal is written for a while; then the plant is looked at again, with the way back in mind."""
    TEST = "test"
    """A test move is written for a while, to tell explanations apart."""
    FALLBACK = "fall back"
    """A fallback of the tables acts."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """One of them."""

    kind: AlternativeKind
    """What is done."""
    name: str
    """The path of a proposal, the strategy of a fallback, the state in which the plant is left, what follows a wait."""
    cost: Cost
    """What it is expected to cost."""
    refused: str = ""
    """Why it may not be done; empty where it may."""
    proposer: str = ""
    """Who proposed it; empty where nobody had to."""
    digest: str = ""
    """Digest of its action set; that of a wait is made of its length and of what is to follow."""
    polished: bool = False
    """Whether the search bettered the numbers of whoever proposed it."""
    seconds: float = 0.0
    """How long a wait, a hold or a test lasts before the plant is looked at again [s]; 0 for what is to last."""

    certificate: Certificate | None = None
    """How likely it is to violate a hard limit, on draws that nothing was chosen by; None where nobody counted."""

    @property
    def admitted(self) -> bool:
        """Whether it may be done."""
        return not self.refused

    @property
    def told(self) -> str:
        """What is done and who proposed it, in words: ``hold normal > holding for 60 s by language``."""
        lasting = f" for {self.seconds:g} s" if self.seconds else ""
        return f"{self.kind.value} {self.name}{lasting}{f' by {self.proposer}' if self.proposer else ''}"
