"""What a served plant does wrong, by an engineer's order: tests ask for it, and nothing of it happens by itself."""

from dataclasses import dataclass, field

from homeostat.domain.plant.tag import Range


@dataclass(slots=True)
class Behaviour:
    """What is wrong at present; a fresh one misbehaves in nothing."""

    refused: set[str] = field(default_factory=set)
    """Tags whose target is refused as not writable."""
    ignored: set[str] = field(default_factory=set)
    """Tags whose target is taken with a good answer, and not worked with."""
    clamped: dict[str, Range] = field(default_factory=dict)
    """Tag -> range into which its target is brought without a word, in the tag's unit."""
    qualities: dict[str, str] = field(default_factory=dict)
    """Tag -> name of the OPC UA status that its reading has."""
    texts: set[str] = field(default_factory=set)
    """Tags whose reading comes as a text."""
    counter_stands: bool = False
    """Whether the counter of samples stands while everything else goes on."""
    clock_offset_s: float = 0.0
    """How far the server's clock is ahead [s]."""
    silent_writes: bool = False
    """Whether writes are carried out and never answered."""
    drop_every_s: float = 0.0
    """All connections are cut this often, wall-clock [s]; 0 for never."""
    stall_s: float = 0.0
    """For so long the whole server does nothing, once, wall-clock [s]."""
