"""From commands to what is written: ranges, rates, units and types, checked once more against the plant's tables."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import Command
from homeostat.links.errors import LinkError
from homeostat.links.opcua.agreement import refuse_disagreement
from homeostat.links.opcua.mapping import Kind, LinkMapping, TagNodes, Writing
from homeostat.links.opcua.writing.kinds import cast

SLACK: Final = 1e-9
"""Share of a range or a rate by which rounding may pass it [1]."""


@dataclass(frozen=True, slots=True)
class NodeWrite:
    """One value for one node."""

    node: str
    """Address."""
    value: float | int | bool | str
    """The value, in the node's unit."""
    kind: Kind | str
    """Its type, where the server does not say which one the node has."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What a node must show after a write."""

    tag: str
    """The tag that was commanded."""
    node: str
    """Address."""
    value: float
    """What it must show, in the node's unit."""
    tolerance: float
    """By how much it may differ, in the node's unit."""


@dataclass(frozen=True, slots=True)
class WriteOrder:
    """What is written in one call, and what follows it."""

    writes: tuple[NodeWrite, ...]
    """One call."""
    read_back: tuple[Expected, ...]
    """What must be read back after it."""
    applies: tuple[NodeWrite, ...]
    """The second call of two steps, once everything is read back; empty where there is none."""


class Translation:
    """Knows what may be written, from the plant's configuration, and how, from the mapping."""

    def __init__(self, mapping: LinkMapping, rules: GuardRules) -> None:
        """LinkError where the mapping says something else than the plant's tables."""
        refuse_disagreement(mapping, rules)
        self._mapping, self._rules = mapping, rules

    def order(self, commands: tuple[Command, ...]) -> WriteOrder:
        """What is written for all of ``commands``; LinkError, and nothing is written, where one of them may not be."""
        writes: list[NodeWrite] = []
        read_back: list[Expected] = []
        applies: list[NodeWrite] = []
        for command in commands:
            nodes, write = self._checked(command)
            if write.mode is not None:
                mode = write.automatic if command.value is None else write.remote
                writes.append(NodeWrite(write.mode, mode, "Int32"))
            if command.value is None:
                continue
            if write.rate is not None:
                rate = 0.0 if command.rate is None else abs(command.rate / nodes.scale)
                writes.append(NodeWrite(write.rate, rate, "Double"))
            raw = cast(nodes.to_node(command.value), write.kind, repr(command.tag))
            writes.append(NodeWrite(write.node, raw, write.kind))
            tolerance = abs(self._rules.writables[command.tag].tolerance / nodes.scale)
            read_back.append(Expected(command.tag, write.requested or write.node, float(raw), tolerance))
            if write.apply is not None:
                applies.append(NodeWrite(write.apply, True, "Boolean"))
        return WriteOrder(tuple(writes), tuple(read_back), tuple(applies))

    def _checked(self, command: Command) -> tuple[TagNodes, Writing]:
        """The nodes of the tag of ``command``, which may be written; else LinkError."""
        nodes, rule = self._mapping.tags.get(command.tag), self._rules.writables.get(command.tag)
        if nodes is None or nodes.write is None or rule is None:
            raise LinkError(f"{command.tag!r} cannot be commanded over this link; its mapping has no way to write it")
        tag, value, rate = self._rules.tags[command.tag], command.value, command.rate
        if value is None:
            if not rule.automatic or nodes.write.mode is None:
                raise LinkError(f"{command.tag!r} has no automatic mode to be handed back to")
            return nodes, nodes.write
        slack = SLACK * tag.range.span
        if not (math.isfinite(value) and tag.range.low - slack <= value <= tag.range.high + slack):
            raise LinkError(
                f"{command.tag!r} cannot be {value:g} {tag.unit}: its range is {tag.range.low:g} to "
                f"{tag.range.high:g} {tag.unit}"
            )
        fastest = max(rule.fastest or 0.0, tag.rate_limit or 0.0) or math.inf
        if rate is None and rule.ramped_by is Side.PLANT and tag.rate_limit is not None:  # else each step is one
            raise LinkError(
                f"{command.tag!r} cannot step to {value:g} {tag.unit}: it needs a rate, and {fastest:g} "
                f"{tag.unit}/s are allowed"
            )
        if rate is not None and not 0.0 < rate <= fastest * (1.0 + SLACK):
            raise LinkError(
                f"{command.tag!r} cannot move at {rate:g} {tag.unit}/s: {fastest:g} {tag.unit}/s are allowed"
            )
        return nodes, nodes.write
