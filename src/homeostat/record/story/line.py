"""One line of a story, and what it is to the operator."""

from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.quotation import printable


class Tone(StrEnum):
    """What a line is to the operator."""

    PLAIN = "plain"
    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"
    MUTED = "muted"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the story."""

    at_s: float
    """Process time [s]."""
    label: str
    """What kind of line it is, one word."""
    text: str
    """What happened."""
    tone: Tone = Tone.PLAIN
    """What it is to the operator."""

    def __post_init__(self) -> None:
        """Whoever wrote a journal that is told again commands no terminal."""
        object.__setattr__(self, "text", printable(self.text))

    def __str__(self) -> str:
        """The line without colour."""
        return f"{self.at_s:7.10g} s  {self.label:<9} {self.text}"
