"""The console's server: what it answers, and to whom."""

from __future__ import annotations

import shutil
import socket
from pathlib import Path

import pytest

from homeostat.journal import read_events
from tests.cli.command import homeostat, refused
from tests.console.served import Served, served


def test_the_page_runs_nothing_but_its_own_script(console: Served) -> None:
    for path, kind in {"/": "text/html", "/console.js": "text/javascript", "/console.css": "text/css"}.items():
        answer = console.ask(path)
        assert answer.status == 200 and answer.headers["content-type"].startswith(kind) and answer.body
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy and "script-src 'self'" in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in answer.headers


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "evil.example:8737", "", "[::1]"])
def test_a_page_whose_name_leads_to_this_machine_is_refused(console: Served, host: str) -> None:
    for path in ("/", "/api/run", "/api/stream"):
        assert console.ask(path, Host=host).status == 400


@pytest.mark.parametrize(
    "path",
    [
        "/../pyproject.toml",
        "/..%2f..%2fetc/passwd",
        "/%2e%2e/%2e%2e/app.py",
        "/console.js/../../app.py",
        "//etc/passwd",
        "/events.jsonl",
        "/api/../app.py",
        "/console.js%00.html",
    ],
)
def test_no_name_in_a_request_leads_to_a_file(console: Served, path: str) -> None:
    assert console.ask(path).status == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_nothing_can_be_ordered(console: Served, method: str) -> None:
    paths, own = ("/", "/api/run", "/api/moment", "/api/stream"), {"Origin": console.address.rstrip("/")}
    assert all(console.ask(path, method).status == 403 for path in paths), "not from the page"
    sent = own | {"Content-Type": "application/json"}
    assert all(console.ask(path, method, b"{}", **sent).status == 405 for path in paths)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("/api/moment?at=soon", "at is 'soon'; it must be a finite number"),
        ("/api/moment?at=nan", "at is 'nan'; it must be a finite number"),
        ("/api/moment?at=1e999", "at is '1e999'; it must be a finite number"),
        ("/api/stream?speed=0", "speed is 0; it must be from 0.1 to 10000"),
        ("/api/stream?speed=1e9", "speed is 1e+09; it must be from 0.1 to 10000"),
        ("/api/trend?tag=T1&width=1e9", "width is 1e+09 px; it must be from 1 to 4000 px"),
        ("/api/trend?tag=true%20T1", "no tag 'true T1' was measured in this run"),
        ("/api/trend", "no tag is named; give tag=NAME"),
        ("/api/feature?name=../x", "no feature '../x' can be drawn for this run"),
    ],
)
def test_what_cannot_be_answered_is_told_in_one_line(console: Served, path: str, words: str) -> None:
    answer = console.ask(path)
    assert (answer.status, answer.json) == (400, {"error": words})


def test_nobody_is_told_what_was_truly_wrong(console: Served) -> None:
    told = console.ask("/api/run")
    assert not {line["label"] for line in told.json["lines"]} & {"onset", "run"}
    assert b"ground truth" not in told.body and b"true " not in told.body
    before = console.ask("/api/moment?at=899")
    assert before.json["card"] is None and b"cool_stuck_closed" not in before.body


def test_a_stream_plays_at_its_speed_and_ends_with_the_run(console: Served) -> None:
    last_s = console.ask("/api/run").json["last_s"]
    events = console.moments("/api/stream?at=0&speed=10000", 100)
    times = [float(event["id"]) for event in events[:-1]]
    assert times[0] < 1000.0 and times == sorted(times) and times[-1] == last_s
    assert events[-1] == {"event": "end", "data": "{}"}


def test_a_stream_goes_on_where_the_connection_was_lost(console: Served) -> None:
    (event,) = console.moments("/api/stream?at=0&speed=1", 1, **{"Last-Event-ID": "700.0"})
    assert event["id"].startswith("700.")


def test_a_port_that_is_taken_is_told_in_one_line(recovered_run: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        done = homeostat("console", str(recovered_run), "--no-browser", "--port", port, cwd=recovered_run.parent)
    refused(done, f"port {port} cannot be listened on", "--port")


def test_what_is_no_run_is_told_in_one_line(tmp_path: Path) -> None:
    refused(homeostat("console", ".", "--no-browser", cwd=tmp_path), "is not a run directory")
    (tmp_path / "events.jsonl").write_bytes(b"")
    refused(homeostat("console", ".", "--no-browser", cwd=tmp_path), "does not begin with the run's beginning")
    (tmp_path / "events.jsonl").write_bytes(b"{}\n")
    refused(homeostat("console", ".", "--no-browser", cwd=tmp_path), "cannot be shown: line 1")


def test_watchers_change_nothing(recovered_run: Path, console: Served) -> None:
    before = {path: path.stat().st_mtime_ns for path in recovered_run.rglob("*")}
    console.ask("/api/run")
    console.moments("/api/stream?at=900&speed=100", 3)
    assert {path: path.stat().st_mtime_ns for path in recovered_run.rglob("*")} == before


def test_a_run_that_was_killed_is_shown_as_far_as_it_came(recovered_run: Path, tmp_path: Path) -> None:
    lines = (recovered_run / "events.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "events.jsonl").write_bytes(b"".join(lines[:30]) + lines[30][:40])
    last = list(read_events(tmp_path))[-1]
    with served(tmp_path) as server:
        told = server.ask("/api/run").json
        assert (told["closed"], told["live"], told["measured"]) == (False, False, False)
        assert told["last_s"] == last.at_s and "did not come to its end" in told["notice"]
        assert server.ask(f"/api/moment?at={last.at_s}").status == 200
        assert server.ask("/api/trend?tag=T1").json == {
            "error": "the run has no readings; they are kept when a run ends"
        }
        (event,) = server.moments(f"/api/stream?at={last.at_s}&speed=1", 1)
        assert float(event["id"]) == last.at_s


def test_the_name_of_a_directory_gives_nothing_away(recovered_run: Path, tmp_path: Path) -> None:
    named = tmp_path / "cool_stuck_closed-is-true"
    shutil.copytree(recovered_run, named)
    with served(named) as server:
        asked = ["/", "/api/run", *(f"/api/moment?at={at_s}" for at_s in (100, 905, 1050))]
        assert all(b"is-true" not in server.ask(path).body for path in asked)
