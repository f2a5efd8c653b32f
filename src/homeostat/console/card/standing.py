"""Where a proposal stands: whether it may still be shown as one, in words.

:mod:`homeostat.console.card.course` finds it in a journal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from homeostat.journal.memory import Entry


class Stands(StrEnum):
    """How far a proposal came, or what ended it."""

    TRIED = "tried"
    """Every check holds; what else could be done is still looked for."""
    CHOSEN = "chosen"
    """It is what is to be done; the release check and the guard have not answered yet."""
    OFFERED = "offered"
    """It waits for a person's yes."""
    ADVISED = "advised"
    """A person may do it; in this mode nobody else does."""
    WRITTEN = "written"
    """The guard writes it."""
    WAITED = "waited"
    """It is waited, and then the plant is looked at again."""
    RELEASED = "released"
    """It was written, and is in force."""
    REFUSED = "refused"
    """A check, the guard or a person has said no."""
    FAILED = "failed"
    """It was written, and the plant does not hold it."""
    VOID = "void"
    """Nobody answered in time, or the plant, the mode or the guard is not what it was decided for."""
    OVERTAKEN = "overtaken"
    """Something else was chosen, released or done by a fallback."""

    @property
    def holds(self) -> bool:
        """Whether it may still be shown as what is proposed or was released."""
        return self not in _OVER


_OVER: Final = (Stands.REFUSED, Stands.FAILED, Stands.VOID, Stands.OVERTAKEN)
_JOINED: Final = {Stands.REFUSED: " by ", Stands.RELEASED: ", ", Stands.WAITED: ", "}


@dataclass(frozen=True, slots=True)
class Standing:
    """Where one proposal stands."""

    stands: Stands
    """How far it came."""
    digest: str
    """Digest of its action set, or what stands for a wait."""
    judged: Entry | None
    """The judgement that it stands on, an attempt; None where the journal does not tell it."""
    since_s: float
    """Since when it stands so [s]."""
    turn: int
    """How many changes of any proposal came before [1]."""
    because: str = ""
    """Who has ended it and why, or what follows; empty where there is nothing to say."""
    released_s: float | None = None
    """When it was released [s]; None where it was not."""

    @property
    def words(self) -> str:
        """The same as an operator reads it, behind 'it is'."""
        said = {
            Stands.TRIED: "being tried: every check holds, and what else could be done is still looked for",
            Stands.CHOSEN: "chosen: the release check and the guard have not answered yet",
            Stands.OFFERED: "proposed, and waits for a person's yes",
            Stands.ADVISED: "advised; in this mode nobody writes",
            Stands.WRITTEN: "being written",
            Stands.WAITED: "decided: nothing is written",
            Stands.RELEASED: "released",
            Stands.REFUSED: "refused",
            Stands.FAILED: "written, and the plant does not hold it",
            Stands.VOID: "void",
            Stands.OVERTAKEN: "overtaken",
        }[self.stands]
        return f"{said}{_JOINED.get(self.stands, ': ')}{self.because}" if self.because else said


def current(standings: Sequence[Standing]) -> Standing | None:
    """What is proposed or in force; None where nothing is.

    What waits for a person comes first, for only they can answer it; what was merely tried comes last.
    """
    held = [one for one in standings if one.stands.holds]
    offered = [one for one in held if one.stands in (Stands.OFFERED, Stands.WRITTEN)]
    beyond = [one for one in held if one.stands is not Stands.TRIED]
    found = offered or beyond or held
    return found[-1] if found else None


def fallen(standings: Sequence[Standing]) -> Standing | None:
    """What fell last; None where something stands since, or nothing fell.

    Beside what is in force that is what was refused or void later: whoever has said no looks for it.
    """
    now, over = current(standings), [one for one in standings if not one.stands.holds]
    if now is not None:
        later = [one for one in over if one.turn > now.turn and one.stands is not Stands.OVERTAKEN]
        over = later if now.stands is Stands.RELEASED else []
    return over[-1] if over else None
