"""What a plant's folder states, as far as a guard needs it: small enough to come from another process."""

from dataclasses import dataclass
from pathlib import Path

from homeostat.domain.plant.rules import GuardRules
from homeostat.journal import Setting


@dataclass(frozen=True, slots=True)
class Stated:
    """What 'homeostat attach' needs of a plant."""

    rules: GuardRules
    """What the guard knows of it."""
    folder: Path
    """Where it is."""
    place: tuple[Setting, ...]
    """The same as the journal states it."""
    lease_within_s: float
    """Longest that its link may need to give a lease, wall-clock [s]."""


def stated(plant: str) -> Stated:
    """Read the plant called ``plant``, or the one in that folder; raises as ``plants.described.read_described``."""
    from homeostat.evaluate.recorded.plant import place
    from homeostat.plants.described import read_described
    from homeostat.plants.wired.guarding import rules_of

    read = read_described(plant)
    folder = read.files.folder
    return Stated(rules_of(read), folder, place(folder), read.settings.link.lease_within_s)
