"""Who is believed: certificates, logins and files, on both sides."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import pytest

from homeostat.links.errors import LinkError
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.security.certificate import Pki, make_certificate
from homeostat.links.opcua.security.credentials import PASSWORD, USER, login_from
from homeostat.links.opcua.security.security import APPLICATION, SERVED, Security
from tests.equipment.opcua.served import Served, wait_up
from tests.equipment.opcua.tank import RULES, tank_mapping


def refused(served: Served, security: Security) -> str:
    """Why there is no connection after some attempts."""
    with OpcuaLink(tank_mapping(served.port), RULES, security) as link:
        end = time.monotonic() + 30.0
        while time.monotonic() < end and ("first" in link.trouble):
            time.sleep(0.05)
        assert link.trouble
        return link.trouble


def test_a_link_whose_certificate_the_server_does_not_know_is_refused(shared: Served, tmp_path: Path) -> None:
    stranger = make_certificate(tmp_path / "stranger", APPLICATION, "stranger")
    shutil.copy(next(shared.pki.trusted.iterdir()), stranger.trusted)
    assert "BadCertificateUntrusted" in refused(shared, Security(stranger))


def test_a_server_whose_certificate_we_do_not_know_is_refused(shared: Served, tmp_path: Path) -> None:
    other = make_certificate(tmp_path / "other", SERVED, "other", ("127.0.0.1",))
    ours = Pki(tmp_path / "ours")
    shutil.copytree(shared.pki.folder, ours.folder)
    for path in ours.trusted.iterdir():
        path.unlink()
    shutil.copy(other.certificate, ours.trusted / "other.der")
    assert "BadCertificateUntrusted" in refused(shared, Security(ours))


def test_a_login_is_asked_for_where_the_server_has_one(pkis: tuple[Pki, Pki]) -> None:
    with Served(pkis, login=["operator", "s3cret"]) as served:
        assert "Denied" in refused(served, Security(served.pki, login=("operator", "wrong")))
        with OpcuaLink(
            tank_mapping(served.port), RULES, Security(served.pki, login=("operator", "s3cret")), pace=5.0
        ) as link:
            wait_up(link)
            link.take()


def test_without_a_certificate_reading_must_be_wished_for() -> None:
    with pytest.raises(LinkError, match="--insecure to read without encryption"):
        OpcuaLink(tank_mapping(4840), RULES, Security())


def test_a_password_never_goes_without_encryption() -> None:
    with pytest.raises(LinkError, match="readable on the way"):
        OpcuaLink(tank_mapping(4840), RULES, Security(insecure=True, login=("a", "b")))


@pytest.mark.parametrize("spoil", ["key", "certificate", "trusted", "mode"])
def test_a_folder_of_keys_must_be_whole_and_private(tmp_path: Path, spoil: str) -> None:
    pki = make_certificate(tmp_path / "pki", APPLICATION, "link")
    shutil.copy(pki.certificate, pki.trusted / "other.der")
    pki.check()
    told = {"key": "is missing", "certificate": "is missing", "trusted": "nobody is trusted", "mode": "chmod 600"}
    match spoil:
        case "mode":
            pki.key.chmod(0o640)
        case "trusted":
            (pki.trusted / "other.der").unlink()
        case _:
            getattr(pki, spoil).unlink()
    with pytest.raises(LinkError, match=told[spoil]):
        pki.check()


def test_a_key_is_private_from_the_start_and_never_overwritten(tmp_path: Path) -> None:
    pki = make_certificate(tmp_path / "pki", APPLICATION, "link")
    assert pki.key.stat().st_mode & 0o077 == 0
    before = pki.key.read_bytes()
    with pytest.raises(LinkError, match="never overwritten"):
        make_certificate(tmp_path / "pki", APPLICATION, "link")
    assert pki.key.read_bytes() == before


def test_a_login_comes_from_the_environment_or_a_private_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(USER, raising=False)
    monkeypatch.delenv(PASSWORD, raising=False)
    assert login_from(None) is None
    monkeypatch.setenv(USER, "operator")
    with pytest.raises(LinkError, match="belong together"):
        login_from(None)
    monkeypatch.setenv(PASSWORD, "a:b c")
    assert login_from(None) == ("operator", "a:b c")
    file = tmp_path / "login"
    file.write_text("someone:with:colons\n")
    os.chmod(file, 0o644)
    with pytest.raises(LinkError, match="can be read by others"):
        login_from(file)
    file.chmod(0o600)
    assert login_from(file) == ("someone", "with:colons")
    file.write_bytes("someone:paßword".encode("latin-1"))
    with pytest.raises(LinkError, match="no text in UTF-8"):
        login_from(file)
    file.write_text("nobody\n")
    with pytest.raises(LinkError, match="name:password"):
        login_from(file)


def test_nothing_shows_a_password() -> None:
    assert "s3cret" not in repr(Security(login=("operator", "s3cret")))


def test_a_certificate_that_has_expired_is_refused(pkis: tuple[Pki, Pki], tmp_path: Path) -> None:
    old = make_certificate(tmp_path / "old", SERVED, "old", ("127.0.0.1",), days=-1.0 / 1440.0)
    shutil.copy(pkis[1].certificate, old.trusted / "link.der")
    ours = Pki(tmp_path / "ours")
    shutil.copytree(pkis[1].folder, ours.folder)
    shutil.copy(old.certificate, ours.trusted / "old.der")
    with Served((old, ours)) as served:
        assert "BadCertificateTimeInvalid" in refused(served, Security(ours))
