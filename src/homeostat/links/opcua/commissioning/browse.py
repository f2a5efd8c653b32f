"""What a server has: every variable below its objects, with type, access, range and unit."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final

from asyncua import ua
from asyncua.client.client import Client
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds
from asyncua.ua.uaerrors import UaError

from homeostat.links.errors import LinkError
from homeostat.links.opcua.connection.session import status_name, told
from homeostat.links.opcua.mapping import server_url
from homeostat.links.opcua.security.security import Security

ANSWER_S: Final = 10.0
"""Longest wait for an answer [s]."""
MOST: Final = 50_000
"""Most nodes that are looked at: a server can make up folders without end."""
_WRITE_BIT: Final = 2


@dataclass(frozen=True, slots=True)
class ServerNode:
    """One variable of a server."""

    address: str
    """Its address."""
    name: str
    """Its browse name."""
    kind: str
    """Type of what it holds now: ``Double``, ``String``; empty where it holds nothing."""
    status: str
    """Status that is not good, with its code; empty where it is."""
    writable: bool
    """Whether the server says that we may write it."""
    low: float | None = None
    """Lower end of its range (EURange), in its unit."""
    high: float | None = None
    """Upper end of its range, in its unit."""
    unit: str = ""
    """Its unit (EngineeringUnits)."""


@asynccontextmanager
async def connected(url: str, security: Security) -> AsyncIterator[Client]:
    """A client at ``url`` for as long as this lasts; LinkError in one line where there is none."""
    security.check()
    try:
        server_url(url)
    except ValueError as wrong:
        raise LinkError(str(wrong)) from None
    client = Client(url, timeout=ANSWER_S)
    try:
        await security.apply(client)
        await asyncio.wait_for(client.connect(), 2.0 * ANSWER_S)
    except LinkError:
        raise
    except Exception as broken:  # sockets, certificates, time-outs: whatever a server can do
        raise LinkError(f"{url} cannot be connected to: {told(broken)}") from None
    try:
        yield client
    finally:
        await client.disconnect()


async def variables(client: Client) -> tuple[list[ServerNode], bool]:
    """The variables below the server's objects but those of the standard, the nearest first; whether these are all."""
    waiting, seen = deque([client.nodes.objects]), {client.nodes.objects.nodeid}
    found: list[str] = []
    while waiting and len(seen) < MOST:
        for child in await waiting.popleft().get_children_descriptions(ObjectIds.HierarchicalReferences):
            if child.NodeId in seen or child.NodeId.NamespaceIndex == 0:
                continue
            seen.add(child.NodeId)
            if child.NodeClass is not ua.NodeClass.Variable:
                waiting.append(client.get_node(child.NodeId))
            elif child.TypeDefinition.Identifier != ObjectIds.PropertyType:
                found.append(client.get_node(child.NodeId).nodeid.to_string())
    return await described(client, found[:MOST]), not waiting and len(found) <= MOST


async def described(client: Client, addresses: Sequence[str]) -> list[ServerNode]:
    """What the server says of the nodes at ``addresses``, in their order."""
    return [await _described(client, address) for address in addresses]


async def _described(client: Client, address: str) -> ServerNode:
    node = client.get_node(address)
    wanted = [AttributeIds.Value, AttributeIds.UserAccessLevel, AttributeIds.BrowseName]
    value, access, name = await node.read_attributes(wanted)
    properties = {p.BrowseName.Name: p.NodeId for p in await _properties(node)}
    held: dict[str, Any] = {}
    for wanted_name in ("EURange", "EngineeringUnits"):
        if wanted_name in properties:
            held[wanted_name] = await client.get_node(properties[wanted_name]).read_value()
    span, unit = held.get("EURange"), held.get("EngineeringUnits")
    status = value.StatusCode
    browse = None if name.Value is None else name.Value.Value
    rights = None if access.Value is None else access.Value.Value
    return ServerNode(
        address=address,
        name="" if browse is None else str(browse.Name),
        kind="" if value.Value is None or value.Value.Value is None else value.Value.VariantType.name,
        status="" if status is None or status.is_good() else status_name(int(status.value)),
        writable=isinstance(rights, int) and bool(rights & _WRITE_BIT),
        low=None if span is None else float(span.Low),
        high=None if span is None else float(span.High),
        unit="" if unit is None else str(unit.DisplayName.Text or ""),
    )


async def _properties(node: Any) -> list[Any]:
    try:
        return list(await node.get_children_descriptions(ObjectIds.HasProperty))
    except UaError:
        return []
