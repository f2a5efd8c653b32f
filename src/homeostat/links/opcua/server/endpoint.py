"""The OPC UA side of a served plant: its address space, security, and a clock that advances it in scaled time."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from asyncua import ua
from asyncua.crypto.truststore import TrustStore
from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
from asyncua.server.server import Server
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.status_codes import StatusCodes

from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import SERVED
from homeostat.links.opcua.server.access import Attributes, Users
from homeostat.links.opcua.server.control_system import ControlSystem
from homeostat.links.opcua.server.nodes import COUNTER, MODE, TIME, URI, NodeValue

MOST_LATE_S: Final = 60.0
"""A plant that is later than this goes on from where it is, instead of catching up, wall-clock [s]."""
HISTORY: Final = timedelta(days=7)
"""Oldest value of raw history."""
BATCH: Final = 20
"""Most seconds of process time between two looks at the network."""
EACH: Final = 3
"""Most samples that are due at once and shown one by one; of more, the last one alone."""


@dataclass(frozen=True, slots=True)
class Serving:
    """How a plant is served."""

    port: int = 4840
    """TCP port; 0 lets the system choose."""
    host: str = "127.0.0.1"
    """Address that it listens at."""
    scale: float = 1.0
    """Process seconds per wall-clock second; 0 for a plant that an engineer advances step by step."""
    pki: Pki | None = None
    """Own certificate and the clients that are trusted; None without encryption."""
    insecure: bool = False
    """Whether anybody may read without encryption."""
    login: tuple[str, str] | None = field(default=None, repr=False)
    """Name and password that everybody needs; None for none."""
    history: int = 0
    """Values that are kept of each reading for raw history; 0 for none."""


class Endpoint:
    """Serves a control system until it is cancelled."""

    def __init__(self, control: ControlSystem, serving: Serving) -> None:
        """Nothing is opened before :meth:`start`."""
        self.control, self._serving = control, serving
        control.scale = serving.scale
        self._ids: dict[str, ua.NodeId] = {}
        self._shown: dict[str, NodeValue] = {}
        self._dropped_s, self._showing = 0.0, asyncio.Lock()

    async def start(self) -> int:
        """Make the address space and listen; the port."""
        serving, users = self._serving, Users(self._serving.login)
        self._server = server = Server(user_manager=users)  # type: ignore[arg-type]  # it is not a base class
        await server.init()
        server.set_endpoint(f"opc.tcp://{serving.host}:{serving.port}/homeostat/")
        server.set_server_name("Homeostat served plant")
        await server.set_application_uri(SERVED)
        policies = [ua.SecurityPolicyType.NoSecurity] if serving.insecure else []
        if serving.pki is not None:
            policies.append(ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt)
            await server.load_certificate(serving.pki.certificate)
            await server.load_private_key(serving.pki.key)
            trust = TrustStore([serving.pki.trusted], [])
            await trust.load()
            options = CertificateValidatorOptions.TRUSTED_VALIDATION | CertificateValidatorOptions.PEER_CLIENT
            server.set_certificate_validator(CertificateValidator(options, trust))
        server.set_security_policy(policies)
        if serving.login is not None:
            server.set_identity_tokens([ua.UserNameIdentityToken])
        else:
            server.set_identity_tokens([ua.AnonymousIdentityToken])
        index = await server.register_namespace(URI)
        await self._populate(server, index)
        service = Attributes(server.iserver.aspace, index, self._written)
        server.iserver.attribute_service = service
        await server.start()
        listening: Any = server.bserver
        return int(listening._server.sockets[0].getsockname()[1])

    async def run(self) -> None:
        """Advance the plant in scaled time, show every sample, and misbehave as told; until cancelled."""
        due_s = time.monotonic()
        while True:
            await self._misbehave()
            now_s, scale = time.monotonic(), self.control.scale / self.control.tick_s
            if scale == 0.0:
                due_s = now_s
            else:
                due_s = max(due_s, now_s - MOST_LATE_S)
                steps = min(int((now_s - due_s) * scale) + 1, BATCH) if now_s >= due_s else 0
                for step in range(steps):
                    self.control.advance()
                    if steps <= EACH and step < steps - 1:
                        await self.show()
                if steps:
                    due_s += steps / scale
                    await self.show()
            await asyncio.sleep(min(max(due_s - time.monotonic(), 0.0), 0.05) if scale > 0.0 else 0.02)

    async def stop(self) -> None:
        """Close all connections."""
        await self._server.stop()

    async def show(self) -> None:
        """Put what the control system holds into the nodes after a sample; the counter last: the rest is there then."""
        async with self._showing:
            values, taken = self.control.values(), self._now()  # one sample has one time, as in a controller's scan
            for tag in self.control.tags:
                await self._put(tag, values[tag], taken)
            await self._put_commanded(taken)
            await self._put(TIME, values[TIME], taken)
            if not self.control.behaviour.counter_stands:
                await self._put(COUNTER, values[COUNTER], taken)

    async def show_commanded(self) -> None:
        """Put what blocks and guard hold into the nodes, where it changed."""
        async with self._showing:  # one at a time, or an older value would be put after a newer one
            await self._put_commanded(self._now())

    def _now(self) -> datetime:
        """What time it is by the server's clock (UTC)."""
        return datetime.now(UTC) + timedelta(seconds=self.control.behaviour.clock_offset_s)

    async def _put_commanded(self, taken: datetime) -> None:
        for name, value in self.control.values().items():
            if name not in self.control.tags and name not in (TIME, COUNTER) and self._shown.get(name) != value:
                await self._put(name, value, taken)

    async def _put(self, name: str, value: NodeValue, taken: datetime) -> None:
        behaviour, before = self.control.behaviour, self._shown.get(name)
        status = ua.StatusCode(getattr(StatusCodes, behaviour.qualities.get(name, "Good")))
        if name in behaviour.texts:
            value = f"{value:.3f}"
        self._shown[name] = value
        if before is not None and type(before) is not type(value):
            await self._change_type(self._ids[name], _variant(name, value).VariantType)
        await self._server.write_attribute_value(
            self._ids[name], ua.DataValue(_variant(name, value), status, _utc(taken), _utc(taken))
        )

    async def _change_type(self, node: ua.NodeId, kind: ua.VariantType) -> None:
        """Let ``node`` hold values of another ``kind``: it must hold nothing before it does."""
        status = ua.StatusCode(ua.UInt32(StatusCodes.BadWaitingForInitialData))
        now = _utc(datetime.now(UTC))
        nothing = ua.DataValue(ua.Variant(None, ua.VariantType.Null), status, now, now)
        kinds = ua.DataValue(ua.Variant(ua.NodeId(ua.Int32(kind.value)), ua.VariantType.NodeId))
        await self._server.write_attribute_value(node, kinds, AttributeIds.DataType)
        await self._server.write_attribute_value(node, nothing)

    async def _populate(self, server: Server, index: int) -> None:
        """Make a folder for the plant, an object for each block and one for the guard, and all variables."""
        plant = await server.nodes.objects.add_folder(_id("Plant", index), ua.QualifiedName("Plant", index))
        folders: dict[str, Any] = {}
        for name, value in self.control.values().items():
            folder, _, part = name.rpartition("/")
            if folder and folder not in folders:
                id_, browse = _id(f"{folder}/", index), ua.QualifiedName(f"{folder} block", index)
                folders[folder] = await plant.add_object(id_, browse)
            node = await folders.get(folder, plant).add_variable(
                _id(name, index), ua.QualifiedName(part, index), _variant(name, value)
            )
            self._ids[name] = node.nodeid
            if self.control.writable(name):
                await node.set_writable()
            if (tag := self.control.tags.get(name)) is not None:
                await node.add_property(index, "EURange", ua.Range(tag.range.low, tag.range.high))
                unit = ua.EUInformation("http://qudt.org/vocab/unit/", -1, ua.LocalizedText(tag.unit))
                await node.add_property(index, "EngineeringUnits", unit)
        await self.show()
        if self._serving.history:
            nodes = [server.get_node(self._ids[tag]) for tag in self.control.tags]
            await server.historize_node_data_change(nodes, period=HISTORY, count=self._serving.history)

    async def _written(self, items: list[tuple[ua.NodeId, Any]]) -> list[str]:
        """What a client writes in one call goes to the control system; what came of it is shown before it is told."""
        statuses = self.control.write([(str(id_.Identifier), value) for id_, value in items])
        await self.show_commanded()
        if self.control.behaviour.silent_writes:
            await asyncio.Event().wait()
        return statuses

    async def _misbehave(self) -> None:
        """Stall, or cut every connection, where an engineer asked for it."""
        behaviour = self.control.behaviour
        if behaviour.stall_s > 0.0:
            stall_s, behaviour.stall_s = behaviour.stall_s, 0.0
            time.sleep(stall_s)  # the whole server stands, as a stopped process does
        if behaviour.drop_every_s > 0.0 and time.monotonic() - self._dropped_s >= behaviour.drop_every_s:
            self._dropped_s = time.monotonic()
            assert self._server.bserver is not None
            for client in list(self._server.bserver.clients):
                if client.transport is not None:
                    client.transport.abort()


def _id(name: str, index: int) -> ua.NodeId:
    return ua.NodeId.from_string(f"ns={index};s={name}")


def _utc(at: datetime) -> Any:
    """``at`` as the library annotates it: its own name for a time of UTC."""
    return at


def _variant(name: str, value: NodeValue) -> ua.Variant:
    """``value`` as the node called ``name`` holds it: counts and tokens without a sign, modes with one."""
    if isinstance(value, bool):
        return ua.Variant(value, ua.VariantType.Boolean)
    if isinstance(value, int):
        return ua.Variant(value, ua.VariantType.Int32 if name.endswith(f"/{MODE}") else ua.VariantType.UInt32)
    return ua.Variant(value, ua.VariantType.String if isinstance(value, str) else ua.VariantType.Double)
