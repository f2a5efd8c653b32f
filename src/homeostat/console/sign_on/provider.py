"""The provider: where it is asked, and what its answers say once everything about them is right."""

from __future__ import annotations

import ssl
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, final

import httpx2
from authlib.common.errors import AuthlibBaseError
from authlib.integrations.httpx_client import OAuth2Client
from authlib.oidc.core import CodeIDToken
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet

from homeostat.console.sign_on.settings import SignOnSettings, secure

ALGORITHMS: Final = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
"""Signatures that are believed: with a key of the provider's alone."""
TIMEOUT_S: Final = 10.0
"""How long an answer of the provider is waited for, wall-clock [s]."""
LEEWAY_S: Final = 60
"""By how much the provider's clock may be off [s]."""
FRESH_S: Final = 5.0
"""Who was asked for a password was asked after the browser was sent there, or at most so long before [s]."""
_KEPT_S: Final = 3600.0
_AGAIN_S: Final = 10.0


class ProviderError(Exception):
    """The provider does not answer, or its answer cannot be believed; one line says why."""


@dataclass(frozen=True, slots=True)
class Request:
    """What a provider was asked."""

    state: str
    """What it sends back with its answer."""
    nonce: str
    """What is in its token."""
    verifier: str
    """What shows that the answer is ours (PKCE)."""
    begun_s: float
    """When, by a clock that nobody sets [s]."""


@final
class Provider:
    """One provider; it is first asked when somebody signs in, so that a console begins without it."""

    def __init__(self, settings: SignOnSettings, secret: str) -> None:
        """``secret`` is the client's."""
        self._settings, self._secret = settings, secret
        self._trust = ssl.create_default_context(cafile=None if settings.ca is None else str(settings.ca))
        self._lock = threading.Lock()
        self._described: tuple[float, Mapping[str, Any]] | None = None
        self._keys: tuple[float, KeySet] | None = None

    def address(self, request: Request) -> str:
        """Where a browser is sent: somebody is to show who they are, whoever was at that browser before."""
        with self._client() as client:
            more = {"nonce": request.nonce, "prompt": "login", "max_age": "0"}
            if self._settings.acr:
                more["acr_values"] = " ".join(self._settings.acr)
            endpoint = self._endpoint(client, "authorization_endpoint")
            made, _ = client.create_authorization_url(endpoint, request.state, request.verifier, **more)
            return str(made)

    def claims(self, request: Request, code: str, issuer: str | None) -> Mapping[str, Any]:
        """What the provider says of whoever came back with ``code``; ``issuer`` is who sent them (RFC 9207)."""
        try:
            with self._client() as client:
                said = self._describes(client)
                needed = said.get("authorization_response_iss_parameter_supported") is True
                if (issuer is not None or needed) and issuer != self._settings.issuer:
                    raise ProviderError("the answer is another provider's")
                ways = said.get("token_endpoint_auth_methods_supported", ["client_secret_basic"])
                if "client_secret_basic" not in ways:
                    client.token_endpoint_auth_method = "client_secret_post"
                token = client.fetch_token(
                    self._endpoint(client, "token_endpoint"), code=code, code_verifier=request.verifier
                )
                return self._verified(client, request, token)
        except (httpx2.HTTPError, AuthlibBaseError, ValueError) as error:
            raise ProviderError(f"the provider gave no token: {self._why(error)}") from error

    def _verified(self, client: OAuth2Client, request: Request, token: Mapping[str, Any]) -> Mapping[str, Any]:
        text = token.get("id_token")
        if not isinstance(text, str):
            raise ProviderError("the provider gave no token that says who it is")
        try:
            return self.verified(text, self._keys_now(client, False), request, token.get("access_token"))
        except ProviderError:  # keys change: those that are newer are asked for
            return self.verified(text, self._keys_now(client, True), request, token.get("access_token"))

    def verified(self, text: str, keys: KeySet, request: Request, access_token: str | None) -> Mapping[str, Any]:
        """The claims of the token ``text``; ProviderError where anything about it is not as it must be."""
        settings = self._settings
        must = {"iss": settings.issuer, "aud": settings.client}
        try:
            read = jwt.decode(text, keys, algorithms=ALGORITHMS)
            options: Any = {name: {"essential": True, "value": value} for name, value in must.items()}
            about = {"nonce": request.nonce, "client_id": settings.client, "access_token": access_token}
            claims = CodeIDToken(read.claims, read.header, options, about)
            claims.validate(leeway=LEEWAY_S)
            age_s = float(claims["iat"]) - float(claims["auth_time"])
        except (JoseError, KeyError, ValueError, TypeError) as error:
            raise ProviderError(f"the provider's token is not right: {type(error).__name__}: {error}") from error
        if not isinstance(claims["sub"], str) or not claims["sub"]:
            raise ProviderError("the provider's token is not right: it says of nobody")
        if age_s > time.monotonic() - request.begun_s + FRESH_S:
            raise ProviderError(f"the provider asked nobody to sign in: it did so {age_s:.0f} s before")
        if settings.acr and claims.get("acr") not in settings.acr:
            raise ProviderError(f"the provider let them sign in by {claims.get('acr')!r}, not by {settings.acr}")
        return dict(claims)

    def _client(self) -> OAuth2Client:
        settings = self._settings
        return OAuth2Client(
            settings.client, self._secret, scope=settings.scope, redirect_uri=settings.redirect,
            code_challenge_method="S256", verify=self._trust, timeout=TIMEOUT_S, grant_type="authorization_code",
        )  # fmt: skip

    def _endpoint(self, client: OAuth2Client, name: str) -> str:
        found = self._describes(client).get(name)
        try:
            return secure(str(found))
        except ValueError as error:
            raise ProviderError(f"the provider's {name} cannot be used: {error}") from error

    def _describes(self, client: OAuth2Client) -> Mapping[str, Any]:
        """What the provider says of itself (OpenID Connect Discovery), asked for once an hour."""
        with self._lock:
            if self._described is None or time.monotonic() - self._described[0] > _KEPT_S:
                where = self._settings.issuer.rstrip("/") + "/.well-known/openid-configuration"
                found = self._asked(client, where)
                if found.get("issuer") != self._settings.issuer:
                    raise ProviderError(f"{where} is the description of {str(found.get('issuer'))[:80]!r}")
                if "S256" not in found.get("code_challenge_methods_supported", ["S256"]):
                    raise ProviderError(f"{where} does not offer PKCE with S256")
                self._described = time.monotonic(), found
            return self._described[1]

    def _keys_now(self, client: OAuth2Client, again: bool) -> KeySet:
        where = self._endpoint(client, "jwks_uri")
        with self._lock:
            age_s = None if self._keys is None else time.monotonic() - self._keys[0]
            if self._keys is None or age_s is None or age_s > (_AGAIN_S if again else _KEPT_S):
                found: Any = self._asked(client, where)
                try:
                    self._keys = time.monotonic(), KeySet.import_key_set(found)
                except (JoseError, KeyError, ValueError, TypeError) as error:
                    raise ProviderError(f"{where} has no keys: {error}") from error
            return self._keys[1]

    def _asked(self, client: OAuth2Client, where: str) -> Mapping[str, Any]:
        try:
            answer = client.request("GET", where, withhold_token=True)
            answer.raise_for_status()
            found = answer.json()
        except (httpx2.HTTPError, ValueError) as error:
            raise ProviderError(f"{where} does not answer: {self._why(error)}") from error
        if not isinstance(found, dict):
            raise ProviderError(f"{where} does not describe a provider")
        return found

    def _why(self, error: BaseException) -> str:
        """``error`` in one line; of a certificate that is not trusted, by what it is not."""
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, ssl.SSLCertVerificationError):
            cause = cause.__cause__ or cause.__context__
        if cause is None:
            return " ".join(f"{type(error).__name__}: {error}".split())
        ca = self._settings.ca
        by = "the system's certificates; ca in the settings names others" if ca is None else f"{str(ca)!r} (ca)"
        return f"its certificate is not trusted by {by}: {cause.verify_message}"
