"""Nodes of other types than ours: what is written is cast to them where it is the same value, and refused where not."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from homeostat.domain.recovery import Command
from homeostat.links.opcua.commissioning.browse import connected
from homeostat.links.opcua.commissioning.check import Checked, check
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import mapping_of
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import Security
from tests.equipment.opcua.process import ServerProcess
from tests.equipment.opcua.tank import RULES
from tests.links.opcua.waiting import settled

NODES = {
    "Counter": ("Int16", 0), "Lease": ("Int32", 0), "Beat": ("Byte", 0), "Hold": ("Byte", 0),
    "Alarm": ("LocalizedText", ""), "L": ("Float", 10.0), "T": ("Double", 300.0),
    "L.target": ("Float", 10.0), "L.rate": ("Float", 0.0), "L.mode": ("UInt16", 1),
    "cool.target": ("Int16", 0), "cool.mode": ("Byte", 1), "cool.rate": ("Int32", 0), "Flag": ("Boolean", False),
}  # fmt: skip


@pytest.fixture(scope="module")
def foreign(pkis: tuple[Pki, Pki]) -> Iterator[ServerProcess]:
    server = ServerProcess()
    given = json.dumps({"pki": str(pkis[0].folder), "nodes": NODES})
    server.start([sys.executable, "-m", "tests.equipment.opcua.foreign_server", given])
    yield server
    server.kill()


def content(url: str) -> dict[str, Any]:
    def node(name: str) -> str:
        return f"ns=2;s={name}"

    level = {"node": node("L.target"), "rate": node("L.rate"), "mode": node("L.mode"), "ramp": "plant"}
    cooling = {"node": node("cool.target"), "mode": node("cool.mode"), "ramp": "plant"}
    guard = {"counter": "Counter", "lease": "Lease", "heartbeat": "Beat", "hold": "Hold", "alarm": "Alarm"}
    return {
        "connection": {"url": url, "publish_s": 0.1, "namespaces": {"2": "urn:foreign"}},
        "guard": {key: node(name) for key, name in guard.items()},
        "tags": {
            "L": {"node": node("L")},
            "T": {"node": node("T")},
            "L.sp": {"node": node("L"), "write": level},
            "cool.man": {"node": node("cool.target"), "scale": 0.01, "write": cooling},
        },
    }


def held(foreign: ServerProcess, pki: Pki, *names: str) -> list[Any]:
    async def read() -> list[Any]:
        async with connected(foreign.url, Security(pki)) as client:
            return [await client.get_node(f"ns=2;s={name}").read_value() for name in names]

    return asyncio.run(read())


def test_every_write_has_the_type_of_its_node(foreign: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    mapping = mapping_of(content(foreign.url), "foreign")
    with OpcuaLink(mapping, RULES, Security(pkis[1])) as link:
        link.wait(30.0)
        wire = link.take()
        for _ in range(300):
            link.beat()
        assert settled(wire.send((Command("L.sp", 11.3, 0.5), Command("cool.man", 0.4, None)))) == ""
        link.raise_alarm("a person is needed")
        link.hold(True)
        names = ("L.target", "L.rate", "L.mode", "cool.target", "cool.mode", "Hold", "Beat")
        found = held(foreign, pkis[1], *names)
        assert found == [pytest.approx(11.3), 0.5, 2, 40, 2, 1, 300 % 256]
        assert held(foreign, pkis[1], "Alarm")[0].Text == "a person is needed"
        assert "holds whole numbers" in settled(
            wire.send((Command("L.sp", 9.0, 2.0), Command("cool.man", 0.405, None)))
        )
        assert held(foreign, pkis[1], "L.target") == [pytest.approx(11.3)], "where one cannot be held, none is written"
        link.give_back()


def checked(foreign: ServerProcess, pki: Pki, mapped: dict[str, Any]) -> dict[str, Checked]:
    mapping = mapping_of(mapped, "foreign")

    async def look() -> list[Checked]:
        async with connected(foreign.url, Security(pki)) as client:
            return await check(client, mapping, RULES)

    return {line.subject: line for line in asyncio.run(look())}


def test_the_check_takes_every_type_that_can_be_cast_to(foreign: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    mapped = content(foreign.url)
    mapped["tags"]["L.sp"]["write"]["kind"] = "Float"
    mapped["tags"]["cool.man"]["write"]["kind"] = "Int16"
    lines = checked(foreign, pkis[1], mapped)
    assert [str(line) for line in lines.values() if line.problems] == []


@pytest.mark.parametrize(
    ("entry", "node", "subject", "told"),
    [
        ("rate", "cool.rate", "L.sp", "its rate ns=2;s=cool.rate holds Int32, not Double or Float"),
        ("mode", "T", "L.sp", "its mode ns=2;s=T holds Double"),
        ("guard.hold", "Alarm", "guard.hold", "holds LocalizedText"),
        ("guard.alarm", "Flag", "guard.alarm", "holds Boolean, not LocalizedText or String"),
        ("guard.lease", "Flag", "guard.lease", "holds Boolean"),
        ("guard.heartbeat", "Alarm", "guard.heartbeat", "holds LocalizedText"),
        ("guard.permit", "Beat", "guard.permit", "holds Byte, not Boolean"),
        ("guard.counter", "Alarm", "guard.counter", "holds LocalizedText"),
    ],
)
def test_the_check_looks_at_every_node(
    foreign: ServerProcess, pkis: tuple[Pki, Pki], entry: str, node: str, subject: str, told: str
) -> None:
    mapped = content(foreign.url)
    mapped["tags"]["L.sp"]["write"]["kind"] = "Float"
    of_guard, _, name = entry.rpartition(".")
    (mapped["guard"] if of_guard else mapped["tags"]["L.sp"]["write"])[name] = f"ns=2;s={node}"
    line = checked(foreign, pkis[1], mapped)[subject]
    assert any(told in problem for problem in line.problems), line


def test_modes_that_a_node_cannot_hold_are_found(foreign: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    mapped = content(foreign.url)
    mapped["tags"]["cool.man"]["write"]["automatic"] = -1
    line = checked(foreign, pkis[1], mapped)["cool.man"]
    assert any("has no -1 or no 2" in problem for problem in line.problems), line


def test_a_link_says_what_no_node_of_a_mode_can_hold(foreign: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    mapped = content(foreign.url)
    mapped["tags"]["L.sp"]["write"]["remote"] = 70_000
    with OpcuaLink(mapping_of(mapped, "foreign"), RULES, Security(pkis[1])) as link:
        link.wait(30.0)
        wire = link.take()
        before = held(foreign, pkis[1], "L.target")
        assert "from 0 to 65535" in settled(wire.send((Command("L.sp", 5.0, 2.0),)))
        assert held(foreign, pkis[1], "L.target") == before
        link.give_back()
