"""What a guard is attached to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.mode import Mode
from homeostat.domain.ports import Lease, Record
from homeostat.guard.restart.memory import Memory


@dataclass(frozen=True, slots=True)
class Attachment:
    """What a guard is attached to, and in which mode it begins."""

    record: Record
    """Where its events go."""
    lease: Lease | None = None
    """The right to write; None where the plant is only observed."""
    mode: Mode = Mode.CLOSED_LOOP
    """Mode in which it begins."""
    keys: Mapping[str, bytes] = field(default_factory=dict)
    """Issuer -> the key of its seals."""
    memory: Memory | None = None
    """What a journal says of the guard before; None for a plant that nobody has watched yet."""
    goes_on: bool = True
    """Whether a restart goes on in the journalled mode, as in simulation; a real plant stands in observe first."""
