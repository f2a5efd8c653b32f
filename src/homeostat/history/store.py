"""What a store of samples must do, wherever it keeps them; `tests/contracts/history_store.py` holds every one to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from homeostat.history.samples import Batch, Minutes, Series, Span


class HistoryError(ValueError):
    """A store cannot be used as it was asked for; one line with the remedy."""


class UnknownTag(HistoryError):
    """The store has no sample of a tag."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An alarm or an event, as it is kept for good."""

    time_us: int
    """When it happened [us]."""
    own_us: int
    """When we heard of it, by our own clock [us]."""
    kind: str
    """What it is: ``alarm``, or the name of an event."""
    source: str
    """What it is about: a tag, a limit, a component."""
    severity: int
    """From 1 to 1000, the higher the worse (OPC UA Part 9)."""
    text: str
    """One sentence."""
    details: str = ""
    """Whatever else is known of it, as JSON; empty for nothing."""

    def __post_init__(self) -> None:
        if not 1 <= self.severity <= 1000:
            raise ValueError(f"severity {self.severity!r} of {self.kind!r} must be from 1 to 1000")


class HistoryReader(Protocol):
    """The reading side of a store; what a writer has acknowledged is seen, also in another process."""

    def tags(self) -> tuple[str, ...]:
        """Names of all tags of which there are samples or roll-ups, sorted."""
        ...

    def extent(self) -> Span | None:
        """From the earliest source time to just after the latest one; None where there is no sample."""
        ...

    def read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        """Tag -> its samples inside ``span``; UnknownTag, with near matches, where there is none of it at any time."""
        ...

    def minutes(self, tags: Sequence[str], span: Span) -> Mapping[str, Minutes]:
        """Tag -> its minutes that begin inside ``span``; UnknownTag as :meth:`read`."""
        ...

    def last(self, tags: Sequence[str]) -> Mapping[str, Series]:
        """Tag -> its sample with the latest source time, the one that arrived last of several; UnknownTag as above."""
        ...

    def occurrences(self, span: Span) -> tuple[Occurrence, ...]:
        """Alarms and events inside ``span``, by time."""
        ...


class HistoryStore(HistoryReader, Protocol):
    """A store that is written; one process at a time."""

    def append(self, batch: Batch) -> None:
        """Keep ``batch``: when this returns, the end of this process loses none of it, and after a second no power cut.

        Raises OSError where there is no room for it and nothing that may be dropped for it, nor comes any within some
        seconds; none of it is kept then.
        """
        ...

    def record(self, occurrence: Occurrence) -> None:
        """Keep an alarm or an event, for good; as :meth:`append`."""
        ...

    def sync(self) -> None:
        """Return when everything that was appended is safe from a power cut."""
        ...

    def retain(self) -> None:
        """Drop what is older, or more, than the settings allow; the store does so by itself as it goes."""
        ...

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong, was cut off or was dropped early since this was last asked; one line each."""
        ...

    def close(self) -> None:
        """Sync, and leave everything as whoever reads it later wants it; the store takes nothing more."""
        ...
