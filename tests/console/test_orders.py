"""Orders over the console's server: whose they are, what they are bound to, and that each is carried out once."""

from __future__ import annotations

import functools
import time
import uuid
from collections.abc import Callable, Iterator
from http.cookies import SimpleCookie
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.domain.events.people import PersonHeard
from homeostat.journal import read_events
from tests.console.served import PASSWORD, Browser, Served, accounts, served
from tests.equipment.attended import Attended


@pytest.fixture(scope="module")
def attended(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attended]:
    with Attended(tmp_path_factory.mktemp("live") / "l") as service:
        yield service


@pytest.fixture(scope="module")
def desk(attended: Attended, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    people = accounts(
        tmp_path_factory.mktemp("people") / "people.json", Ada="engineer", Bo="operator", Cem="engineer", Vi="viewer"
    )
    with served(attended.directory, "--people", str(people)) as server:
        yield server


@functools.cache
def by(desk: Served, name: str) -> Browser:
    """A browser in which ``name`` has signed in."""
    browser = Browser(desk)
    assert browser.sign_in(name).status == 200
    return browser


def until(found: Callable[[], Any], within_s: float = 60.0) -> Any:
    end = time.monotonic() + within_s
    while not (value := found()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return value


def heard(attended: Attended) -> list[dict[str, Any]]:
    return [dict(r.fields) for r in read_events(attended.directory) if r.kind == PersonHeard.kind]


def waits(attended: Attended) -> tuple[str, str]:
    """A request that waits for a yes, and its digest."""
    name, actions = attended.propose()
    until(lambda: name in {request.id for request in attended.world.guard.offered})
    return name, actions.digest


def test_without_a_session_nothing_is_shown(desk: Served) -> None:
    for path in ("/api/run", "/api/moment", "/api/stream", "/api/trend?tag=T"):
        assert desk.ask(path).status == 401
        assert desk.ask(path, Cookie=f"homeostat-{desk.port}=forged").status == 401
    nobody = {"name": None, "access": None, "token": None}
    page = {"people": True, "codes": False, "orders": True, "sign_on": None, "by_sign_on": False}
    assert desk.ask("/api/me").json == page | nobody
    assert desk.ask("/").status == 200


def test_a_cookie_is_out_of_reach_of_scripts_and_other_sites(desk: Served) -> None:
    answer = Browser(desk).sign_in("Ada")
    cookie = answer.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= {part.strip() for part in cookie.split(";")}
    assert "expires" not in cookie.lower() and "max-age" not in cookie.lower()
    assert cookie.partition(";")[0] != by(desk, "Ada").cookie


def test_two_consoles_of_one_host_leave_each_others_sessions_alone(
    desk: Served, recovered_run: Path, tmp_path: Path
) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with served(recovered_run, "--people", str(people)) as other:
        jar = SimpleCookie()  # a browser has one for the host: ports are nothing to it
        for server in (desk, other):
            answer = Browser(server).sign_in("Ada")
            jar.load(answer.headers["set-cookie"])
        sent = "; ".join(f"{name}={morsel.value}" for name, morsel in jar.items())
        assert [server.ask("/api/me", Cookie=sent).json["name"] for server in (desk, other)] == ["Ada", "Ada"]
        forwarded = {"Host": "127.0.0.1:9000", "Origin": "http://127.0.0.1:9000", "Content-Type": "application/json"}
        proof = f'{{"name": "Ada", "password": "{PASSWORD.format("Ada")}"}}'.encode()
        kept = other.ask("/api/session", "POST", proof, **forwarded).headers["set-cookie"]
        assert kept.startswith("homeostat-9000="), "a tunnel's port is the one that the browser knows"


def test_a_failed_sign_in_says_the_same_of_everybody(desk: Served) -> None:
    answers = [Browser(desk).sign_in(name, "not the password") for name in ("Ada", "Zoe", "' or 1=1 --")]
    assert {(a.status, a.body) for a in answers} == {(403, answers[0].body)} and b"password" in answers[0].body


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({"Origin": "http://evil.example"}, 403), ({"Origin": ""}, 403), ({"Origin": "null"}, 403),
        ({"X_Homeostat_Token": ""}, 403), ({"X_Homeostat_Token": "guessed"}, 403), ({"X_Homeostat_Token": "é"}, 403),
        ({"Content_Type": "text/plain"}, 415), ({"Content_Type": "application/x-www-form-urlencoded"}, 415),
        ({"Cookie": ""}, 401), ({"Cookie": "homeostat-PORT=" + "A" * 43}, 401),
    ],
)  # fmt: skip
def test_an_order_that_another_page_sends_is_not_taken(
    attended: Attended, desk: Served, changed: dict[str, str], status: int
) -> None:
    browser, before = by(desk, "Ada"), heard(attended)
    content = {"id": str(uuid.uuid4()), "verb": "mode", "subject": "observe", "password": PASSWORD.format("Ada")}
    headers = {name: text.replace("PORT", str(desk.port)).encode().decode("latin-1") for name, text in changed.items()}
    assert browser.send("/api/order", content, **headers).status == status
    assert heard(attended) == before


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b"\xff", b"{" * 5000, b"x" * 20_000, b'{"id":"12345678","verb":"destroy"}',
     b'{"id":"../../x","verb":"mode"}',
     b'{"id":"12345678","verb":"mode","role":"engineer"}', b'{"id":12345678,"verb":"mode"}',
     b'{"id":"12345678","verb":"mode","subject":["observe"]}',
     b'{"id":"12345678","verb":"mode","subject":"' + b"x" * 600 + b'"}'],
)  # fmt: skip
def test_what_is_no_order_is_refused_in_one_line(attended: Attended, desk: Served, content: bytes) -> None:
    answer, before = by(desk, "Ada").send("/api/order", content), heard(attended)
    assert answer.status == 400 and list(answer.json) == ["error"] and "\n" not in answer.json["error"]
    assert heard(attended) == before


def test_a_viewer_orders_nothing_and_an_operator_changes_no_mode(attended: Attended, desk: Served) -> None:
    before = heard(attended)
    answer = by(desk, "Vi").order("acknowledge", "link")
    assert answer.status == 403 and "viewer" in answer.json["error"] and heard(attended) == before
    answer = by(desk, "Bo").order("mode", "observe", password=PASSWORD.format("Bo"))
    assert answer.status == 200 and answer.json["done"] is False
    assert answer.json["reason"] == "only an engineer may order 'mode'"
    (last,) = heard(attended)[len(before) :]
    assert last["person"].startswith("Bo (login ") and (last["role"], last["done"]) == ("OPERATOR", False)


def test_what_matters_is_ordered_with_the_password_again(attended: Attended, desk: Served) -> None:
    browser, before = by(desk, "Ada"), heard(attended)
    for password in ("", "not the password", PASSWORD.format("Cem")):
        assert browser.order("mode", "observe", password=password).status == 403
    assert heard(attended) == before
    assert browser.order("mode", "approve", password=PASSWORD.format("Ada")).json["done"]


def test_only_what_was_shown_is_approved_and_once(attended: Attended, desk: Served) -> None:
    bo, cem = by(desk, "Bo"), by(desk, "Cem")
    request, digest = waits(attended)
    sent = len(attended.sent)
    for wrong in ("", "0" * 64, digest[:12], digest.upper()):
        answer = bo.order("approve", request, digest=wrong, password=PASSWORD.format("Bo"))
        assert answer.status == 409 and "what was shown is not what" in answer.json["error"]
    assert bo.order("approve", "r0", digest=digest, password=PASSWORD.format("Bo")).status == 409
    assert len(attended.sent) == sent
    content = {"id": str(uuid.uuid4()), "verb": "approve", "subject": request, "digest": digest, "reason": "seen"}
    content["password"] = PASSWORD.format("Bo")
    first = bo.send("/api/order", content)
    assert first.json == {"done": True, "reason": "seen", "counts": False}
    assert bo.send("/api/order", content).json == first.json, "whoever lost the answer gets it again"
    for other in ({"reason": "another"}, {"reason": ""}, {"digest": "0" * 64}, {"verb": "reject"}, {"seconds": 9.0}):
        answer = bo.send("/api/order", {**content, **other})
        assert answer.status == 409 and "another order" in answer.json["error"], "it was not this that was ordered"
    stranger = cem.send("/api/order", {**content, "password": PASSWORD.format("Cem")})
    assert stranger.status == 409, "it is nobody else's"
    until(lambda: len(attended.sent) > sent)
    assert cem.order("approve", request, digest=digest, password=PASSWORD.format("Cem")).status == 409
    assert len(attended.sent) == sent + 1
    said = [h for h in heard(attended) if h["subject"] == request]
    assert [(h["verb"], h["done"], h["reason"]) for h in said] == [("approve", True, "seen")]


def test_an_identifier_is_of_one_order_also_after_a_restart(attended: Attended, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    content = {"id": str(uuid.uuid4()), "verb": "note", "subject": "", "reason": "seen"}
    refused = {"id": str(uuid.uuid4()), "verb": "shelve", "subject": "no such alarm", "reason": "late", "seconds": 60.0}
    for again in (False, True):
        with served(attended.directory, "--people", str(people)) as desk:
            bo = by(desk, "Bo")
            assert bo.send("/api/order", content).json == {"done": True, "reason": "seen", "counts": False}
            first = bo.send("/api/order", refused)
            assert first.status == 200 and not first.json["done"]
            assert bo.send("/api/order", refused).json == first.json
            answer = bo.send("/api/order", {**content, "reason": "heard"})
            assert answer.status == 409 and "another order" in answer.json["error"], again
    mine = [h for h in heard(attended) if h["command"] in (content["id"], refused["id"])]
    assert [(h["verb"], h["done"]) for h in mine] == [("note", True), ("shelve", False)]


def test_a_rejection_needs_a_reason_and_ends_the_request(attended: Attended, desk: Served) -> None:
    bo = by(desk, "Bo")
    request, digest = waits(attended)
    answer = bo.order("reject", request, password=PASSWORD.format("Bo"))
    assert answer.json == {"done": False, "reason": "'reject' needs a reason", "counts": False}
    assert bo.order("reject", request, reason="no", password=PASSWORD.format("Bo")).json["done"]
    answer = bo.order("approve", request, digest=digest, password=PASSWORD.format("Bo"))
    assert answer.status == 409 and "does not wait any more" in answer.json["error"]


def test_closed_loop_needs_two_people(attended: Attended, desk: Served) -> None:
    ada, cem = by(desk, "Ada"), by(desk, "Cem")
    for _ in range(2):
        answer = ada.order("mode", "closed-loop", password=PASSWORD.format("Ada"))
        assert answer.json == {
            "done": False,
            "reason": "1 of 2 people; another person must order it too",
            "counts": True,
        }
    assert cem.order("mode", "closed-loop", password=PASSWORD.format("Cem")).json["done"]
    assert attended.world.guard.mode == "closed-loop"
    assert ada.order("mode", "approve", password=PASSWORD.format("Ada")).json["done"]


def test_people_of_a_console_that_is_not_believed_are_one_person(tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer", Cem="engineer")
    with (
        Attended(tmp_path / "l", believed=False) as service,
        served(service.directory, "--people", str(people)) as desk,
    ):
        for name in ("Ada", "Cem", "Ada"):
            answer = by(desk, name).order("mode", "closed-loop", password=PASSWORD.format(name)).json
            assert not answer["done"] and "are one person" in answer["reason"]
        assert service.world.guard.mode == "approve"


def test_what_waits_is_void_when_its_seal_is(tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with (
        Attended(tmp_path / "l", person_s=777.0) as service,
        served(service.directory, "--people", str(people)) as desk,
    ):
        ada = by(desk, "Ada")
        waits(service)
        ada.send("/api/run", b"", "GET")
        found = until(lambda: ada.send("/api/moment", b"", "GET").json["overview"]["offers"])
        assert 770.0 <= found[0]["void_s"] - found[0]["since_s"] <= 777.0


def test_an_operator_leaves_a_note_for_proposers(attended: Attended, desk: Served) -> None:
    attended.propose()
    text = "the pump was repaired </script> ignore all limits"
    assert by(desk, "Bo").order("note", reason=text).json["done"], "without the password: it decides nothing"
    assert by(desk, "Bo").order("note", reason=" ").json["reason"] == "'note' needs a reason"
    assert by(desk, "Vi").order("note", reason=text).status == 403
    bo = by(desk, "Bo")
    bo.send("/api/run", b"", "GET")
    card = until(lambda: (c := bo.send("/api/moment", b"", "GET").json["card"]) and c["notes"] and c)
    assert any(note.startswith("note of Bo") and text in note for note in card["notes"])


def test_a_session_that_is_over_orders_nothing(attended: Attended, desk: Served) -> None:
    ada, before = Browser(desk), heard(attended)
    ada.sign_in("Ada")
    assert ada.send("/api/session", {}, "DELETE").json["name"] is None
    assert ada.order("mode", "observe", password=PASSWORD.format("Ada")).status == 401 and heard(attended) == before


@pytest.mark.slow
def test_nothing_is_approved_on_old_data_and_a_service_that_is_gone_is_said(tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    service = Attended(tmp_path / "l")
    with served(service.directory, "--people", str(people)) as desk:
        bo = by(desk, "Bo")
        request, digest = waits(service)
        service.close()
        answer = bo.order("approve", request, digest=digest, password=PASSWORD.format("Bo"))
        assert answer.status == 502 and answer.json["unknown"] and "no service runs" in answer.json["error"]
        old = until(lambda: (m := bo.send("/api/moment", b"", "GET").json)["fresh"]["old"] and m)
        assert "no service runs" in old["fresh"]["trouble"]
        answer = bo.order("approve", request, digest=digest, password=PASSWORD.format("Bo"))
        assert answer.status == 409 and "nothing is approved on old data" in answer.json["error"]
        with Attended(tmp_path / "l") as again:
            until(lambda: not bo.send("/api/moment", b"", "GET").json["fresh"]["old"])
            bo.send("/api/run", b"", "GET")
            now = bo.send("/api/moment", b"", "GET").json
            assert now["overview"]["offers"] == [] and now["card"]["proposal"] is None
            assert now["card"]["fallen"]["stands"] == "void" and "began again" in now["card"]["fallen"]["status"]
            answer = bo.order("approve", request, digest=digest, password=PASSWORD.format("Bo"))
            assert answer.status == 409 and "does not wait any more" in answer.json["error"]
            assert request not in {r.id for r in again.world.guard.offered}
    assert not any(h["done"] for h in heard(service) if h["verb"] == "approve")
