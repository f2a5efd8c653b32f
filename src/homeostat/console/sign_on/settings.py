"""Which provider is asked who somebody is, and what its people may do: one file, for its owner alone."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from homeostat.console.people.accounts import Access
from homeostat.console.people.owned import NotOwned, reading

SECRET: Final = "HOMEOSTAT_OIDC_SECRET"
"""Environment variable with the client's secret, where the settings name no file with it."""
CALLBACK: Final = "/oidc/callback"
"""Where the provider sends a browser back to: the one address below the page's that it must know."""
_LARGEST: Final = 100_000
_LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})


class SignOnError(ValueError):
    """Single sign-on cannot be used as it is set up; one line with the remedy."""


class Roles(BaseModel):
    """What the provider says of people, and what they may do by that."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    claim: str = Field(min_length=1, max_length=200)
    engineer: tuple[str, ...] = ()
    operator: tuple[str, ...] = ()
    viewer: tuple[str, ...] = ()

    def access(self, claims: Mapping[str, Any]) -> Access | None:
        """The most that ``claims`` allow; None where they allow nothing, not even to look."""
        said = _at(claims, self.claim)
        values = {said} if isinstance(said, str) else {v for v in said if isinstance(v, str)} if _many(said) else set()
        lists = {Access.ENGINEER: self.engineer, Access.OPERATOR: self.operator, Access.VIEWER: self.viewer}
        return next((access for access, names in lists.items() if values & set(names)), None)


class SignOnSettings(BaseModel):
    """The settings file (TOML)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str = Field(min_length=1, max_length=40)
    """What the page calls the provider."""
    issuer: str
    """The provider, as its tokens name it."""
    client: str = Field(min_length=1, max_length=200)
    """Name under which the provider knows the console."""
    address: str
    """Address of the page; the provider knows ``ADDRESS/oidc/callback``."""
    roles: Roles
    secret_file: Path | None = None
    """File with the client's secret, beside the settings where it is relative."""
    ca: Path | None = None
    """Certificates that the provider's is trusted by, and no others (PEM), beside the settings where it is relative.

    None for the system's."""
    scope: str = "openid profile"
    name_claim: str = Field(default="preferred_username", min_length=1, max_length=200)
    """The claim that has the name that orders bear."""
    acr: tuple[str, ...] = ()
    """Ways of signing in of which the provider must have used one; any will do where there are none."""

    @field_validator("issuer", "address")
    @classmethod
    def _encrypted(cls, value: str) -> str:
        return secure(value)

    @field_validator("address")
    @classmethod
    def _bare(cls, value: str) -> str:
        if urlsplit(value).path.strip("/"):
            raise ValueError("is the address of the page, without a path")
        return value.rstrip("/")

    @field_validator("scope")
    @classmethod
    def _openid(cls, value: str) -> str:
        if "openid" not in value.split():
            raise ValueError("must have 'openid' in it")
        return value

    @property
    def redirect(self) -> str:
        """Where the provider sends a browser back to."""
        return self.address + CALLBACK


def read_settings(path: Path) -> tuple[SignOnSettings, str]:
    """The settings in ``path``, and the client's secret; SignOnError where they cannot be used."""
    try:
        settings = SignOnSettings.model_validate(_stated(path))
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise SignOnError(f"{str(path)!r}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    if settings.ca is not None:
        settings = settings.model_copy(update={"ca": path.parent / settings.ca})
    if settings.secret_file is None:
        secret = os.environ.get(SECRET, "")
    else:
        secret = _owned(path.parent / settings.secret_file).strip()
    if not secret:
        raise SignOnError(f"{str(path)!r} names no secret_file with the client's secret, and {SECRET} is not set")
    return settings, secret


def secure(url: str) -> str:
    """``url``, where it is https, or leads to this machine; ValueError otherwise."""
    parts = urlsplit(url)
    if parts.scheme != "https" and not (parts.scheme == "http" and parts.hostname in _LOOPBACK):
        raise ValueError(f"{url[:80]!r} must begin with https:// (http:// leads to this machine only)")
    if not parts.hostname or parts.username or parts.password or parts.query or parts.fragment:
        raise ValueError(f"{url[:80]!r} must have a host, and neither user, query nor fragment")
    return url


def _stated(path: Path) -> dict[str, Any]:
    text = _owned(path)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of thousands of digits is no error of the format
        raise SignOnError(f"{str(path)!r} is no TOML: {error}") from error


def _owned(path: Path) -> str:
    try:
        with reading(path) as file:
            return file.read(_LARGEST).decode()
    except NotOwned as error:
        raise SignOnError(str(error)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise SignOnError(f"{str(path)!r} cannot be read: {getattr(error, 'strerror', None) or error}") from error


def _at(claims: Mapping[str, Any], name: str) -> Any:
    """The claim ``name``, or what is inside of others by a name with dots (``realm_access.roles``)."""
    if name in claims:
        return claims[name]
    found: Any = claims
    for part in name.split("."):
        found = found.get(part) if isinstance(found, Mapping) else None
    return found


def _many(said: object) -> bool:
    return isinstance(said, list | tuple)
