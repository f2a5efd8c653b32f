"""Security of a connection: encrypted, signed and with a certificate that we trust; anything weaker only reads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from homeostat.links.errors import LinkError
from homeostat.links.opcua.security.certificate import Pki

if TYPE_CHECKING:
    from asyncua.client.client import Client

APPLICATION: Final = "urn:homeostat:link"
"""Application URI of a link; its certificate names it."""
SERVED: Final = "urn:homeostat:served-plant"
"""The same of a served plant."""


@dataclass(frozen=True, slots=True)
class Security:
    """How a link shows who it is, and whom it believes."""

    pki: Pki | None = None
    """Own key and certificate, and the servers that are trusted; None for a connection without encryption."""
    insecure: bool = False
    """Whether a connection without encryption is wanted; it never writes."""
    login: tuple[str, str] | None = field(default=None, repr=False)
    """Name and password; None for none."""
    withheld: str = ""
    """Why nothing may be commanded although the connection is encrypted; empty where it may."""

    def check(self) -> None:
        """LinkError where there is neither encryption nor the wish to do without, or a file of it is not as it must be.

        Also where a password would go over a connection without encryption.
        """
        if self.pki is not None:
            self.pki.check()
        elif not self.insecure:
            raise LinkError("no certificate was given: say --pki FOLDER, or --insecure to read without encryption")
        elif self.login is not None:
            raise LinkError("a password would be readable on the way; leave it out, or give --pki FOLDER")

    @property
    def encrypted(self) -> bool:
        """Whether the connection is encrypted, and both sides are known: only then is anything written at all."""
        return self.pki is not None

    @property
    def refusal(self) -> str:
        """Why no plant is commanded over such a connection, with the remedy; empty where one is."""
        if not self.encrypted:
            return "the connection is not encrypted, so nothing is written over it; give --pki FOLDER"
        return self.withheld

    async def apply(self, client: Client) -> None:
        """Set ``client`` up before it connects."""
        from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
        from asyncua.crypto.truststore import TrustStore
        from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions

        client.application_uri = APPLICATION
        if self.login is not None:
            client.set_user(self.login[0])
            client.set_password(self.login[1])
        if self.pki is None:
            return
        trust = TrustStore([self.pki.trusted], [])
        await trust.load()
        options = CertificateValidatorOptions.TRUSTED_VALIDATION | CertificateValidatorOptions.PEER_SERVER
        client.certificate_validator = CertificateValidator(options, trust)
        await client.set_security(SecurityPolicyBasic256Sha256, self.pki.certificate, self.pki.key)
