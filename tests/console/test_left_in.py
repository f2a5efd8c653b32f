"""Who was let in once: a stream that goes on for hours ends with the session that it was begun in."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.console.people.accounts import Access, Person
from homeostat.console.people.changes import removed
from homeostat.console.people.sessions import IDLE_S, Sessions
from tests.console.served import Browser, Served, accounts, served
from tests.equipment.attended import Attended


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return accounts(tmp_path_factory.mktemp("people") / "people.json", Ada="engineer", Bo="viewer", Cy="viewer")


@pytest.fixture(scope="module")
def desk(people: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with (
        Attended(tmp_path_factory.mktemp("live") / "l") as service,
        served(service.directory, "--people", str(people)) as server,
    ):
        yield server


@contextlib.contextmanager
def following(browser: Browser) -> Iterator[HTTPResponse]:
    """The stream that ``browser`` follows."""
    with contextlib.closing(HTTPConnection("127.0.0.1", browser.server.port, timeout=20)) as connection:
        connection.request("GET", "/api/stream?at=1e12", headers={"Cookie": browser.cookie})
        response = connection.getresponse()
        assert response.status == 200 and response.readline().startswith(b"id: ")
        yield response


def ends(response: HTTPResponse, within_s: float = 15.0) -> bool:
    """Whether the stream comes to its end."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        if not response.readline():
            return True
    return False


@pytest.mark.slow
def test_a_stream_ends_where_its_person_signs_out_or_is_removed(desk: Served, people: Path) -> None:
    ada, bo, cy = Browser(desk), Browser(desk), Browser(desk)
    assert [b.sign_in(name).status for b, name in ((ada, "Ada"), (bo, "Bo"), (cy, "Cy"))] == [200] * 3
    with following(ada) as hers, following(bo) as his, following(cy) as theirs:
        assert bo.send("/api/session", {}, "DELETE").status == 200
        removed(people, "Cy")
        assert ends(his) and ends(theirs)
        assert not ends(hers, 3.0), "nobody else's does"


def test_who_only_looks_whether_a_session_lasts_does_not_use_it() -> None:
    now = [1000.0]
    sessions = Sessions(lambda: now[0])
    token, _ = sessions.begin(Person(name="Ada", access=Access.VIEWER))
    now[0] += IDLE_S - 1.0
    assert sessions.of(token, use=False) is not None
    now[0] += 2.0
    assert sessions.of(token, use=False) is None
