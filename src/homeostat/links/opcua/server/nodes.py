"""Names of the nodes that a served plant has: ``ns=2;s=T1`` is the reading T1, ``ns=2;s=T1.sp/Mode`` a block's mode."""

from enum import IntEnum
from typing import Final, TypeAlias

URI: Final = "urn:homeostat:plant"
"""Namespace of all nodes."""
COUNTER: Final = "Plant/Counter"
"""Counts samples; whoever sees it stand knows that the plant's side is dead."""
TIME: Final = "Plant/Time"
"""Process time of the last sample [s]."""
LEASE: Final = "Guard/Lease"
"""Token of whoever may write, 0 for nobody; written alone to take or give back, and first in every call that writes."""
HEARTBEAT: Final = "Guard/Heartbeat"
"""Must change while somebody holds the lease; else every block sheds to its local setpoint."""
SHED: Final = "Guard/Shed"
"""Whether the blocks shed because the heartbeat stopped or the lease was given back; a new lease ends it."""
PERMIT: Final = "Guard/Permit"
"""Whether the plant's operators let anybody take the lease."""
HOLD: Final = "Guard/Hold"
"""Whether the plant's own recipe waits, also when nobody holds the lease; a fallback that acted is not undone then.

Anybody who is trusted may let it wait, whoever holds the lease may let it go on."""
ALARM: Final = "Guard/Alarm"
"""What the control system's own alarm list shows of us; empty for nothing. It is written without a lease."""
ACKNOWLEDGED: Final = "Guard/Acknowledged"
"""Whether an operator of the plant has acknowledged it; whoever wrote it may acknowledge it too."""
TARGET, WORKING, RATE, MODE = "Target", "Working", "Rate", "Mode"
"""Of a block: the setpoint from outside, the target that it works with, the rate to it (0: at once), and its mode."""
REQUESTED, APPLY = "Requested", "Apply"
"""Of a block with two steps: what it would work with, and the word that makes it do so."""

NodeValue: TypeAlias = float | int | bool | str
"""What a node holds."""


class BlockMode(IntEnum):
    """Who sets the target of a block."""

    MANUAL = 0
    """An operator at the plant; nobody else may write."""
    AUTOMATIC = 1
    """The plant's own control: its local setpoint, or its controller."""
    REMOTE = 2
    """Whoever holds the lease."""


def of_block(tag: str, part: str) -> str:
    """Name of the node that is ``part`` of the block of ``tag``."""
    return f"{tag}/{part}"
