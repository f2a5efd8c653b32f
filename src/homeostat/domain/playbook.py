"""The playbook's entries: on which occasion what was done, what it was expected to do, and what came of it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.recovery import LaterStep
from homeostat.domain.recovery import Command


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What a tag that may be commanded is set to."""

    tag: str
    """Name of the tag."""
    value: float | None
    """Value in the tag's unit; None for a manual output that is on automatic."""

    def __post_init__(self) -> None:
        if self.value is not None:
            _check((self.value,), f"setpoint of {self.tag!r}")


@dataclass(frozen=True, slots=True)
class Occasion:
    """The situation in which something was asked for."""

    state: str
    """State of the supervisory state machine."""
    mode: str
    """Mode in which the guard was."""
    hypotheses: tuple[Hypothesis, ...]
    """What was plausible, as it was diagnosed: nobody knows what was true."""
    setpoints: tuple[Setpoint, ...] = ()
    """Where everything stood about which some state leaves a choice."""

    def __post_init__(self) -> None:
        sizes = [f.severity for h in self.hypotheses for f in h.faults]
        _check((*sizes, *(h.probability for h in self.hypotheses)), "hypotheses of an occasion")
        if any(not 0.0 <= h.probability <= 1.0 for h in self.hypotheses):
            raise ValueError("probabilities of an occasion must lie in 0 to 1")


@dataclass(frozen=True, slots=True)
class Margin:
    """By how much one criterion is kept."""

    criterion: str
    """Name of the criterion or limit."""
    amount: float
    """Signed distance to the limit in ``unit``, in the worst member."""
    unit: str
    """Unit of the margin; 1 where the formula mixes units."""

    def __post_init__(self) -> None:
        _check((self.amount,), f"margin of {self.criterion!r}")


@dataclass(frozen=True, slots=True)
class Answer:
    """What was released, and by what it was released."""

    path: tuple[str, ...]
    """States of the path, that of the occasion first."""
    commands: tuple[Command, ...]
    """What was commanded at once."""
    target: str
    """State that these lead to."""
    then: tuple[LaterStep, ...]
    """What followed, in order."""
    proposer: str
    """Who proposed it."""
    worst: Margin | None
    """The margin that was nearest to its limit, in scales; None where the record does not tell it."""
    cost_share: float
    """What it was expected to cost, as a share of the design production [1]."""
    certificate: Certificate | None
    """Bound of the probability that a hard limit is violated; None where none was made."""

    def __post_init__(self) -> None:
        _check((self.cost_share,), "cost of an answer")


class Ending(StrEnum):
    """What ended the time for which a release was watched."""

    HELD = "held for"
    """It was over, and nothing had to be done."""
    REPLACED = "replaced after"
    """Something else was released."""
    FELL_BACK = "fell back after"
    """A limit tripped, or the fallback acted."""
    CUT_SHORT = "run over after"
    """The run ended before."""


@dataclass(frozen=True, slots=True)
class Aftermath:
    """What came of a release on the plant, as far as instruments and the guard tell."""

    ending: Ending
    """What ended it."""
    seconds: float
    """For how long it was watched [s]."""
    kept: float | None
    """Least margin that the readings leave the answer's worst criterion; None where they cannot tell."""

    def __post_init__(self) -> None:
        _check((self.seconds, self.kept or 0.0), "aftermath of an answer")

    @property
    def good(self) -> bool:
        """Whether nothing speaks against doing it again."""
        return self.ending is not Ending.FELL_BACK


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a playbook."""

    configuration: str
    """Digest of the plant's configuration."""
    version: str
    """Version of the package."""
    source: str
    """What it is from: a run and when, or what was asked for to build it."""
    occasion: Occasion
    """The situation."""
    answer: Answer | None
    """What was done about it; None where nothing was."""
    reason: str = ""
    """Why nothing was done; empty where something was."""
    aftermath: Aftermath | None = None
    """What came of it; None where it was released on no plant that anybody watched."""
    needed: bool = True
    """Whether anything had to be done; where there is no answer although it had, the fallback acts."""

    @property
    def usable(self) -> bool:
        """Whether there is an answer that may be tried again."""
        return self.answer is not None and (self.aftermath is None or self.aftermath.good)


def _check(numbers: Iterable[float], what: str) -> None:
    """ValueError where one of ``numbers`` is not finite."""
    for number in numbers:
        if not math.isfinite(number):
            raise ValueError(f"{what}: {number!r} must be finite")
