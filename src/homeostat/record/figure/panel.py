"""Panels of a run's picture: what a plant asks for."""

from dataclasses import dataclass

from homeostat.domain.plant.tag import Range


@dataclass(frozen=True, slots=True)
class LinePanel:
    """Tags of one unit as lines over a common axis."""

    title: str
    """What it shows."""
    unit: str
    """Unit of every tag in it."""
    tags: tuple[str, ...]
    """Tags that are drawn."""
    limits: tuple[str, ...]
    """Limits that are drawn as lines."""
    guards: tuple[str, ...]
    """Transitions whose guards are drawn as lines."""
    window: tuple[float, float]
    """Range of the axis, in the unit."""


@dataclass(frozen=True, slots=True)
class StripPanel:
    """Tags of one unit and one range as bars, one row per tag: what is open or runs, and how far."""

    title: str
    """What it shows."""
    unit: str
    """Unit of every tag in it."""
    tags: tuple[str, ...]
    """Tags that are drawn, from the top."""
    range: Range
    """Values of an empty row and of a full one, in the unit."""


Panel = LinePanel | StripPanel
