"""One block of the simulated control system: who sets a target, and what is made of a write to it."""

import math
from dataclasses import dataclass

from homeostat.domain.plant.tag import Range
from homeostat.domain.recovery import Command
from homeostat.links.opcua.server.nodes import APPLY, MODE, RATE, TARGET, BlockMode, NodeValue

GOOD = "Good"
"""Name of the status of a write that was taken."""


@dataclass(slots=True)
class Block:
    """The block of one writable tag."""

    tag: str
    """Name of the tag."""
    range: Range
    """What it may be set to, in the tag's unit."""
    automatic: bool
    """Whether automatic hands the output back to a controller; else automatic is the local setpoint."""
    two_step: bool
    """Whether a target is only shown as requested until it is applied."""
    mode: BlockMode = BlockMode.AUTOMATIC
    """Who sets the target."""
    target: float = 0.0
    """What was written last, in the tag's unit."""
    rate: float = 0.0
    """Rate to the target, in the tag's unit per second; 0 for a step."""
    requested: float = 0.0
    """With two steps, what it would work with, in the tag's unit."""
    working: float = 0.0
    """What it works with, in the tag's unit; on automatic what it had last."""

    def begin(self) -> None:
        """As it is before anybody touched it."""
        self.mode, self.target, self.rate, self.requested, self.working = BlockMode.AUTOMATIC, 0.0, 0.0, 0.0, 0.0

    def refusal(self, part: str, value: NodeValue, parts: dict[str, NodeValue]) -> str:
        """Name of the status with which ``value`` for ``part`` is refused; ``parts``: all that is written at once."""
        if self.mode is BlockMode.MANUAL:
            return "BadInvalidState"
        if part == MODE:
            return GOOD if value in (BlockMode.AUTOMATIC, BlockMode.REMOTE) else "BadOutOfRange"
        if part == APPLY:
            return GOOD if self.two_step else "BadNotWritable"
        if not (isinstance(value, float) and math.isfinite(value)):
            return "BadOutOfRange"
        if part == RATE:
            return GOOD if value >= 0.0 else "BadOutOfRange"
        if parts.get(MODE, self.mode) != BlockMode.REMOTE:
            return "BadInvalidState"
        return GOOD if self.range.contains(value) else "BadOutOfRange"

    def take(self, parts: dict[str, NodeValue], clamp: Range | None, ignore: bool) -> Command | None:
        """What the plant is commanded after ``parts`` were written, none of which was refused; None for nothing."""
        before, self.mode = self.mode, BlockMode(int(parts.get(MODE, self.mode)))
        if self.mode is not BlockMode.REMOTE:
            return Command(self.tag, None, None) if self.automatic and before is BlockMode.REMOTE else None
        self.rate = float(parts.get(RATE, self.rate))
        wanted = float(parts.get(TARGET, self.working))
        self.target = wanted if clamp is None else clamp.clip(wanted)
        if TARGET in parts:
            self.requested = self.target
        if self.two_step and not parts.get(APPLY):
            return None
        if ignore or not (TARGET in parts or APPLY in parts or before is not BlockMode.REMOTE):
            return None
        value = self.requested if self.two_step else self.target
        return Command(self.tag, value, self.rate or None)

    def shed(self) -> None:
        """Back to the plant's own control, unless an operator has it."""
        if self.mode is BlockMode.REMOTE:
            self.mode = BlockMode.AUTOMATIC
