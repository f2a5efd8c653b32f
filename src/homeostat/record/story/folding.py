"""Folding: what says the same again is counted, not told again; lines stand in the order of their times."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from homeostat.domain.events.recovery import Attempted
from homeostat.domain.verdict import REPEATED
from homeostat.journal import Event
from homeostat.record.story.line import Line, Tone

ATTEMPT: Final = "proposed"
"""Label of the line of an attempt."""
SAID_ONCE: Final = frozenset(
    {"review", "armed", "gave up", "no action", "reasoning", "note", "request", "doubt", "suspects"}
)
"""Labels of lines that are told again only where they say something else."""
NEWS: Final = frozenset({"released", "fallback", "reset", "trip"})
"""Labels of lines after which everything is told again."""


class Folding:
    """Passes the lines of a story on, without those that say what was said before."""

    def __init__(self) -> None:
        """Nothing was told yet."""
        self._said: dict[str, str] = {}
        self._known: set[tuple[object, ...]] = set()
        self._folded: list[tuple[Attempted, float]] = []
        self._last_s = 0.0

    def fold(self, event: Event, at_s: float, lines: Iterable[Line]) -> Iterator[Line]:
        """What of the ``lines`` of an event is told, with the count of what was folded before it."""
        repeats = isinstance(event, Attempted) and self._repeats(event)
        told = [line for line in lines if not (repeats and line.label == ATTEMPT) and not self._was_said(line)]
        yield from self.show(told)
        if isinstance(event, Attempted) and repeats:
            self._folded.append((event, at_s))

    def show(self, lines: Iterable[Line]) -> Iterator[Line]:
        """``lines``, behind the count of what was folded before them, in the order of their times."""
        for line in lines:
            if self._folded:
                folded, self._folded = self._folded, []
                yield self._in_order(Line(folded[-1][1], ATTEMPT, _counted(folded), Tone.MUTED))
            if line.label in NEWS:
                self._known.clear()
                self._said.clear()
            yield self._in_order(line)

    def _repeats(self, event: Attempted) -> bool:
        """Whether an attempt is one that was told before; those of which only the margins differ are alike."""
        checks = frozenset(f.criterion for f in event.findings if not f.satisfied)
        if checks == {REPEATED}:
            return True
        key = (event.proposer, event.path, event.digest, event.approved, checks)
        known = key in self._known
        self._known.add(key)
        return known

    def _was_said(self, line: Line) -> bool:
        if line.label not in SAID_ONCE:
            return False
        known = self._said.get(line.label) == line.text
        self._said[line.label] = line.text
        return known

    def _in_order(self, line: Line) -> Line:
        """``line`` at its own time; one that became known later stands there, and says of when it is."""
        if round(line.at_s) >= round(self._last_s):
            self._last_s = max(line.at_s, self._last_s)
            return line
        return replace(line, at_s=self._last_s, text=f"{line.text} (at {line.at_s:.10g} s)")


def _counted(folded: list[tuple[Attempted, float]]) -> str:
    """Attempts that are not told one by one."""
    again = [attempt for attempt, _ in folded if any(f.criterion == REPEATED for f in attempt.findings)]
    parts = []
    if again:
        parts.append(f"{len(again)} repeated one that was judged already ({REPEATED})")
    approved = sum(attempt.approved for attempt, _ in folded)
    refused = len(folded) - len(again) - approved
    counts = ((approved, "approved"), (refused, "refused"))
    parts += [f"{count} {word} as before" for count, word in counts if count]
    return f"{len(folded)} more: {', '.join(parts)}"
