"""Requests to the guard: frozen, sealed by who checked them, answered always (NAMUR NE 178)."""

import json
from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Finding


class RequestStatus(StrEnum):
    """How far a request has come in the chain of verification."""

    RECEIVED = "received"
    """It is in the mailbox."""
    AUTHORISED = "authorised"
    """Its seal is an issuer's, fresh, and was not used before."""
    VERIFIED = "verified"
    """It passed every check on the very reading that it was decided on."""
    OFFERED = "offered"
    """It waits for a person's yes."""
    ACCEPTED = "accepted"
    """Its commands are on the way to the plant."""
    CONFIRMED = "confirmed"
    """The plant was read back and holds every accepted target."""
    ADVISED = "advised"
    """It passed, and is shown; in this mode nobody writes."""
    REFUSED = "refused"
    """A check failed; the answer says which."""
    FAILED = "failed"
    """The plant does not hold what was written."""
    WITHDRAWN = "withdrawn"
    """Its issuer gave up, or a trip, a mode change or a person overtook it."""

    @property
    def final(self) -> bool:
        """Whether nothing more will be said of the request."""
        way = RequestStatus
        return self not in (way.RECEIVED, way.AUTHORISED, way.VERIFIED, way.OFFERED, way.ACCEPTED)


@dataclass(frozen=True, slots=True)
class Seal:
    """Who checked a request, when, and the proof that nothing was altered since."""

    issuer: str
    """Name of the release check that stands behind the request."""
    checked_s: float
    """Process time up to which the release check knew the plant [s]."""
    expires_s: float
    """Process time after which the seal is void [s]."""
    nonce: str
    """Used once."""
    mac: str
    """HMAC-SHA256 over :meth:`Request.sealed`, in hexadecimal."""


@dataclass(frozen=True, slots=True)
class Request:
    """Commands that somebody wants written, with everything that they were approved for."""

    id: str
    """Identifier, used once."""
    proposer: str
    """Who proposed it."""
    state: str
    """State of the machine that it starts in."""
    actions: ActionSet
    """Commands (with rate, None and order) and later steps."""
    path: tuple[str, ...]
    """Names of the transitions that it takes, decisions first."""
    diagnosis: str
    """Digest of the diagnosis that it was approved under."""
    configuration: str
    """Digest of the configuration that it was approved under."""
    seal: Seal
    """Proof of the release check."""

    def sealed(self) -> bytes:
        """Canonical bytes of all that the seal stands for, the seal's own fields but the code included."""
        made = [self.id, self.proposer, self.state, self.actions.digest, list(self.path), self.diagnosis]
        sealed = [self.configuration, self.seal.issuer, self.seal.checked_s, self.seal.expires_s, self.seal.nonce]
        content: list[object] = [*made, *sealed]
        return json.dumps(content, separators=(",", ":"), ensure_ascii=True).encode()


@dataclass(frozen=True, slots=True)
class Answer:
    """What the guard says of a request."""

    request: str
    """Identifier of the request."""
    status: RequestStatus
    """How far it came."""
    at_s: float
    """Process time of the answer [s]."""
    finding: Finding | None = None
    """The check that refused it, for the proposer; None where none did."""

    @property
    def reason(self) -> str:
        """One sentence; empty where nothing was refused."""
        return "" if self.finding is None else self.finding.message
