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
    path = tmp_path_factory.mktemp("tls") / "console.pem"
    path.touch(0o600)
    key = ec.generate_private_key(ec.SECP256R1())
    path.write_bytes(made(key) + kept(key))
    return path


def made(key: ec.EllipticCurvePrivateKey, named: bool = True) -> bytes:
    """A certificate of ``key``, with names or without any."""
    name, now = x509.Name([]), datetime.datetime.now(datetime.UTC)
    names = x509.SubjectAlternativeName(
        [x509.DNSName("console.example"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]
    )
    builder = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key()).serial_number(1)
        .not_valid_before(now - datetime.timedelta(days=1)).not_valid_after(now + datetime.timedelta(days=1))
    )  # fmt: skip
    builder = builder.add_extension(names, critical=True) if named else builder
    return builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


def kept(key: ec.EllipticCurvePrivateKey, passphrase: bytes | None = None) -> bytes:
    """``key``, encrypted where there is a ``passphrase``."""
    how = serialization.BestAvailableEncryption(passphrase) if passphrase else serialization.NoEncryption()
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, how)


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


def test_a_key_that_does_not_fit_is_told_with_its_file_and_what_to_do(recovered_run: Path, tmp_path: Path) -> None:
    key, another = ec.generate_private_key(ec.SECP256R1()), ec.generate_private_key(ec.SECP256R1())
    files = {
        "cert.pem": made(key), "nameless.pem": made(key, named=False), "key.pem": kept(key),
        "another.pem": kept(another), "secret.pem": kept(key, b"a passphrase"), "broken.pem": kept(key)[:90],
    }  # fmt: skip
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        (tmp_path / name).chmod(0o644 if name in ("cert.pem", "nameless.pem") else 0o600)

    def told(certificate: str, key_file: str | None, *words: str) -> None:
        options = ("--tls-certificate", certificate, *(("--tls-key", key_file) if key_file else ()))
        done = homeostat("console", str(recovered_run), "--no-browser", "--port", "0", *options, cwd=tmp_path)
        refused(done, *words)
        assert "_ssl" not in done.err and "ExtensionOID" not in done.err and "ObjectIdentifier" not in done.err

    told("cert.pem", "another.pem", "'another.pem'", "'cert.pem'", "is not that of the certificate", "--tls-key")
    told("cert.pem", None, "'cert.pem' has no private key", "--tls-key")
    told("cert.pem", "secret.pem", "'secret.pem' is encrypted", "openssl pkey")
    told("nameless.pem", "key.pem", "'nameless.pem' has no names", "subjectAltName")
    told("cert.pem", "broken.pem", "'broken.pem'", "'cert.pem'")
