"""Whom a console is served to, as the options say: people, address, certificate."""

from __future__ import annotations

import argparse
import ssl
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from homeostat.cli.arguments import UsageError
from homeostat.cli.giving import ANSWER_S, given
from homeostat.console.people.accounts import Accounts, AccountsError
from homeostat.console.people.codes import CodesError
from homeostat.console.people.orders import Came, Give, NotGiven
from homeostat.console.people.people import People
from homeostat.console.server.app import HOSTS, Serving
from homeostat.console.server.serve import LOOPBACK, Tls
from homeostat.domain.mode import PersonCommand
from homeostat.service.order import OrderError

if TYPE_CHECKING:  # it loads a library that is needed only where there is one
    from homeostat.console.sign_on.sign_on import SignOn


def known(people: Path | None) -> People | None:
    """Everybody in the file ``people``; None without one, UsageError where it cannot be used."""
    if people is None:
        return None
    try:
        return People(Accounts(people))
    except (AccountsError, CodesError) as error:
        raise UsageError(str(error)) from error


def serving(people: People | None, run_dir: Path, ordered: bool, hosts: tuple[str, ...] = HOSTS) -> Serving:
    """``people`` may look at the run in ``run_dir``, and order where it can be ``ordered``; without any, all look."""
    return Serving(people, giver(run_dir) if ordered and people else None, hosts, hosts != HOSTS)


def signed_on(options: argparse.Namespace, hosts: tuple[str, ...]) -> SignOn | None:
    """The provider that knows people, too; None where none is named.

    UsageError where it is not set up as it must be, or its library is not installed.
    """
    if options.sign_on is None:
        return None
    if options.people is None:
        raise UsageError("--sign-on needs --people: somebody must come in where the provider does not answer")
    from homeostat.console.sign_on.settings import SignOnError
    from homeostat.console.sign_on.sign_on import SignOn

    try:
        found = SignOn(options.sign_on, Accounts(options.people))
    except (SignOnError, AccountsError) as error:
        raise UsageError(str(error)) from error
    address = urlsplit(found.settings.address)
    host = f"[{address.hostname}]" if ":" in (address.hostname or "") else address.hostname
    scheme = "https" if options.tls_certificate is not None else "http"
    if host not in hosts or address.scheme != scheme:
        raise UsageError(
            f"{str(options.sign_on)!r}: the page's address is {found.settings.address!r}, but it is served by {scheme}"
            f" as {', '.join(hosts)}"
        )
    return found


def encrypted(options: argparse.Namespace) -> tuple[Tls | None, tuple[str, ...]]:
    """The certificate, and the names under which the page may be asked for.

    UsageError where options do not go together.
    """
    certificate, key = options.tls_certificate, options.tls_key or options.tls_certificate
    if certificate is None:
        if options.address != LOOPBACK:
            raise UsageError(
                f"--address {options.address} needs --tls-certificate: passwords would travel in the clear"
            )
        if options.tls_key is not None:
            raise UsageError("--tls-key needs --tls-certificate")
        return None, HOSTS
    if options.address != LOOPBACK and options.people is None:
        raise UsageError(f"--address {options.address} needs --people: everybody who reaches it would be let in")
    names = _names(certificate)
    _check_key(certificate, key)
    return Tls(certificate, key), names


def _check_key(certificate: Path, key: Path) -> None:
    """UsageError where ``key`` is not the private key of ``certificate``, for its owner alone and without a secret."""
    if b"PRIVATE KEY-----" not in key.read_bytes():
        raise UsageError(f"{str(key)!r} has no private key (PEM); name the file that has it with --tls-key")
    if key.stat().st_mode & 0o077:
        raise UsageError(f"{str(key)!r} has a private key and must be for its owner alone: chmod 600")

    def nobody() -> str:
        raise UsageError(
            f"the private key in {str(key)!r} is encrypted, and nobody is asked for its passphrase; "
            "'openssl pkey -in FILE -out NEW' writes it without one"
        )

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, nobody)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            what = f"is not that of the certificate in {str(certificate)!r}; name the one that is with --tls-key"
        else:
            what = f"cannot be read, or is of no kind that goes with the certificate in {str(certificate)!r}"
        raise UsageError(f"the private key in {str(key)!r} {what}") from error


def _names(certificate: Path) -> tuple[str, ...]:
    """The names that a certificate is for; UsageError where it has none, or cannot be read."""
    from cryptography import x509

    try:
        found = x509.load_pem_x509_certificate(certificate.read_bytes())
        named = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except ValueError as error:
        raise UsageError(f"{str(certificate)!r} is no certificate (PEM): {error}") from error
    except x509.ExtensionNotFound as error:
        raise UsageError(
            f"the certificate in {str(certificate)!r} has no names in it that the page could be asked for by; "
            "make one with a subjectAltName"
        ) from error
    addresses = [str(address) for address in named.get_values_for_type(x509.IPAddress)]
    return (*named.get_values_for_type(x509.DNSName), *(f"[{a}]" if ":" in a else a for a in addresses))


def giver(run_dir: Path, within_s: float = ANSWER_S) -> Give:
    """Takes orders to the run in ``run_dir``, which has ``within_s`` for its answer [s]."""

    def give(command: PersonCommand) -> Came:
        try:
            heard = given(run_dir, command, within_s)
        except (OrderError, UsageError, OSError) as error:
            raise NotGiven(str(error)) from error
        return Came(heard.done, heard.reason, heard.counts)

    return give
