"""Remarks: what a proposer says besides a proposal. They are shown and kept; nothing is released or refused by them."""

from dataclasses import dataclass
from enum import StrEnum


class RemarkKind(StrEnum):
    """What a remark is."""

    REASONING = "reasoning"
    """Why it proposes what it proposes."""
    NOTE = "note"
    """Something that a person should read."""
    MAINTENANCE = "maintenance request"
    """Something about one component that a person should have looked after."""
    DOUBT = "doubt"
    """Why a hypothesis or a permissive may be wrong."""
    UNLISTED_CAUSE = "unlisted cause"
    """What may be wrong with one component that no hypothesis names."""


@dataclass(frozen=True, slots=True)
class Remark:
    """One of them."""

    kind: RemarkKind
    """What it is."""
    agent: str
    """Who of the proposer's agents says it: ``planning`` or ``action``."""
    about: str
    """Component, hypothesis or permissive that it is about, by its name; empty where it is about none."""
    text: str
    """What is said, one line of visible characters."""
