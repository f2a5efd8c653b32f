"""One connection to a server, from its client to its end: it is never mended, the next one is a new one."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, Final

from asyncua import ua
from asyncua.client.client import Client
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds

from homeostat.links.errors import LinkError
from homeostat.links.opcua.connection.board import QUEUE, Board, NodeReading, Raw
from homeostat.links.opcua.mapping import Connection
from homeostat.links.opcua.security.security import Security
from homeostat.links.opcua.writing.kinds import COUNT, cast, largest
from homeostat.links.opcua.writing.writes import NodeWrite

SESSION_S: Final = 30.0
"""Longest silence after which a server forgets us [s]."""
PER_CALL: Final = 500
"""Most nodes in one call."""
NAMESPACES: Final = f"i={ObjectIds.Server_NamespaceArray}"
"""Where a server shows the URIs of its namespaces, by number."""
GONE_S: Final = 1.0
"""Longest wait for a connection that is closed [s]."""
_BUILT_IN: Final[Mapping[object, str]] = {kind.value: kind.name for kind in ua.VariantType}
"""Number of a type of OPC UA -> its name."""
_FIRST_YEAR, _LAST_YEAR = 1601, 9999


class Session:
    """A client and its subscription."""

    def __init__(self, connection: Connection, security: Security, board: Board) -> None:
        """Nothing is opened before :meth:`open`; what comes goes to ``board``."""
        self._connection, self._security, self._board = connection, security, board
        self._client = Client(connection.url, timeout=connection.answer_s, watchdog_intervall=connection.dead_s)
        self._client.name = "Homeostat link"
        self._client.session_timeout = int(SESSION_S * 1000)
        self._client.connection_lost_callback = self._broken
        self._handles: dict[int, str] = {}
        self._kinds: dict[str, str] = {}
        self._polling: asyncio.Task[None] | None = None
        self.lost: str = ""
        """Why there is nothing more to come; empty while there may be."""

    async def connect(self) -> None:
        """Reach the server, and show it who we are; raises where anything of it fails."""
        await self._security.apply(self._client)
        await self._client.connect()

    async def open(self, nodes: Mapping[str, bool], written: Collection[str]) -> None:
        """Have ``nodes`` shown (address -> whether it is polled), and learn what those that are ``written`` hold.

        A node that the server does not know is shown as bad. Raises where anything else fails.
        """
        if stated := self._connection.namespaces:
            (found,) = await self.read((NAMESPACES,))
            refuse_other_namespaces(stated, () if found.Value is None else found.Value.Value or ())
        await self._learn(tuple(written))
        subscribed = [node for node, polled in nodes.items() if self._connection.subscribe and not polled]
        polled = [node for node in nodes if node not in subscribed]
        self._show(nodes, await self.read(tuple(nodes)))
        if subscribed:
            await self._subscribe(subscribed)
        if polled:
            self._polling = asyncio.get_running_loop().create_task(self._poll(tuple(polled)))

    async def read(self, nodes: Sequence[str], attribute: AttributeIds = AttributeIds.Value) -> list[ua.DataValue]:
        """What ``nodes`` hold, in their order; raises where the server does not answer."""
        found: list[ua.DataValue] = []
        for start in range(0, len(nodes), PER_CALL):
            ids = [ua.NodeId.from_string(node) for node in nodes[start : start + PER_CALL]]
            found += await self._client.uaclient.session.read_attributes(ids, attribute)
        return found

    async def write(self, writes: Sequence[NodeWrite]) -> list[str]:
        """Write in one call, each with its node's type and without a time; name of each status that is not good, or ''.

        LinkError where a value is none of its node, and nothing is written.
        """
        items = [
            ua.WriteValue(
                NodeId=ua.NodeId.from_string(w.node),
                AttributeId=AttributeIds.Value,
                Value=ua.DataValue(_variant(w, self.kind(w))),
            )
            for w in writes
        ]
        parameters = ua.WriteParameters(NodesToWrite=items)
        statuses = await self._client.uaclient.session.write(parameters)
        return ["" if status.is_good() else status.name for status in statuses]

    def kind(self, write: NodeWrite) -> str:
        """Type of the node of ``write``, as the server shows it; else as the order says."""
        return self._kinds.get(write.node, write.kind)

    def largest(self, node: str) -> int:
        """Up to what we can count in ``node``."""
        return largest(self._kinds[node]) if node in self._kinds else COUNT

    def unfit(self, writes: Sequence[NodeWrite]) -> str:
        """Which of ``writes`` its node cannot hold; empty where there is none."""
        try:
            for write in writes:
                cast(write.value, self.kind(write), write.node)
        except LinkError as wrong:
            return str(wrong)
        return ""

    async def _learn(self, nodes: tuple[str, ...]) -> None:
        """Take note of the types of ``nodes``: of what they hold, else of what they are declared to."""
        for node, held in zip(nodes, await self.read(nodes), strict=True):
            if held.Value is not None and held.Value.Value is not None:
                self._kinds[node] = held.Value.VariantType.name
        left = [node for node in nodes if node not in self._kinds]
        for node, declared in zip(left, await self.read(left, AttributeIds.DataType), strict=True):
            kind = None if declared.Value is None else declared.Value.Value
            if isinstance(kind, ua.NodeId) and kind.NamespaceIndex == 0 and kind.Identifier in _BUILT_IN:
                self._kinds[node] = _BUILT_IN[kind.Identifier]

    async def close(self) -> None:
        """Go, politely where the server listens; it is left behind where it does not."""
        if self._polling is not None:
            self._polling.cancel()
        with contextlib.suppress(Exception):
            await asyncio.wait_for(self._client.disconnect(), GONE_S)
        with contextlib.suppress(Exception):
            self._client.disconnect_socket()

    async def _broken(self, error: Exception) -> None:
        """The client has lost its connection; it is not to mend it."""
        self.lost = self.lost or f"the connection broke: {told(error)}"

    async def _subscribe(self, nodes: list[str]) -> None:
        parameters = ua.CreateSubscriptionParameters(
            RequestedPublishingInterval=self._connection.publish_s * 1000,
            RequestedLifetimeCount=max(int(SESSION_S / self._connection.publish_s), 30),
            RequestedMaxKeepAliveCount=max(int(self._connection.dead_s / self._connection.publish_s / 2), 1),
            MaxNotificationsPerPublish=0,
            PublishingEnabled=True,
        )
        session = self._client.uaclient.session
        made = await session.create_subscription(parameters, self._published)
        self._handles = dict(enumerate(nodes, start=1))
        items = [
            ua.MonitoredItemCreateRequest(
                ItemToMonitor=ua.ReadValueId(NodeId=ua.NodeId.from_string(node), AttributeId=AttributeIds.Value),
                MonitoringMode=ua.MonitoringMode.Reporting,
                RequestedParameters=ua.MonitoringParameters(
                    ClientHandle=handle,
                    SamplingInterval=self._connection.publish_s * 1000,
                    QueueSize=QUEUE,
                    DiscardOldest=True,
                ),
            )
            for handle, node in self._handles.items()
        ]
        for start in range(0, len(items), PER_CALL):
            chunk = ua.CreateMonitoredItemsParameters(
                SubscriptionId=made.SubscriptionId,
                TimestampsToReturn=ua.TimestampsToReturn.Both,
                ItemsToCreate=items[start : start + PER_CALL],
            )
            await session.create_monitored_items(chunk)

    async def _published(self, result: Any) -> None:
        """Everything that one answer of the server brings: the newest of all nodes together, and last."""
        data = result.NotificationMessage.NotificationData or ()
        found: dict[str, list[ua.DataValue]] = {}
        for notification in data:
            if isinstance(notification, ua.DataChangeNotification):
                for item in notification.MonitoredItems:
                    if (node := self._handles.get(item.ClientHandle)) is not None:
                        found.setdefault(node, []).append(item.Value)
            elif isinstance(notification, ua.StatusChangeNotification):
                self.lost = f"the server ended the subscription: {notification.Status.name}"
        for back in range(max(map(len, found.values()), default=0), 0, -1):
            batch = {node: values[-back] for node, values in found.items() if len(values) >= back}
            self._show(batch, batch.values())

    async def _poll(self, nodes: tuple[str, ...]) -> None:
        while True:
            try:
                self._show(nodes, await self.read(nodes))
            except Exception as broken:  # the client's own errors, time-outs and whatever the socket raises
                self.lost = f"the server is not read any more: {told(broken)}"
                return
            await asyncio.sleep(self._connection.publish_s)

    def _show(self, nodes: Any, values: Any) -> None:
        now_s, now = time.monotonic(), datetime.now(UTC)
        self._board.put({node: _reading(value, now_s, now) for node, value in zip(nodes, values, strict=True)})


def refuse_other_namespaces(stated: Mapping[int, str], found: Sequence[str]) -> None:
    """LinkError where a namespace of the server, ``found`` by number, is not the one that is ``stated`` for it.

    A server may number them anew when its configuration changes, and an address is of another node then.
    """
    for number, uri in stated.items():
        there = found[number] if number < len(found) else None
        if there != uri:
            has = "no such namespace" if there is None else f"{there!r:.100}"
            raise LinkError(
                f"ns={number} is {uri!r:.100} in the mapping, and the server has {has} there: addresses would be of "
                "other nodes; look at each of them, and state the namespaces as they are now"
            )


def _reading(value: ua.DataValue, now_s: float, now: datetime) -> NodeReading:
    raw: Raw = None
    if value.Value is not None and isinstance(value.Value.Value, float | int | bool | str):
        raw = value.Value.Value
    status = 0 if value.StatusCode is None else int(value.StatusCode.value)
    return NodeReading(raw, status, _utc(value.SourceTimestamp), _utc(value.ServerTimestamp), now_s, now)


def _variant(write: NodeWrite, kind: str) -> ua.Variant:
    held = cast(write.value, kind, write.node)
    return ua.Variant(ua.LocalizedText(str(held)) if kind == "LocalizedText" else held, ua.VariantType[kind])


def _utc(at: datetime | None) -> datetime | None:
    """``at`` with its zone; None also for the ends of the calendar, by which servers say that they have no time."""
    if at is None or not _FIRST_YEAR < at.year < _LAST_YEAR:
        return None
    return at if at.tzinfo is not None else at.replace(tzinfo=UTC)


def status_name(status: int) -> str:
    """Name and code of an OPC UA status: ``BadSensorFailure (0x808C0000)``."""
    return f"{ua.StatusCode(ua.UInt32(status)).name} (0x{status:08X})"


def told(error: BaseException) -> str:
    """What ``error`` says, in one line, and what it is where it says nothing."""
    if isinstance(error, LinkError):
        return str(error)
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text:.200}" if text else type(error).__name__
