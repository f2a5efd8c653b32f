"""The mapping: which node of a server shows and takes which tag of a plant; a TOML file with types and bounds."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias
from urllib.parse import urlsplit

from annotated_types import Ge, Gt, Le
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from homeostat.links.errors import LinkError

MOST_BYTES: Final = 4_000_000
"""Longest mapping file [byte]."""


def _address(text: str) -> str:
    if not re.fullmatch(r"(ns=\d{1,5};)?[isgb]=.{1,400}", text):
        raise ValueError("say an address as ns=2;s=NAME or ns=2;i=85")
    return text


def server_url(text: str) -> str:
    """``text`` where it is the address of a server and nothing secret; else ValueError, which does not repeat it."""
    try:
        parts = urlsplit(text)
        reachable = bool(parts.hostname) and parts.port != 0  # a port beyond 65535, half an IPv6 address: ValueError
    except ValueError:
        reachable = False
    if not reachable or not re.fullmatch(r"opc\.tcp://[^/@\s]+(/[^\s@]*)?", text):
        raise ValueError("say a server's address as opc.tcp://HOST:PORT/PATH, without a name or a password")
    return text


def _scale(number: float) -> float:
    if number == 0.0:
        raise ValueError("a scale of 0 shows nothing; give the tag's units per unit of the node")
    return number


Address: TypeAlias = Annotated[str, AfterValidator(_address)]
"""Address of a node, as OPC UA writes it: ``ns=2;s=T1``."""
Number: TypeAlias = Annotated[float, Field(allow_inf_nan=False)]
Seconds: TypeAlias = Annotated[float, Gt(0.0), Le(3600.0), Field(allow_inf_nan=False)]
Kind: TypeAlias = Literal[
    "Double", "Float", "SByte", "Byte", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean"
]
"""Type in which a value is written; a server converts nothing."""
Ramp: TypeAlias = Literal["plant", "guard"]
"""Who moves a value at the commanded rate."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Connection(_Table):
    """``[connection]``: where the server is, and how long it may say nothing."""

    url: Annotated[str, AfterValidator(server_url)]
    """``opc.tcp://HOST:PORT/PATH``, without a name or a password."""
    publish_s: Annotated[float, Ge(0.01), Le(60.0)] = 0.25
    """How often the server sends what has changed, wall-clock [s]."""
    subscribe: bool = True
    """Whether the server has subscriptions; else every node is read as often as that."""
    answer_s: Annotated[float, Ge(0.1), Le(60.0)] = 3.0
    """Longest wait for an answer, wall-clock [s]."""
    dead_s: Annotated[float, Ge(0.5), Le(600.0)] = 3.0
    """The plant's side is dead when nothing that must change has changed for this long, wall-clock [s]."""
    retry_s: Annotated[float, Ge(0.1), Le(60.0)] = 0.5
    """First wait before a new connection; it doubles each time, wall-clock [s]."""
    retry_most_s: Annotated[float, Ge(0.1), Le(600.0)] = 1.5
    """Longest wait before a new connection, wall-clock [s]."""
    clock_s: Annotated[float, Gt(0.0), Le(86_400.0)] = 2.0
    """Largest difference between the server's clock and ours with which anything is written [s]."""
    namespaces: dict[Annotated[int, Ge(1), Le(65_535)], Annotated[str, Field(min_length=1, max_length=400)]] = {}
    """Number of a namespace in the addresses -> its URI, which the server must have there; nothing is checked where
    there is none."""


class Handshake(_Table):
    """``[guard]``: nodes by which both sides know of each other; every one may be left out."""

    counter: Address | None = None
    """Counts the plant's samples: it must change."""
    time: Address | None = None
    """Process time of the last sample [s]; without it the link's own clock is the process time."""
    heartbeat: Address | None = None
    """We count it up; the plant sheds to its local setpoints where it stops."""
    lease: Address | None = None
    """Token of whoever may write; it goes first in every write."""
    permit: Address | None = None
    """Whether the plant's operators let us write."""
    hold: Address | None = None
    """Takes, without a lease, that the plant's own recipe waits, and from who has the lease that it goes on."""
    alarm: Address | None = None
    """Takes, without a lease, what the control system's own alarm list shows of us."""
    acknowledged: Address | None = None
    """Whether an operator of the plant has acknowledged that; where it can be written, so do we what is seen here."""


class Writing(_Table):
    """``tags.TAG.write``: how a tag is commanded."""

    node: Address
    """Takes the target."""
    kind: Kind = "Double"
    """Type of the node."""
    ramp: Ramp
    """Who moves the value at the commanded rate; as the plant's table of writable tags has it."""
    rate: Address | None = None
    """Takes the rate before the target, in the node's unit per second, 0 for a step; only where the plant ramps."""
    feedback: Address | None = None
    """Shows the target that the plant works with; the node that is written, where None."""
    mode: Address | None = None
    """Shows and takes who sets the target, as a whole number."""
    remote: int = 2
    """Mode in which the node that is written counts."""
    automatic: int = 1
    """Mode in which the plant's own control sets the output."""
    requested: Address | None = None
    """With two steps: shows what the plant would work with."""
    apply: Address | None = None
    """With two steps: takes the word (true) after which it does."""


class TagNodes(_Table):
    """``[tags]``: one tag."""

    node: Address
    """Shows the value."""
    unit: str | None = None
    """Unit of the node; the tag's, where None. It is compared with the server's, and converts nothing."""
    scale: Annotated[Number, AfterValidator(_scale)] = 1.0
    """Tag's units per unit of the node."""
    offset: Number = 0.0
    """What the tag has where the node has 0, in the tag's unit."""
    uncertain: Literal["use", "bad"] = "use"
    """Whether a reading of uncertain quality is used with care, or not at all."""
    stale_s: Seconds | None = None
    """Oldest change of a reading that must change: it is told with its time from then on [s of process time]."""
    polled: bool = False
    """Whether the server has no subscription for the node, and it is read instead."""
    write: Writing | None = None
    """How it is commanded; None where it is only read."""

    def of_node(self, raw: float) -> float:
        """The tag's value where the node has ``raw``, in the tag's unit."""
        return raw * self.scale + self.offset

    def to_node(self, value: float) -> float:
        """What the node has where the tag has ``value``, in the node's unit."""
        return (value - self.offset) / self.scale


class LinkMapping(_Table):
    """A whole mapping file."""

    connection: Connection
    """Where the server is."""
    guard: Handshake = Handshake()
    """The handshake."""
    tags: dict[str, TagNodes]
    """Tag -> its nodes."""

    @property
    def digest(self) -> str:
        """SHA-256 over everything that it states; in which order and how its file writes that does not matter."""
        stated = json.dumps(self.model_dump(exclude_unset=True), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(stated.encode("ascii")).hexdigest()

    def readable(self) -> dict[str, bool]:
        """Address of every node that is read -> whether it is polled."""
        guard = self.guard
        shared = (guard.counter, guard.time, guard.lease, guard.permit, guard.hold, guard.acknowledged)
        found = {node: False for node in shared if node is not None}
        for tag in self.tags.values():
            found[tag.node] = tag.polled
            if (write := tag.write) is not None:
                for node in (write.feedback or write.node, write.mode):
                    if node is not None:
                        found.setdefault(node, tag.polled)
        return found

    @property
    def numbers(self) -> set[int]:
        """Number of every namespace that an address has, but for that of the standard."""
        addresses = {a for a in (*self.readable(), *self.written(), *self._requested()) if a.startswith("ns=")}
        return {number for a in addresses if (number := int(a[3 : a.index(";")]))}

    def _requested(self) -> Iterator[str]:
        return (tag.write.requested for tag in self.tags.values() if tag.write and tag.write.requested)

    def written(self) -> frozenset[str]:
        """Address of every node that is written."""
        guard = self.guard
        found = {guard.heartbeat, guard.lease, guard.hold, guard.alarm, guard.acknowledged}
        for write in filter(None, (tag.write for tag in self.tags.values())):
            found |= {write.node, write.rate, write.mode, write.apply}
        return frozenset(node for node in found if node is not None)


def read_mapping(path: Path) -> LinkMapping:
    """The mapping in ``path``; LinkError in one line with the entry, the value and what it may be."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise LinkError(f"{str(path)!r} is longer than {MOST_BYTES} bytes; a mapping is not")
        content = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise LinkError(f"{str(path)!r} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # no TOML, or no UTF-8
        raise LinkError(f"{str(path)!r} is no TOML file: {error}; correct it") from None
    return mapping_of(content, str(path))


def mapping_of(content: object, name: str) -> LinkMapping:
    """The mapping that ``content`` states; LinkError that begins with ``name``."""
    try:
        mapping = LinkMapping.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        entry = ".".join(map(str, first["loc"]))
        given = "" if entry == "connection.url" else f" (given: {first['input']!r:.60})"  # it may hold a password
        raise LinkError(f"{name}: {entry}: {first['msg']}{given}") from None
    for tag, nodes in mapping.tags.items():
        if nodes.write is not None and (problem := _contradiction(nodes.write)):
            raise LinkError(f"{name}: tags.{tag}.write: {problem}")
    stated = mapping.connection.namespaces
    if stated and (unknown := mapping.numbers - stated.keys()):
        raise LinkError(f"{name}: connection.namespaces: addresses have ns={min(unknown)}, which is not stated there")
    return mapping


def _contradiction(write: Writing) -> str:
    """What in ``write`` excludes something else in it; empty where nothing does."""
    if write.rate is not None and write.ramp == "guard":
        return "the guard ramps, so the plant must not; leave 'rate' out, or say ramp = 'plant'"
    if (write.requested is None) != (write.apply is None):
        return "'requested' and 'apply' belong together; give both or none"
    return ""
