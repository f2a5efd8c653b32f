"""Somebody else's process module (MTPPy, over python-opcua): its setpoint works once it was requested and applied."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from homeostat.domain.recovery import Command
from homeostat.links.errors import LinkError
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import LinkMapping, mapping_of
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import SERVED, Security
from tests.equipment.opcua.process import ServerProcess
from tests.equipment.opcua.tank import RULES
from tests.links.opcua.waiting import sample, settled

ROOT = Path(__file__).resolve().parents[3]
MODULE = ROOT / "tests" / "equipment" / "opcua" / "mtp_module.py"
ENVIRONMENT = ROOT / ".mtp-venv"
ELEMENTS = "ns=3;s=active_elements"
TAKEN_S = 2.0
"""MTPPy looks at what was written twice per second."""

pytestmark = pytest.mark.skipif(
    not (ENVIRONMENT / ".ready").exists(), reason="MTPPy is not installed: bash tools/counterparts.sh"
)


@pytest.fixture(scope="module")
def module(pkis: tuple[Pki, Pki]) -> Iterator[ServerProcess]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = ServerProcess()
    given = [str(port), str(pkis[0].certificate), str(pkis[0].key), SERVED]
    server.start([str(ENVIRONMENT / "bin" / "python"), str(MODULE), *given])
    yield server
    server.kill()


def mapping(url: str, **write: str) -> LinkMapping:
    node = f"{ELEMENTS}.L_SP"
    asked = {"node": f"{node}.VExt", "kind": "Float", "ramp": "plant", "feedback": f"{node}.VOut", **write}
    content = {
        "connection": {"url": url, "publish_s": 0.1},
        "tags": {"L": {"node": f"{ELEMENTS}.L.V"}, "L.sp": {"node": f"{node}.VOut", "write": asked}},
    }
    return mapping_of(content, "module")


def two_steps(url: str) -> LinkMapping:
    node = f"{ELEMENTS}.L_SP"
    return mapping(url, requested=f"{node}.VReq", apply=f"{node}.ApplyExt")


@pytest.mark.slow
def test_a_setpoint_works_once_it_was_requested_shown_and_applied(module: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    with OpcuaLink(two_steps(module.url), RULES, Security(pkis[1])) as link:
        link.wait(60.0)
        wire = link.take()
        assert settled(wire.send((Command("L.sp", 11.0, 2.0),))) == ""
        assert sample(link, lambda s: s.accepted["L.sp"] == pytest.approx(11.0)).values["L"] < 14.0
        assert sample(link, lambda s: abs(s.values["L"] - 11.0) < 0.1), "the module works with it"
        with pytest.raises(LinkError, match="range is 2 to 12 L"):
            wire.send((Command("L.sp", 12.5, 2.0),))


def test_what_the_module_does_not_show_as_requested_is_not_applied(
    module: ServerProcess, pkis: tuple[Pki, Pki]
) -> None:
    with OpcuaLink(two_steps(module.url), RULES, Security(pkis[1])) as link:
        link.wait(60.0)
        wire = link.take()
        assert settled(wire.send((Command("L.sp", 10.0, 2.0),))) == ""
        assert "its node holds 10.0" in settled(wire.send((Command("L.sp", 11.8, 2.0),)))
        assert sample(link).accepted["L.sp"] == pytest.approx(10.0)


@pytest.mark.slow
def test_a_request_alone_moves_nothing(module: ServerProcess, pkis: tuple[Pki, Pki]) -> None:
    with OpcuaLink(mapping(module.url), RULES, Security(pkis[1])) as link:
        link.wait(60.0)
        before = sample(link)
        assert settled(link.take().send((Command("L.sp", 5.0, 2.0),))) == ""
        after = sample(link, lambda s: s.at_s > before.at_s + TAKEN_S)
        assert after.accepted["L.sp"] == before.accepted["L.sp"] != 5.0
