"""Before a link is used: a mapping is drafted from what a server has, and checked against plant and server."""

from __future__ import annotations

import asyncio
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from homeostat.links.errors import LinkError
from homeostat.links.opcua.commissioning import browse as commissioning_browse
from homeostat.links.opcua.commissioning.browse import ServerNode, connected, variables
from homeostat.links.opcua.commissioning.check import Checked, check
from homeostat.links.opcua.commissioning.draft import Draft, draft
from homeostat.links.opcua.mapping import mapping_of
from homeostat.links.opcua.security.security import Security
from tests.cli.command import homeostat, refused
from tests.equipment.opcua.served import Served
from tests.equipment.opcua.tank import RULES, tank_content


def drafted(served: Served, plant: bool = True) -> Draft:
    url = f"opc.tcp://127.0.0.1:{served.port}/homeostat/"

    async def browse() -> Draft:
        async with connected(url, Security(served.pki)) as client:
            nodes, whole = await variables(client)
            assert whole
            return draft(url, nodes, RULES if plant else None, await client.get_namespace_array())

    return asyncio.run(browse())


def checked(served: Served, content: dict[str, Any]) -> dict[str, Checked]:
    mapping = mapping_of(content, "tank")

    async def look() -> list[Checked]:
        async with connected(mapping.connection.url, Security(served.pki)) as client:
            return await check(client, mapping, RULES)

    return {line.subject: line for line in asyncio.run(look())}


@pytest.mark.slow
def test_a_draft_of_a_served_plant_is_its_mapping_and_the_check_finds_nothing(served: Served) -> None:
    made = drafted(served)
    content = tomllib.loads(made.text)
    wanted = tank_content(served.port)
    assert (made.tags, made.missing) == (4, ()) and content["guard"] == wanted["guard"]
    for tag, nodes in wanted["tags"].items():
        found = content["tags"][tag]
        assert found["node"] == nodes["node"] and found["unit"] == RULES.tags[tag].unit
        assert found.get("write", {}).items() >= nodes.get("write", {}).items()
    assert list(content["connection"]["namespaces"]) == ["2"], "the only one that is used"
    assert all(not line.problems for line in checked(served, content).values())


def test_a_draft_says_where_a_conversion_is_needed() -> None:
    node = ServerNode("ns=2;s=T", "T", "Double", "", False, unit="degC")
    text = draft("opc.tcp://127.0.0.1:1/", [node], RULES).text
    assert 'unit = "degC"\n# STATE scale AND offset: the tag is in K' in text
    assert "STATE scale" not in draft("opc.tcp://127.0.0.1:1/", [replace(node, unit="K")], RULES).text
    assert "STATE scale" not in draft("opc.tcp://127.0.0.1:1/", [node], None).text


@pytest.mark.slow
def test_namespaces_are_compared_by_what_they_are_and_not_by_their_numbers(served: Served) -> None:
    (uri,) = tomllib.loads(drafted(served).text)["connection"]["namespaces"].values()
    content = tank_content(served.port)
    (problem,) = checked(served, content)["connection.namespaces"].problems
    assert "is not stated" in problem and f'2 = "{uri}"' in problem
    for stated, told in (({"2": "urn:other"}, f"'{uri}' there"), ({"2": uri, "9": "urn:nine"}, "no such namespace")):
        content["connection"]["namespaces"] = stated
        (problem,) = checked(served, content)["connection.namespaces"].problems
        assert told in problem
        refused_for = pytest.raises(LinkError, match="addresses would be of other nodes")
        with served.open(namespaces=stated) as link, refused_for:
            link.wait(5.0)
    with pytest.raises(LinkError, match="addresses have ns=2, which is not stated there"):
        mapping_of(content | {"connection": content["connection"] | {"namespaces": {"3": "urn:three"}}}, "tank")
    with served.link(namespaces={"2": uri}) as link:
        assert not link.trouble


def test_a_draft_without_a_plant_has_every_number(served: Served) -> None:
    text = drafted(served, plant=False).text
    tags = tomllib.loads(text)["tags"]
    assert {"L", "T", "L.sp", "cool.man"} <= tags.keys() and not any("write" in nodes for nodes in tags.values())


@pytest.mark.parametrize(
    ("table", "entry", "value", "subject", "told"),
    [
        ("L", "node", "ns=2;s=nothing", "L", "BadNodeIdUnknown"),
        ("L", "node", "ns=2;s=Guard/Alarm", "L", "holds String, not a number"),
        ("L", "unit", "mm", "L", "is in L, and the mapping says mm"),
        ("T", "unit", "degC", "T", "'T' is in K and its node in degC, and nothing converts one into the other"),
        ("T", "offset", 273.15, "T", "its range at the server is 523.15 to 673.15 K"),
        ("L.sp/write", "kind", "Float", "L.sp", "holds Double, and the mapping says Float"),
        ("L.sp/write", "node", "ns=2;s=T", "L.sp", "cannot be written by us"),
        ("L.sp/write", "feedback", "ns=2;s=Guard/Alarm", "L.sp", "its feedback"),
    ],
)
def test_the_check_finds(served: Served, table: str, entry: str, value: object, subject: str, told: str) -> None:
    content = tank_content(served.port)
    tag, _, write = table.partition("/")
    (content["tags"][tag]["write"] if write else content["tags"][tag])[entry] = value
    lines = checked(served, content)
    assert any(told in problem for problem in lines[subject].problems), lines[subject]
    assert "\n" not in str(lines[subject])


def test_the_check_misses_what_is_needed(served: Served) -> None:
    content = tank_content(served.port)
    del content["tags"]["cool.man"], content["tags"]["L.sp"]["write"], content["guard"]["heartbeat"]
    lines = checked(served, content)
    assert "command it" in lines["cool.man"].problems[0] and "no way to write it" in lines["L.sp"].problems[0]
    assert "when we are dead" in lines["guard.heartbeat"].problems[0]


def test_bad_quality_is_a_problem(served: Served) -> None:
    served.ask("quality T BadSensorFailure")
    served.ask("status")
    for _ in range(50):
        if (line := checked(served, tank_content(served.port))["T"]).problems:
            break
    assert "BadSensorFailure (0x808C0000)" in line.problems[0]


def test_of_a_server_with_no_end_the_nearest_is_listed_and_it_is_known_that_there_is_more(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def browse() -> tuple[list[ServerNode], bool]:
        async with connected(f"opc.tcp://127.0.0.1:{served.port}/homeostat/", Security(served.pki)) as client:
            return await variables(client)

    every, whole = asyncio.run(browse())
    monkeypatch.setattr(commissioning_browse, "MOST", len(every) - 1)
    some, whole_too = asyncio.run(browse())
    assert whole and not whole_too and 0 < len(some) < len(every) and some == every[: len(some)]


def test_a_server_that_is_not_there_is_told_in_one_line() -> None:
    async def look() -> None:
        async with connected("opc.tcp://127.0.0.1:1/", Security(insecure=True)):
            raise AssertionError("somebody listens at port 1")

    async def strange(url: str) -> None:
        async with connected(url, Security(insecure=True)):
            raise AssertionError("it is no address")

    for url in ("http://127.0.0.1/", "opc.tcp://me:secret@127.0.0.1:1/"):
        with pytest.raises(LinkError, match="without a name or a password") as found:
            asyncio.run(strange(url))
        assert "secret" not in str(found.value)
    with pytest.raises(LinkError, match=r"opc\.tcp://127\.0\.0\.1:1/ cannot be connected to"):
        asyncio.run(look())


def test_the_commands_draft_check_and_make_certificates(served: Served, tmp_path: Path) -> None:
    url, pki = f"opc.tcp://127.0.0.1:{served.port}/homeostat/", str(served.pki.folder)
    done = homeostat("link", "draft", url, "--insecure", "--out", "tank.toml", cwd=tmp_path)
    assert done.status == 0 and "check every line" in done.out and "INSECURE" in done.err
    refused(homeostat("link", "draft", url, "--pki", pki, "--out", "tank.toml", cwd=tmp_path), "--force")
    done = homeostat("link", "check", "cstr", "tank.toml", "--pki", pki, cwd=tmp_path)
    assert done.status == 1 and "the plant 'cstr' has not" in done.out
    refused(homeostat("link", "check", "cstr", "tank.toml", cwd=tmp_path), "--insecure")
    made = homeostat("link", "certificate", "mine", cwd=tmp_path)
    assert made.status == 0 and (tmp_path / "mine/own/key.pem").is_file()
    refused(homeostat("link", "certificate", "mine", cwd=tmp_path), "never overwritten")
    refused(homeostat("link", "check", "cstr", "tank.toml", "--pki", "mine", cwd=tmp_path), "nobody is trusted")
    refused(homeostat("serve", "cstr", cwd=tmp_path), "--insecure")


def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("homeostat.links.opcua.extra.find_spec", lambda name: None)
    for command in (["serve", "cstr"], ["link", "draft", "opc.tcp://x:1/", "--out", "x.toml"]):
        refused(homeostat(*command, cwd=tmp_path), "pip install 'homeostat[opcua]'")
