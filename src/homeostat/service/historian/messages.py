"""What guard and historian tell each other: the one is believed, the other says how far it has come."""

from __future__ import annotations

import json
import pickle
from dataclasses import dataclass
from typing import Final

from homeostat.history.samples import Batch
from homeostat.history.store import Occurrence

LARGEST: Final = 64_000_000
"""Longest message from the guard [byte]."""
LARGEST_BACK: Final = 10_000
"""Longest message from the historian [byte]."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Something to keep for good."""

    number: int
    """Goes up by one with each."""
    what: Batch | Occurrence
    """Samples that arrived together, or an alarm or an event."""


@dataclass(frozen=True, slots=True)
class Back:
    """How far the historian has come."""

    taken: int
    """Number of the last that is kept; a kill of any process loses nothing up to it."""
    trouble: str
    """What is wrong; empty where nothing is."""


def to_historian(kept: Kept) -> bytes:
    """``kept`` as it travels."""
    return pickle.dumps(kept, pickle.HIGHEST_PROTOCOL)


def from_guard(frame: bytes) -> Kept:
    """What the guard sent; only for a frame that came from the guard, because it can have anything made."""
    kept: Kept = pickle.loads(frame)
    return kept


def to_guard(back: Back) -> bytes:
    """``back`` as it travels."""
    return json.dumps([back.taken, back.trouble]).encode()


def from_historian(frame: bytes) -> Back:
    """What the historian said; ValueError, TypeError where it is nothing that it may say."""
    taken, trouble = json.loads(frame)
    return Back(int(taken), str(trouble))
