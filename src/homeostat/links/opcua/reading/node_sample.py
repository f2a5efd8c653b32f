"""A sample of the plant with what the nodes of a control system said; it needs no client to be read."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from homeostat.domain.snapshot import Snapshot
from homeostat.links.opcua.connection.board import NodeReading


@dataclass(frozen=True, slots=True)
class NodeSample(Snapshot):
    """A sample with what the nodes held when it was taken: several may wait, and the board knows the last one only."""

    readings: Mapping[str, NodeReading] = field(default_factory=dict, compare=False, repr=False)
    """Address -> what the server said of that node, as of this sample."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process is told of the plant, and not of its nodes."""
        return Snapshot, tuple(getattr(self, each.name) for each in fields(Snapshot))
