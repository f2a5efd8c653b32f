"""A provider behind TLS whose certificate only the site's own authority vouches for: by it, and by nothing else."""

from __future__ import annotations

import contextlib
import signal
import ssl
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("authlib", reason="the extra 'console' is not installed")

from tests.cli.command import homeostat, refused
from tests.console.served import Served, accounts, served
from tests.equipment.authority import Authority
from tests.equipment.oidc.providing import Providing, Visitor, providing


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("site"), "site")


@pytest.fixture(scope="module")
def provider(authority: Authority) -> Iterator[Providing]:
    with providing(pem=authority.issued("localhost")) as found:
        yield found


@contextlib.contextmanager
def trusting(provider: Providing, run_dir: Path, folder: Path, ca: Path | None) -> Iterator[Served]:
    """A console that trusts the provider by ``ca``, which is put beside its settings; None for the system's."""
    people = accounts(folder / "people.json", Ada="engineer")
    if ca is not None:
        (folder / "site.pem").write_bytes(ca.read_bytes())
    settings = provider.settings(folder, ca="" if ca is None else '"site.pem"')
    options = ("--people", str(people), "--sign-on", str(settings))
    with served(run_dir, *options, port=provider.console) as server:
        yield server


def test_with_the_authority_of_the_site_people_come_in(
    recovered_run: Path, authority: Authority, provider: Providing, tmp_path: Path
) -> None:
    assert provider.issuer.startswith("https://")
    trust = ssl.create_default_context(cafile=str(authority.path))
    with (
        trusting(provider, recovered_run, tmp_path, authority.path) as desk,
        Visitor(timeout=60.0, verify=trust) as visitor,
    ):
        answer = visitor.back(f"{desk.address}oidc/sign-in", "eng.grace")
        assert (answer.status_code, answer.headers.get("location")) == (303, "/"), answer.text
        found = visitor.get(f"{desk.address}api/me").json()
        assert (found["name"], found["access"], found["by_sign_on"]) == ("grace", "engineer", True)


def told_of(provider: Providing, run_dir: Path, folder: Path, ca: Path | None) -> str:
    """What is said where a console was started that cannot trust the provider, once somebody wants to sign in."""
    with trusting(provider, run_dir, folder, ca) as desk:
        with Visitor(timeout=60.0) as visitor:
            answer = visitor.get(f"{desk.address}oidc/sign-in")
            assert answer.status_code == 502 and "cannot be used" in answer.text and "CERT" not in answer.text.upper()
            assert visitor.get(f"{desk.address}api/me").json()["name"] is None
        desk.process.send_signal(signal.SIGINT)
        assert desk.process.stderr is not None
        line, *others = desk.process.stderr.read().splitlines()
    assert others == ["homeostat: the console is closed"] and "nobody can be sent to Works login: " in line
    return line


def test_another_authority_vouches_for_nothing(recovered_run: Path, provider: Providing, tmp_path: Path) -> None:
    line = told_of(provider, recovered_run, tmp_path, Authority(tmp_path, "other").path)
    assert "its certificate is not trusted by" in line and "site.pem' (ca): " in line
    assert provider.issuer in line


def test_the_system_knows_nothing_of_the_site(recovered_run: Path, provider: Providing, tmp_path: Path) -> None:
    line = told_of(provider, recovered_run, tmp_path, None)
    assert "not trusted by the system's certificates; ca in the settings names others: " in line


@pytest.mark.parametrize(("host", "days", "words"), [("login.example", 1.0, "ostname"), ("localhost", -1.0, "expired")])
def test_a_certificate_of_another_host_or_one_that_is_over_is_not_believed(
    recovered_run: Path, authority: Authority, tmp_path: Path, host: str, days: float, words: str
) -> None:
    with providing(pem=authority.issued(host, days)) as provider:
        line = told_of(provider, recovered_run, tmp_path, authority.path)
    assert "its certificate is not trusted by" in line and words in line


def test_a_file_without_a_certificate_is_refused_when_the_console_starts(recovered_run: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    (tmp_path / "site.pem").write_text("no certificate\n")
    settings = Providing("https://login.example", 1).settings(tmp_path, ca='"site.pem"')
    options = ("--no-browser", "--people", str(people), "--sign-on", str(settings))
    refused(homeostat("console", str(recovered_run), *options, cwd=tmp_path), "site.pem' cannot be used")
