"""Single sign-on with a provider of somebody else's making: who comes in, as whom, and who does not."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

pytest.importorskip("authlib", reason="the extra 'console' is not installed")

from homeostat.console.sign_on.provider import FRESH_S
from tests.cli.command import homeostat, refused
from tests.console.served import PASSWORD, Served, accounts, served
from tests.console.test_orders import heard, until, waits
from tests.equipment.attended import Attended
from tests.equipment.oidc.providing import Providing, Visitor, providing


@pytest.fixture(scope="module")
def provider() -> Iterator[Providing]:
    with providing() as found:
        yield found


@pytest.fixture(scope="module")
def attended(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attended]:
    with Attended(tmp_path_factory.mktemp("live") / "l") as service:
        yield service


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("people")


@pytest.fixture(scope="module")
def desk(provider: Providing, attended: Attended, folder: Path) -> Iterator[Served]:
    people = accounts(folder / "people.json", Ada="engineer")
    options = ("--people", str(people), "--sign-on", str(provider.settings(folder)))
    with served(attended.directory, *options, port=provider.console) as server:
        yield server


@pytest.fixture
def visitor() -> Iterator[Visitor]:
    with Visitor(timeout=60.0) as found:
        yield found


def me(visitor: Visitor, desk: Served) -> dict[str, Any]:
    found: dict[str, Any] = visitor.get(f"{desk.address}api/me").json()
    return found


def enter(visitor: Visitor, desk: Served, who: str) -> dict[str, Any]:
    """Sign in as ``who`` by the provider; what the page is told then."""
    answer = visitor.back(f"{desk.address}oidc/sign-in", who)
    assert (answer.status_code, answer.headers.get("location")) == (303, "/"), answer.text
    return me(visitor, desk)


def order(visitor: Visitor, desk: Served, verb: str, **rest: str) -> Any:
    """Give an order at the page of who has signed in."""
    token = me(visitor, desk)["token"]
    headers = {"Origin": desk.address.rstrip("/"), "X-Homeostat-Token": token}
    content = {"id": str(uuid.uuid4()), "verb": verb} | rest
    return visitor.post(f"{desk.address}api/order", json=content, headers=headers)


def proving(desk: Served, **about: str) -> str:
    """Where somebody goes to show who they are for an order."""
    return f"{desk.address}oidc/prove?" + "&".join(f"{name}={value}" for name, value in about.items())


@pytest.mark.parametrize(("who", "access"), [("eng.grace", "engineer"), ("op.hal", "operator"), ("view.ivy", "viewer")])
def test_groups_of_the_provider_say_what_people_may_do(visitor: Visitor, desk: Served, who: str, access: str) -> None:
    assert me(visitor, desk)["sign_on"] == "Works login" and visitor.get(f"{desk.address}api/run").status_code == 401
    found = enter(visitor, desk, who)
    assert (found["name"], found["access"], found["by_sign_on"]) == (who.partition(".")[2], access, True)
    assert visitor.get(f"{desk.address}api/run").status_code == 200
    headers = {"Origin": desk.address.rstrip("/"), "X-Homeostat-Token": found["token"]}
    answer = visitor.request("DELETE", f"{desk.address}api/session", json={}, headers=headers)
    assert answer.json()["name"] is None and visitor.get(f"{desk.address}api/run").status_code == 401


def test_who_has_no_group_does_not_look(visitor: Visitor, desk: Served) -> None:
    answer = visitor.back(f"{desk.address}oidc/sign-in", "cook.jo")
    assert answer.status_code == 403 and "none of the groups" in answer.text
    assert "set-cookie" not in answer.headers or f"homeostat-{desk.port}=" not in answer.headers["set-cookie"]
    assert me(visitor, desk)["name"] is None


def test_a_session_at_the_provider_is_nobody_at_the_screen(visitor: Visitor, desk: Served) -> None:
    enter(visitor, desk, "op.hal")
    found = enter(visitor, desk, "view.ivy")  # it is asked again, and somebody else answers
    assert found["name"] == "ivy"


def test_what_is_sent_asks_for_a_code_with_proof_and_for_people_to_sign_in(visitor: Visitor, desk: Served) -> None:
    first = visitor.get(f"{desk.address}oidc/sign-in")
    asked = {name: values[0] for name, values in parse_qs(urlsplit(first.headers["location"]).query).items()}
    assert (asked["response_type"], asked["code_challenge_method"]) == ("code", "S256")
    assert (asked["prompt"], asked["max_age"]) == ("login", "0")
    assert asked["redirect_uri"] == f"{desk.address}oidc/callback" and len(asked["code_challenge"]) == 43
    cookie = first.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=lax" in cookie and asked["state"] not in cookie
    again = parse_qs(urlsplit(visitor.get(f"{desk.address}oidc/sign-in").headers["location"]).query)
    assert all(again[name][0] != asked[name] for name in ("state", "nonce", "code_challenge"))


@pytest.mark.parametrize("what", ["state", "cookie", "other cookie", "code", "iss", "no iss", "refused", "nothing"])
def test_an_answer_that_is_not_ours_lets_nobody_in(visitor: Visitor, desk: Served, what: str) -> None:
    back = visitor.sign_in(f"{desk.address}oidc/sign-in", "eng.grace").headers["location"]
    parts = {name: values[0] for name, values in parse_qs(urlsplit(back).query).items()}
    assert set(parts) == {"code", "state", "iss"}
    if what == "cookie":
        visitor.cookies.clear()
    elif what == "other cookie":
        visitor.get(f"{desk.address}oidc/sign-in")  # another question was asked since
    changed = {
        "state": parts | {"state": "guessed"}, "code": parts | {"code": "guessed"}, "iss": parts | {"iss": "http://evil"},
        "no iss": {k: v for k, v in parts.items() if k != "iss"}, "nothing": {},
        "refused": {"error": "access_denied", "state": parts["state"], "error_description": "<b>markup</b>"},
    }.get(what, parts)  # fmt: skip
    answer = visitor.get(f"{desk.address}oidc/callback", params=changed)
    assert answer.status_code == 403 and "<b>" not in answer.text, answer.text
    assert me(visitor, desk)["name"] is None


def test_an_answer_counts_once(visitor: Visitor, desk: Served) -> None:
    back = visitor.sign_in(f"{desk.address}oidc/sign-in", "eng.grace").headers["location"]
    kept = dict(visitor.cookies)
    assert visitor.get(back).status_code == 303
    with Visitor(timeout=60.0) as thief:
        assert thief.get(back).status_code == 403
        for name, value in kept.items():
            thief.cookies.set(name, value)
        assert thief.get(back).status_code == 403, "the provider gives a token for a code once"
        assert me(thief, desk)["name"] is None


def test_names_stay_with_people_and_nobody_has_somebody_elses(
    visitor: Visitor, desk: Served, provider: Providing
) -> None:
    assert enter(visitor, desk, "op.kim")["name"] == "kim"
    provider.rename("op.kim", "boss")
    assert enter(visitor, desk, "op.kim")["name"] == "kim", "orders of one person bear one name"
    for who, name in (("op.lee", "KIM"), ("op.max", "ada"), ("op.nan", "a‮b"), ("op.oli", "x" * 61)):
        provider.rename(who, name)
        answer = visitor.back(f"{desk.address}oidc/sign-in", who)
        assert answer.status_code == 403 and "Your name cannot be used" in answer.text, name


def test_an_order_is_proven_at_the_provider_for_just_this_order(
    visitor: Visitor, desk: Served, attended: Attended
) -> None:
    enter(visitor, desk, "op.hal")
    request, digest = waits(attended)
    sent, about = len(attended.sent), {"id": str(uuid.uuid4()), "verb": "approve", "subject": request, "digest": digest}
    order_it = {"subject": request, "digest": digest, "id": about["id"], "reason": "seen"}
    for password in ("", PASSWORD.format("Ada")):
        answer = order(visitor, desk, "approve", **order_it, password=password)
        assert answer.status_code == 403 and "has not been asked" in answer.json()["error"]
    answer = visitor.back(proving(desk, **about), "op.hal")
    assert answer.status_code == 200 and "It is known that it is you" in answer.text
    for other in ({"id": str(uuid.uuid4())}, {"subject": "r0"}):
        assert order(visitor, desk, "approve", **{**order_it, **other}).status_code in (403, 409)
    assert order(visitor, desk, "reject", **order_it).status_code == 403, "it was shown for another order"
    assert len(attended.sent) == sent
    assert order(visitor, desk, "approve", **order_it).json()["done"]
    assert order(visitor, desk, "approve", **order_it).json()["done"], "whoever lost the answer gets it again"
    until(lambda: len(attended.sent) > sent)
    assert len(attended.sent) == sent + 1
    (said,) = [h for h in heard(attended) if h["subject"] == request]
    assert said["person"].startswith("hal (login ") and (said["role"], said["done"]) == ("OPERATOR", True)


def test_nobody_proves_an_order_of_somebody_else(visitor: Visitor, desk: Served) -> None:
    about = {"id": str(uuid.uuid4()), "verb": "mode", "subject": "observe", "digest": ""}
    assert visitor.get(proving(desk, **about)).status_code == 401, "without a session there is nothing to prove"
    enter(visitor, desk, "eng.grace")
    answer = visitor.back(proving(desk, **about), "eng.pat")
    assert answer.status_code == 403 and "Somebody else" in answer.text
    assert order(visitor, desk, "mode", subject="observe", id=about["id"]).status_code == 403
    assert visitor.get(f"{desk.address}api/proof", params=about).json() == {"proven": False}
    for wrong in ({"verb": "destroy"}, {"verb": "acknowledge"}, {"id": "../x"}):
        assert visitor.get(proving(desk, **{**about, **wrong})).status_code == 400


def test_the_guard_judges_an_order_by_the_groups_of_whoever_proves_it(visitor: Visitor, desk: Served) -> None:
    enter(visitor, desk, "op.hal")
    about = {"id": str(uuid.uuid4()), "verb": "mode", "subject": "observe", "digest": ""}
    assert visitor.back(proving(desk, **about), "op.hal").status_code == 200
    answer = order(visitor, desk, "mode", subject="observe", id=about["id"]).json()
    assert not answer["done"] and answer["reason"] == "only an engineer may order 'mode'"


@pytest.mark.slow
def test_a_provider_that_asks_nobody_again_is_not_believed(attended: Attended, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with providing("stale") as provider:
        options = ("--people", str(people), "--sign-on", str(provider.settings(tmp_path)))
        with served(attended.directory, *options, port=provider.console) as desk, Visitor(timeout=60.0) as visitor:
            enter(visitor, desk, "op.hal")
            time.sleep(FRESH_S + 3.0)
            answer = visitor.back(f"{desk.address}oidc/sign-in", "op.hal")
            assert answer.status_code == 403 and "answer cannot be used" in answer.text


def test_without_the_provider_the_console_begins_and_local_people_come_in(attended: Attended, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with providing() as provider:
        settings = provider.settings(tmp_path)
    options = ("--people", str(people), "--sign-on", str(settings))
    with served(attended.directory, *options, port=provider.console) as desk, Visitor(timeout=60.0) as visitor:
        answer = visitor.get(f"{desk.address}oidc/sign-in")
        assert answer.status_code == 502 and "cannot be used" in answer.text
        proof, headers = {"name": "Ada", "password": PASSWORD.format("Ada")}, {"Origin": desk.address.rstrip("/")}
        assert visitor.post(f"{desk.address}api/session", json=proof, headers=headers).status_code == 200


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"issuer": '"http://login.example"'}, "must begin with https://"),
        ({"issuer": '"https://user:word@login.example"'}, "neither user, query nor fragment"),
        ({"issuer": '"https://login.example/?x=1"'}, "neither user"),
        ({"address": '"http://console.example"'}, "must begin with https://"),
        ({"address": '"https://console.example"'}, "is served by http"),
        ({"address": '"http://127.0.0.1:1/under"'}, "without a path"),
        ({"scope": '"profile"'}, "openid"),
        ({"secret_file": ""}, "HOMEOSTAT_OIDC_SECRET"),
        ({"secret_file": '"none"'}, "none"),
        ({"client": ""}, "client"),
        ({"typo": '"x"'}, "typo"),
        ({"ca": '"none.pem"'}, "none.pem"),
        ({"title": "x"}, "no TOML"),
    ],
)
def test_settings_that_are_not_safe_are_refused_in_one_line(
    recovered_run: Path, tmp_path: Path, changed: dict[str, str], words: str
) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    settings = Providing("https://login.example", 1).settings(tmp_path, **changed)
    options = ("--no-browser", "--people", str(people), "--sign-on", str(settings))
    refused(homeostat("console", str(recovered_run), *options, cwd=tmp_path), words)


def test_settings_and_secret_are_their_owners_alone(recovered_run: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    settings = Providing("https://login.example", 1).settings(tmp_path)
    given = ("console", str(recovered_run), "--no-browser", "--sign-on", str(settings))
    refused(homeostat(*given, cwd=tmp_path), "--sign-on needs --people")
    for path in (settings, tmp_path / "secret"):
        path.chmod(0o644)
        refused(homeostat(*given, "--people", str(people), cwd=tmp_path), "chmod 600")
        path.chmod(0o600)
