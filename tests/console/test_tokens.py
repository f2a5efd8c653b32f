"""Tokens that say who somebody is: one that is right is read, and everything that is not right about one is found."""

from __future__ import annotations

import hmac
import time
from base64 import urlsafe_b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("authlib", reason="the extra 'console' is not installed")

from joserfc import jwt
from joserfc.jwk import ECKey, KeySet, RSAKey

from homeostat.console.people.accounts import Access
from homeostat.console.sign_on.names import Names
from homeostat.console.sign_on.provider import FRESH_S, LEEWAY_S, Provider, ProviderError, Request
from homeostat.console.sign_on.settings import Roles, SignOnError, read_settings
from tests.equipment.oidc.providing import Providing

ISSUER = "https://login.example"
KEY, OTHER = (RSAKey.generate_key(2048, {"kid": name, "use": "sig"}, private=True) for name in ("one", "other"))
KEYS = KeySet.import_key_set({"keys": [KEY.as_dict(private=False)]})


def provider(folder: Path, **changed: str) -> Provider:
    return Provider(*read_settings(Providing(ISSUER, 1).settings(folder, **changed)))


def claims(**changed: Any) -> dict[str, Any]:
    """What a provider says; what is None is left out."""
    now = int(time.time())
    said = {"iss": ISSUER, "sub": "1", "aud": "homeostat", "exp": now + 300, "iat": now, "nonce": "n", "auth_time": now}
    return {name: value for name, value in (said | changed).items() if value is not None}


def read(
    folder: Path, said: Mapping[str, Any], key: Any = KEY, alg: str = "RS256", begun_ago_s: float = 0.0, **changed: str
) -> Mapping[str, Any]:
    text = jwt.encode({"alg": alg, "kid": "one"}, dict(said), key, algorithms=[alg])
    asked = Request("s", "n", "v", time.monotonic() - begun_ago_s)
    return provider(folder, **changed).verified(text, KEYS, asked, None)


def test_a_token_that_is_right_is_read(tmp_path: Path) -> None:
    assert read(tmp_path, claims(groups=["a"]))["groups"] == ["a"]
    assert read(tmp_path, claims(aud=["homeostat"]))["sub"] == "1"
    assert read(tmp_path, claims(aud=["homeostat", "other"], azp="homeostat"))["sub"] == "1"


@pytest.mark.parametrize(
    "changed",
    [
        {"iss": "https://evil.example"}, {"iss": None}, {"iss": ISSUER + "/"}, {"aud": "other"}, {"aud": None},
        {"aud": ["other"]}, {"aud": ["homeostat", "other"], "azp": "other"}, {"nonce": "another"}, {"nonce": None},
        {"nonce": ""}, {"exp": 1}, {"exp": None}, {"iat": None}, {"iat": 2**40}, {"exp": "soon"}, {"auth_time": None},
        {"auth_time": "now"}, {"auth_time": 1}, {"sub": None}, {"sub": ""}, {"sub": 7}, {"nbf": 2**40},
    ],
    ids=str,
)  # fmt: skip
def test_a_token_of_which_anything_is_wrong_is_not_believed(tmp_path: Path, changed: dict[str, Any]) -> None:
    with pytest.raises(ProviderError):
        read(tmp_path, claims(**changed))


def test_only_the_providers_key_signs_and_only_as_keys_of_its_kind_do(tmp_path: Path) -> None:
    with pytest.raises(ProviderError):
        read(tmp_path, claims(), OTHER)
    with pytest.raises(ProviderError):
        read(tmp_path, claims(), ECKey.generate_key("P-256", {"kid": "one"}), "ES256")
    text = jwt.encode({"alg": "RS256", "kid": "one"}, claims(), KEY)
    head, body, seal = text.split(".")
    none, shared = "eyJhbGciOiJub25lIn0", urlsafe_b64encode(b'{"alg":"HS256","kid":"one"}').decode().rstrip("=")
    made = hmac.digest(KEY.as_pem(private=False), f"{shared}.{body}".encode(), "sha256")  # of what everybody knows
    forged = f"{shared}.{body}.{urlsafe_b64encode(made).decode().rstrip('=')}"
    altered = f"{head}.{body[:-2]}AA.{seal}"
    for wrong in (f"{head}.{body}.", f"{none}.{body}.", f"{none}.{body}.{seal}", altered, forged, "", "x"):
        with pytest.raises(ProviderError):
            provider(tmp_path).verified(wrong, KEYS, Request("s", "n", "v", time.monotonic()), None)


def test_who_was_asked_before_was_not_asked(tmp_path: Path) -> None:
    now = int(time.time())
    asked = int(FRESH_S)
    assert read(tmp_path, claims(iat=now, auth_time=now - asked))
    assert read(tmp_path, claims(iat=now, auth_time=now - 90), begun_ago_s=100.0), "they took a while to sign in"
    with pytest.raises(ProviderError, match="asked nobody to sign in"):
        read(tmp_path, claims(iat=now, auth_time=now - 90))
    skewed = now + LEEWAY_S - 5
    assert read(tmp_path, claims(iat=skewed, auth_time=skewed, exp=skewed + 60)), "its clock may be off"


def test_a_way_of_signing_in_can_be_asked_for(tmp_path: Path) -> None:
    assert read(tmp_path, claims(acr="mfa"), acr='["mfa", "key"]')
    for acr in (None, "password", ["mfa"]):
        with pytest.raises(ProviderError, match="sign in by"):
            read(tmp_path, claims(acr=acr), acr='["mfa", "key"]')


@pytest.mark.parametrize(
    ("said", "access"),
    [
        ({"groups": ["eng", "op"]}, Access.ENGINEER), ({"groups": "op"}, Access.OPERATOR),
        ({"groups": ["view"]}, Access.VIEWER), ({"groups": []}, None), ({}, None), ({"groups": None}, None),
        ({"groups": ["ENG"]}, None), ({"groups": 7}, None),
        ({"groups": [["eng"]]}, None), ({"groups": {"eng": True}}, None), ({"groups": "eng op"}, None),
    ],
)  # fmt: skip
def test_roles_are_those_of_the_table_and_nothing_else(said: dict[str, Any], access: Access | None) -> None:
    roles = Roles(claim="groups", engineer=("eng",), operator=("op",), viewer=("view",))
    assert roles.access(said) == access


def test_a_claim_may_be_inside_of_another_or_have_dots() -> None:
    roles = Roles(claim="realm_access.roles", operator=("op",))
    assert roles.access({"realm_access": {"roles": ["op"]}}) == roles.access({"realm_access.roles": "op"}) == "operator"
    assert roles.access({"realm_access": ["op"]}) is None


def test_names_are_kept_for_people_and_for_their_owner_alone(tmp_path: Path) -> None:
    names, path = Names(tmp_path / "sign-on.toml"), tmp_path / "sign-on.toml.names"
    assert names.of("1", "Ada") == "Ada" and names.of("1", "Eve") == "Ada" and names.of("2", "ＡDA") is None
    assert names.of("2", "Eve") == "Eve" and Names(tmp_path / "sign-on.toml").known() == {"1": "Ada", "2": "Eve"}
    assert path.stat().st_mode & 0o777 == 0o600
    path.chmod(0o666)
    with pytest.raises(SignOnError, match="chmod 600"):
        names.of("1", "Ada")
    path.chmod(0o600)
    path.write_text("[]")
    with pytest.raises(SignOnError, match="does not say"):
        names.known()


@pytest.mark.parametrize("said", ["title = ", "title = " + 5000 * "9", "title = " + 5000 * "[" + 5000 * "]"])
def test_settings_that_are_no_toml_are_refused_in_one_line(tmp_path: Path, said: str) -> None:
    path = tmp_path / "sign-on.toml"
    path.touch(0o600)
    path.write_text(said)
    with pytest.raises(SignOnError, match="is no TOML") as refused:
        read_settings(path)
    assert "\n" not in str(refused.value)
