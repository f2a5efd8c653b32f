"""The control system in front of a simulated plant: blocks with modes, one lease, a heartbeat, an alarm list."""

import math
from collections.abc import Mapping, Sequence

from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.ports import Wire
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.opcua.server.behaviour import Behaviour
from homeostat.links.opcua.server.block import GOOD, Block
from homeostat.links.opcua.server.nodes import (
    ACKNOWLEDGED,
    ALARM,
    APPLY,
    COUNTER,
    HEARTBEAT,
    HOLD,
    LEASE,
    MODE,
    PERMIT,
    RATE,
    REQUESTED,
    SHED,
    TARGET,
    TIME,
    WORKING,
    BlockMode,
    NodeValue,
    of_block,
)
from homeostat.links.simulated import SimulatedLink

DENIED = "BadUserAccessDenied"
"""Name of the status of a write by somebody who does not hold the lease."""
MOST_TEXT = 500
"""Longest text of an alarm [characters]."""


class ControlSystem:
    """Everything that a served plant has but the wire protocol: nodes by name, what they hold, and what writes do."""

    def __init__(
        self,
        link: SimulatedLink,
        tags: Mapping[str, Tag],
        writable: Mapping[str, bool],
        two_step: bool = False,
        tick_s: float = TICK_S,
    ) -> None:
        """``writable``: tag that has a block -> whether it may be handed back to a controller.

        ``two_step``: a target must be applied after it was requested; ``tick_s``: process time between samples [s].
        """
        self.behaviour = Behaviour()
        """What is wrong with it."""
        self.tags = dict(tags)
        """Name of every reading -> its tag."""
        self.blocks = {tag: Block(tag, tags[tag].range, auto, two_step) for tag, auto in writable.items()}
        """Tag -> its block."""
        self.scale = 1.0
        """Process seconds per wall-clock second; 0 while it goes on by steps only."""
        self.tick_s = tick_s
        """Process time between two samples [s]."""
        self._counter = 0
        self.begin(link)

    def begin(self, link: SimulatedLink) -> None:
        """Go on with the plant behind ``link``, which is at its start, and with blocks that nobody has touched."""
        self.link = link
        """The plant."""
        self.permitted = True
        """Whether its operators let anybody take the lease."""
        self.hold = False
        """Whether its own recipe waits because somebody outside said so."""
        self.alarm, self.acknowledged = "", True
        """What its alarm list shows of somebody outside, and whether an operator has acknowledged it."""
        self._wire: Wire | None = None
        self._token = self._heartbeat = 0
        self._values: dict[str, float] = dict.fromkeys(self.tags, 0.0)
        for block in self.blocks.values():
            block.begin()
        self.advance()

    def advance(self) -> Snapshot:
        """One tick later; the sample."""
        sample = self.link.advance()
        self._counter = (self._counter + 1) % 2**32
        known = {tag: v for tag, v in sample.values.items() if tag in self.tags}
        self._values |= {tag: v for tag, v in known.items() if math.isfinite(v) or tag not in self.blocks}
        if self._token and self.link.shed:
            self._over()
        self._follow(sample.accepted)
        return sample

    def values(self) -> dict[str, NodeValue]:
        """Name of every node -> what it holds now."""
        held: dict[str, NodeValue] = dict(self._values)
        for tag, block in self.blocks.items():
            held |= {
                of_block(tag, TARGET): block.target,
                of_block(tag, WORKING): block.working,
                of_block(tag, RATE): block.rate,
                of_block(tag, MODE): int(block.mode),
            }
            if block.two_step:
                held |= {of_block(tag, REQUESTED): block.requested, of_block(tag, APPLY): False}
        held |= {LEASE: self._token, HEARTBEAT: self._heartbeat, SHED: self.link.shed, PERMIT: self.permitted}
        held |= {HOLD: self.hold, ALARM: self.alarm, ACKNOWLEDGED: self.acknowledged}
        return held | {TIME: self.link.now_s, COUNTER: self._counter}

    def writable(self, node: str) -> bool:
        """Whether the node called ``node`` can be written at all."""
        tag, _, part = node.rpartition("/")
        if tag in self.blocks:
            return part in (TARGET, RATE, MODE, APPLY)
        return node in (LEASE, HEARTBEAT, HOLD, ALARM, ACKNOWLEDGED)

    def write(self, writes: Sequence[tuple[str, NodeValue]]) -> list[str]:
        """What becomes of one call with several ``writes``: the name of the OPC UA status of each."""
        tokens = [int(value) for node, value in writes if node == LEASE]
        if len(writes) == len(tokens) == 1:
            return [self._take(tokens[0])]
        if not tokens and all(_moves_nothing(node, value) for node, value in writes):
            return [self._of_guard(node, value) for node, value in writes]
        if not tokens or tokens[0] != self._token or self._token == 0:
            return [DENIED] * len(writes)
        statuses = [self._of_guard(node, value) for node, value in writes]
        by_tag: dict[str, dict[str, NodeValue]] = {}
        for node, value in writes:
            tag, _, part = node.rpartition("/")
            if tag in self.blocks:
                by_tag.setdefault(tag, {})[part] = value
        return self._of_blocks([node for node, _ in writes], by_tag, statuses)

    def operate(self, tag: str, value: float | None, rate: float | None = None) -> None:
        """An operator at the plant takes the block of ``tag`` and moves it; None for its controller.

        ValueError where there is none, or it has no controller.
        """
        self.link.operate(tag, value, rate)
        if tag in self.blocks:
            self.blocks[tag].mode = BlockMode.AUTOMATIC if value is None else BlockMode.MANUAL
        self._follow({tag: value})

    def release(self, tag: str) -> None:
        """The operator leaves the block of ``tag`` to automatic again; KeyError where there is none."""
        block = self.blocks[tag]
        block.mode = BlockMode.AUTOMATIC
        if block.automatic:
            self.link.operate(tag, None)

    def _take(self, token: int) -> str:
        """Somebody takes the lease, or gives it back with 0."""
        if token == 0:
            self.link.give_back()
            self._over()
            return GOOD
        if not self.permitted:
            return DENIED
        self._wire, self._token = self.link.take(), token
        self.link.beat()  # whoever dies before the first heartbeat must not hold the plant for ever
        return GOOD

    def _over(self) -> None:
        self._wire, self._token = None, 0
        for block in self.blocks.values():
            block.shed()

    def _of_guard(self, node: str, value: NodeValue) -> str:
        """What becomes of a write by the holder to a node that belongs to no block; good for all others."""
        if node == HEARTBEAT:
            if value != self._heartbeat:
                self._heartbeat = int(value)
                try:
                    self.link.beat()
                except LinkError:
                    return "BadInvalidState"
        elif node == HOLD:
            self.hold = bool(value)
        elif node == ALARM:
            self.alarm, self.acknowledged = str(value)[:MOST_TEXT], not value
        elif node == ACKNOWLEDGED:
            self.acknowledged = bool(value)
        elif not self.writable(node):
            return "BadNotWritable"
        return GOOD

    def _of_blocks(self, nodes: list[str], by_tag: dict[str, dict[str, NodeValue]], statuses: list[str]) -> list[str]:
        """The statuses of one call after what was written to blocks has reached the plant, in the order of the tags."""
        behaviour = self.behaviour
        commands: list[Command] = []
        for tag, parts in by_tag.items():
            block = self.blocks[tag]
            refusals = {part: block.refusal(part, value, parts) for part, value in parts.items()}
            if tag in behaviour.refused:
                refusals = dict.fromkeys(parts, "BadNotWritable")
            for part, status in refusals.items():
                statuses[nodes.index(of_block(tag, part))] = status
            if all(status == GOOD for status in refusals.values()):
                command = block.take(parts, behaviour.clamped.get(tag), tag in behaviour.ignored)
                commands += [] if command is None else [command]
        if not commands:
            return statuses
        assert self._wire is not None, "somebody holds the lease"
        error = self._wire.send(tuple(commands)).error
        self._follow({c.tag: c.value for c in commands})
        return [DENIED] * len(statuses) if error else statuses

    def _follow(self, accepted: Mapping[str, float | None]) -> None:
        """Take note of the targets that the plant works with."""
        for tag, target in accepted.items():
            if tag in self.blocks and target is not None:
                self.blocks[tag].working = target


def _moves_nothing(node: str, value: NodeValue) -> bool:
    """Whether this may be written without the lease: words for people, and a recipe that is to wait."""
    return node in (ALARM, ACKNOWLEDGED) or (node == HOLD and value is True)
