"""Somebody else's OPC UA (node-opcua) as server and as client; skipped where npm has not installed it."""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from homeostat.domain.recovery import Command
from homeostat.links.errors import LinkError
from homeostat.links.opcua.commissioning.browse import connected
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import LinkMapping, mapping_of
from homeostat.links.opcua.security.certificate import Pki, make_certificate
from homeostat.links.opcua.security.security import APPLICATION, SERVED, Security
from tests.equipment.opcua.served import Served, wait_up
from tests.equipment.opcua.tank import RULES
from tests.links.opcua.waiting import sample, settled

SCRIPTS = Path(__file__).resolve().parents[2] / "equipment" / "opcua"
LOGIN = ("operator", "s3cret")


def _installed() -> bool:
    return shutil.which("node") is not None and (SCRIPTS / "node_modules" / "node-opcua").exists()


pytestmark = pytest.mark.skipif(not _installed(), reason="node-opcua is not installed: bash tools/counterparts.sh")


def pem_of(pki: Pki) -> Path:
    """The certificate of ``pki`` as node-opcua reads it."""
    path = pki.certificate.with_suffix(".pem")
    certificate = x509.load_der_x509_certificate(pki.certificate.read_bytes())
    path.write_bytes(certificate.public_bytes(Encoding.PEM))
    return path


@dataclass(frozen=True)
class ThirdParty:
    """A server that is not ours."""

    url: str
    prefix: str
    pki: Pki

    @property
    def mapping(self) -> LinkMapping:
        content = {
            "connection": {"url": self.url, "publish_s": 0.05, "dead_s": 2.0},
            "guard": {"counter": f"{self.prefix}Counter"},
            "tags": {tag: {"node": f"{self.prefix}{tag}"} for tag in ("L", "T", "L.sp")},
        }
        content["tags"]["L.sp"]["write"] = {"node": f"{self.prefix}L.sp", "ramp": "plant"}  # type: ignore[index]
        return mapping_of(content, "third party")

    def order(self, status: str) -> None:
        """Let the reading T have ``status``."""

        async def write() -> None:
            from asyncua import ua

            async with connected(self.url, Security(self.pki, login=LOGIN)) as client:
                node = client.get_node(f"{self.prefix}Order")
                await node.write_value(ua.DataValue(ua.Variant(status, ua.VariantType.String)))

        asyncio.run(write())


@pytest.fixture(scope="module")
def third_party(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ThirdParty]:
    folder = tmp_path_factory.mktemp("third")
    server = make_certificate(folder / "served", SERVED, "third party", ("127.0.0.1",))
    link = make_certificate(folder / "link", APPLICATION, "link")
    shutil.copy(server.certificate, link.trusted / "served.der")
    files = [SCRIPTS / "third_party_server.js", pem_of(server), server.key, folder / "theirs"]
    said = folder / "said"
    with said.open("w") as out, subprocess.Popen(["node", *map(str, files), SERVED], stdout=out, stderr=out) as process:
        for _ in range(600):
            if ready := re.search(r"^READY (\d+) (\S+)$", said.read_text(), re.MULTILINE):
                break
            assert process.poll() is None, said.read_text()
            time.sleep(0.1)
        assert ready is not None, said.read_text()
        yield ThirdParty(f"opc.tcp://127.0.0.1:{ready[1]}/", ready[2], link)
        process.kill()


@pytest.mark.slow
def test_its_readings_come_encrypted_after_a_login_with_their_quality(third_party: ThirdParty) -> None:
    with OpcuaLink(third_party.mapping, RULES, Security(third_party.pki, login=LOGIN)) as link:
        wait_up(link)
        assert sample(link).values["T"] == pytest.approx(300.0, abs=0.1)
        for status, group in (("BadSensorFailure", "bad"), ("UncertainLastUsableValue", "uncertain")):
            third_party.order(status)
            seen = sample(link, lambda s, status=status: status in s.reasons.get("T", ""))  # type: ignore[misc]
            assert "T" in getattr(seen, group) and "L" not in seen.reasons
        third_party.order("Good")
        assert sample(link, lambda s: not s.reasons)


def test_it_is_written_within_our_range_and_read_back(third_party: ThirdParty) -> None:
    with OpcuaLink(third_party.mapping, RULES, Security(third_party.pki, login=LOGIN)) as link:
        wait_up(link)
        wire = link.take()
        assert settled(wire.send((Command("L.sp", 11.0, 2.0),))) == ""
        assert sample(link, lambda s: s.accepted["L.sp"] == 11.0)
        with pytest.raises(LinkError, match="range is 2 to 12 L"):
            wire.send((Command("L.sp", 500.0, 2.0),))


@pytest.mark.slow
def test_a_wrong_password_is_told(third_party: ThirdParty) -> None:
    wrong = Security(third_party.pki, login=("operator", "wrong"))
    with OpcuaLink(third_party.mapping, RULES, wrong) as link, pytest.raises(LinkError, match=r"Denied|Rejected"):
        link.wait(5.0)


def test_a_node_that_is_read_only_is_refused(third_party: ThirdParty) -> None:
    content = third_party.mapping.model_dump()
    content["tags"]["L.sp"]["write"]["node"] = f"{third_party.prefix}L"
    with OpcuaLink(mapping_of(content, "third party"), RULES, Security(third_party.pki, login=LOGIN)) as link:
        wait_up(link)
        assert "Bad" in settled(link.take().send((Command("L.sp", 11.0, 2.0),)))


def test_its_client_reads_and_writes_a_served_plant(served: Served, pkis: tuple[Pki, Pki], tmp_path: Path) -> None:
    url = f"opc.tcp://127.0.0.1:{served.port}/homeostat/"
    before = len(served.wire)
    given = [url, str(pem_of(pkis[1])), str(pkis[1].key), str(tmp_path / "theirs"), APPLICATION]
    command = ["node", str(SCRIPTS / "third_party_client.js"), *given]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    found = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
    assert 200.0 < found["reading"] < 400.0
    assert found["without"] == ["BadUserAccessDenied"] and found["lease"] == ["Good"]
    assert found["target"] == ["Good"] * 3 and found["outside"][1] == "BadOutOfRange"
    assert found["type"][1] == "BadTypeMismatch" and "Bad" in found["reader"][1]
    written = [[(tag, value) for tag, value, _ in order] for order in served.wire[before:]]
    assert written == [[("L.sp", 11.0)]], "at the rate that somebody wrote last, if anybody did"
