"""Seals: proof that the release check stands behind a request and that nothing was altered since."""

import hashlib
import hmac
import secrets
from collections.abc import Callable
from dataclasses import replace

from homeostat.domain.request import Request, Seal


class Sealer:
    """Seals requests in the name of one issuer; proposers never get hold of it."""

    def __init__(self, issuer: str, key: bytes, lasts_s: Callable[[], float] = lambda: 30.0) -> None:
        """``key`` is shared with the guard and with nobody else; ``lasts_s``: how long a seal holds at present [s]."""
        self._issuer, self._key, self._lasts_s = issuer, key, lasts_s

    def seal(self, request: Request, checked_s: float) -> Request:
        """``request`` with the seal of a release check that knew the plant up to ``checked_s`` [s]."""
        blank = Seal(self._issuer, checked_s, checked_s + self._lasts_s(), secrets.token_hex(16), "")
        unsealed = replace(request, seal=blank)
        return replace(unsealed, seal=replace(blank, mac=code(unsealed, self._key)))


def new_key() -> bytes:
    """A key for one run; it leaves the process with nobody."""
    return secrets.token_bytes(32)


def code(request: Request, key: bytes) -> str:
    """HMAC-SHA256 (RFC 2104) of all that the seal of ``request`` stands for, in hexadecimal."""
    return hmac.new(key, request.sealed(), hashlib.sha256).hexdigest()


def genuine(request: Request, key: bytes) -> bool:
    """Whether the seal of ``request`` was made with ``key`` and nothing was altered since."""
    return hmac.compare_digest(code(request, key).encode(), request.seal.mac.encode(errors="replace"))
