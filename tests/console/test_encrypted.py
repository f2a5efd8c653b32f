"""The page on another address: a certificate and accounts, or nothing; cookies that never travel in the clear."""

from __future__ import annotations

import contextlib
import datetime
import ipaddress
import json
import ssl
from http.client import HTTPSConnection
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from tests.cli.command import homeostat, refused
from tests.console.served import PASSWORD, accounts, served


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate for 127.0.0.1 and console.example with its key, in one file."""
    key = ec.generate_private_key(ec.SECP256R1())
    name, now = x509.Name([]), datetime.datetime.now(datetime.UTC)
    names = x509.SubjectAlternativeName(
        [x509.DNSName("console.example"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]
    )
    made = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key()).serial_number(1)
        .not_valid_before(now - datetime.timedelta(days=1)).not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(names, critical=True).sign(key, hashes.SHA256())
    )  # fmt: skip
    pem = serialization.Encoding.PEM
    path = tmp_path_factory.mktemp("tls") / "console.pem"
    plain = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    path.touch(0o600)
    path.write_bytes(made.public_bytes(pem) + plain)
    return path


def test_with_a_certificate_everything_is_encrypted(recovered_run: Path, certificate: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="viewer")
    options = ("--people", str(people), "--tls-certificate", str(certificate), "--address", "127.0.0.1")
    with served(recovered_run, *options, scheme="https") as server:
        trust = ssl.create_default_context(cafile=str(certificate))
        origin = f"https://127.0.0.1:{server.port}"

        def ask(method: str, path: str, content: str = "", **headers: str) -> tuple[int, dict[str, str]]:
            with contextlib.closing(HTTPSConnection("127.0.0.1", server.port, timeout=99, context=trust)) as connection:
                connection.request(method, path, content, headers=headers)
                answer = connection.getresponse()
                answer.read()
                return answer.status, dict(answer.getheaders())

        status, headers = ask("GET", "/")
        assert status == 200 and "max-age" in headers["strict-transport-security"]
        assert ask("GET", "/", Host="console.example")[0] == 200 and ask("GET", "/", Host="localhost")[0] == 400
        proof = json.dumps({"name": "Ada", "password": PASSWORD.format("Ada")})
        sent = {"Content-Type": "application/json"}
        assert ask("POST", "/api/session", proof, Origin=origin.replace("https", "http"), **sent)[0] == 403
        status, headers = ask("POST", "/api/session", proof, Origin=origin, **sent)
        cookie = headers["set-cookie"]
        assert status == 200 and cookie.startswith(f"__Host-homeostat-{server.port}=") and "Secure" in cookie
        assert ask("GET", "/api/run", Cookie=cookie.partition(";")[0])[0] == 200


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--address", "0.0.0.0"), "needs --tls-certificate"),
        (("--address", "0.0.0.0", "--people", "people.json"), "needs --tls-certificate"),
        (("--address", "0.0.0.0", "--tls-certificate", "console.pem"), "needs --people"),
        (("--tls-key", "console.pem"), "needs --tls-certificate"),
        (("--tls-certificate", "open.pem"), "chmod 600"),
        (("--tls-certificate", "none.pem"), "none.pem"),
        (("--tls-certificate", "people.json"), "no certificate"),
        (("--people", "none.json"), "none.json"),
    ],
)
def test_what_would_let_strangers_in_is_refused_in_one_line(
    recovered_run: Path, certificate: Path, tmp_path: Path, options: tuple[str, ...], words: str
) -> None:
    accounts(tmp_path / "people.json", Ada="viewer")
    for name, mode in (("console.pem", 0o600), ("open.pem", 0o644)):
        (tmp_path / name).write_bytes(certificate.read_bytes())
        (tmp_path / name).chmod(mode)
    refused(homeostat("console", str(recovered_run), "--no-browser", *options, cwd=tmp_path), words)
