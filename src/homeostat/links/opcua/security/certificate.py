"""Keys and certificates of OPC UA applications: where they are, how one is made, and who may read a secret."""

from __future__ import annotations

import os
import socket
import stat
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Final

from homeostat.links.errors import LinkError

if TYPE_CHECKING:
    from cryptography import x509

DAYS: Final = 730
"""How long a certificate is valid where nothing else is said [d]."""
_KEY_BITS: Final = 2048


@dataclass(frozen=True, slots=True)
class Pki:
    """The folder with an application's key, its certificate and those that it trusts."""

    folder: Path
    """The folder."""

    @property
    def key(self) -> Path:
        """The private key, PEM."""
        return self.folder / "own" / "key.pem"

    @property
    def certificate(self) -> Path:
        """The certificate, DER."""
        return self.folder / "own" / "certificate.der"

    @property
    def trusted(self) -> Path:
        """Folder with the certificates that are trusted, DER or PEM."""
        return self.folder / "trusted"

    def check(self) -> None:
        """LinkError where key or certificate is missing, others can read the key, or nobody is trusted."""
        for path in (self.key, self.certificate):
            if not path.is_file():
                raise LinkError(f"{str(path)!r} is missing; 'homeostat link certificate {self.folder}' makes it")
        refuse_readable(self.key)
        if not any(path.suffix in (".der", ".pem") for path in self._all_trusted()):
            raise LinkError(
                f"{str(self.trusted)!r} holds no certificate, so nobody is trusted; copy the other side's there"
            )

    def _all_trusted(self) -> list[Path]:
        return list(self.trusted.iterdir()) if self.trusted.is_dir() else []


def refuse_readable(path: Path) -> None:
    """LinkError where others than its owner may read or write ``path``, or it is not there."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise LinkError(f"{str(path)!r} cannot be read: {error.strerror}") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise LinkError(f"{str(path)!r} can be read by others (mode {stat.S_IMODE(mode):03o}); chmod 600 it")


def make_certificate(folder: Path, uri: str, name: str, hosts: tuple[str, ...] = (), days: float = DAYS) -> Pki:
    """Make a key and a certificate that signs itself, for the application ``uri``, in the new files of ``folder``.

    ``hosts``: names and addresses under which it is reached; ``days``: how long it is valid [d].
    LinkError where there is a key already.
    """
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import rsa
    from cryptography.x509.oid import ExtendedKeyUsageOID

    pki = Pki(folder)
    if pki.key.exists() or pki.certificate.exists():
        raise LinkError(f"{str(pki.key.parent)!r} holds a key already; it is never overwritten, choose another folder")
    key, now = rsa.generate_private_key(public_exponent=65537, key_size=_KEY_BITS), datetime.now(UTC)
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    names: list[x509.GeneralName] = [x509.UniformResourceIdentifier(uri), *map(_host, hosts or (socket.gethostname(),))]
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(minutes=5))
        .not_valid_after(now + timedelta(days=days))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=False)
        .add_extension(_usage(), critical=False)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    pki.key.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    pki.trusted.mkdir(exist_ok=True)
    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    with os.fdopen(os.open(pki.key, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(secret)
    pki.certificate.write_bytes(certificate.public_bytes(serialization.Encoding.DER))
    return pki


def _usage() -> x509.KeyUsage:
    """What the standard wants of an application's certificate (OPC 10000-6, 6.2.2)."""
    from cryptography import x509

    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=True,
        key_encipherment=True,
        data_encipherment=True,
        key_agreement=False,
        key_cert_sign=True,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )


def _host(name: str) -> x509.GeneralName:
    """``name`` as an address where it is one."""
    from cryptography import x509

    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        return x509.DNSName(name)
