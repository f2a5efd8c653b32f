"""A simulated run is paused and let go on at its page: by button and key, by nobody else's page, and never for ever."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.journal import RunFinished, read_events
from homeostat.journal.beside.files import MANIFEST
from tests.cli.command import COMMAND, LIMIT_S, environment
from tests.console.served import Browser, Served, accounts
from tests.console.test_live import waited_for
from tests.equipment.attended import Attended


@dataclass(frozen=True, eq=False)
class Live(Served):
    """The page of a run that goes on."""

    folder: Path = Path()

    @property
    def told(self) -> str:
        return (self.folder / "said").read_text()

    def pace(self) -> Any:
        return self.ask("/api/pace").json

    def change(self, **to: Any) -> Any:
        return Browser(self).send("/api/pace", to)

    def interrupt(self) -> int:
        os.kill(self.process.pid, signal.SIGINT)
        return self.process.wait(LIMIT_S)


@contextlib.contextmanager
def live(folder: Path, *options: str) -> Iterator[Live]:
    folder.mkdir(exist_ok=True)
    arguments = ["run", "cstr", "--console", "--thinking-declared", "1", "--out", "run", *options]
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen(
            [*COMMAND, *arguments], cwd=folder, env=environment(), stdout=subprocess.DEVNULL, stderr=said, text=True
        )
        try:
            port = int(waited_for(folder / "said", r"shown at http://127\.0\.0\.1:(\d+)/"))
            server = Live(port, process, folder)
            until(lambda: server.ask("/api/run").json.get("last_s", 1.0) > 0.0)
            yield server
        finally:
            process.kill()
            process.wait(LIMIT_S)


def until(so: Any) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not so():
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    with live(tmp_path_factory.mktemp("paced") / "l", "--end", "20000", "--pace", "5") as server:
        yield server


@pytest.mark.slow
def test_a_pause_lasts_and_is_told_to_everybody_who_looks(running: Live) -> None:
    assert running.pace() == {"speed": 5.0, "paused": False, "stands": False}
    assert running.change(paused=True, speed=300).status == 200
    until(lambda: running.pace()["stands"])
    stands_s = running.ask("/api/run").json["last_s"]
    *_, last = running.moments(f"/api/stream?at={stands_s}&speed=1000", 4)
    assert '"pace":{"speed":300.0,"paused":true,"stands":true}' in last["data"].replace(" ", "")
    assert running.ask("/api/run").json["last_s"] == stands_s
    assert running.change(paused=False).json == {"speed": 300.0, "paused": False, "stands": False}
    until(lambda: running.ask("/api/run").json["last_s"] > stands_s + 60.0)
    running.change(speed=5)


@pytest.mark.parametrize(
    ("content", "headers", "status"),
    [
        (b'{"paused": true}', {"Origin": "http://elsewhere.example"}, 403),
        (b'{"paused": true}', {"Origin": ""}, 403),
        (b'{"paused": true}', {"Content_Type": "text/plain"}, 415),
        (b'{"paused": "yes"}', {}, 400),
        (b'{"paused": 1}', {}, 400),
        (b'{"speed": NaN}', {}, 400),
        (b'{"speed": Infinity}', {}, 400),
        (b'{"speed": -1}', {}, 400),
        (b'{"speed": 1e300}', {}, 400),
        (b'{"speed": "10"}', {}, 400),
        (b'{"speed": true}', {}, 400),
        (b'{"pause": true}', {}, 400),
        (b"[true]", {}, 400),
        (b"{" * 20_000, {}, 400),
    ],
)
def test_nothing_else_changes_the_pace(running: Live, content: bytes, headers: dict[str, str], status: int) -> None:
    before = running.pace()
    answer = Browser(running).send("/api/pace", content, **headers)
    assert answer.status == status and "\n" not in answer.json["error"] and running.pace() == before


@pytest.mark.slow
def test_button_key_and_speeds(page: Any, running: Live) -> None:
    page.goto(running.address)
    nav = page.get_by_role("navigation", name="Pace of the run")
    nav.get_by_text("The run goes on at 5 ×.").wait_for()
    nav.get_by_role("button", name="Pause the run").click()
    nav.get_by_text("The run is paused at").wait_for()
    assert running.pace()["stands"]
    nav.get_by_label("Speed of the run").select_option("60")
    until(lambda: running.pace()["speed"] == 60.0)
    page.get_by_role("button", name="● Live").click()  # an earlier moment: no stream says how the run stands
    page.keyboard.press("p")
    nav.get_by_text("The run goes on at 60 ×.").wait_for()
    running.change(paused=True)
    nav.get_by_text("The run is paused at").wait_for()
    page.keyboard.press("p")
    until(lambda: not running.pace()["paused"])
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()


@pytest.mark.slow
def test_who_only_looks_changes_no_pace_and_no_order_is_lost_in_a_pause(tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Vi="viewer", Op="operator")
    with live(tmp_path / "l", "--end", "20000", "--people", str(people)) as server:
        viewer, operator = Browser(server), Browser(server)
        assert viewer.send("/api/pace", {"paused": True}).status in (401, 403)
        viewer.sign_in("Vi")
        operator.sign_in("Op")
        assert viewer.send("/api/pace", {"paused": True}).status == 403
        assert operator.send("/api/pace", {"paused": True}, X_Homeostat_Token="forged").status == 403
        assert operator.send("/api/pace", {"paused": True}).json["paused"]
        until(lambda: operator.send("/api/pace", {}).json["stands"])
        answer = operator.order("note", "", reason="looks odd")
        assert answer.status == 409 and "paused" in answer.json["error"]
        operator.send("/api/pace", {"paused": False, "speed": 0.1})
        answer = operator.order("note", "", reason="looks odd")
        assert answer.status == 200, "ticks are 10 s apart, and the guard hears an order at the second one"
        operator.send("/api/pace", {"paused": True})
        until(lambda: operator.send("/api/pace", {}).json["stands"])
        assert "homeostat: the run is paused at its page" in server.told
        assert server.interrupt() != 0
        assert "Traceback" not in server.told and (server.folder / "run" / MANIFEST).is_file()
        ended = [e.fields["outcome"] for e in read_events(server.folder / "run") if e.kind == RunFinished.kind]
        assert ended == ["interrupted"]


@pytest.mark.slow
def test_a_run_that_is_over_has_no_pace_any_more(tmp_path: Path) -> None:
    with live(tmp_path / "l", "--end", "60", "--pace", "1000") as server:
        until(lambda: server.pace() is None)
        answer = server.change(paused=True)
        assert answer.status == 409 and answer.json["error"] == "the run is over, and has no pace any more"
        until(lambda: "stays until Ctrl-C" in server.told)
        assert server.interrupt() == 0


def test_a_real_plant_and_a_recorded_run_have_no_pace(tmp_path: Path, console: Served) -> None:
    from tests.console.served import served

    answer = Browser(console).send("/api/pace", {"paused": True})
    assert answer.status == 409 and "goes on with this page" in answer.json["error"]
    assert console.ask("/api/pace").json is None and console.ask("/api/moment?at=10").json["pace"] is None
    people = accounts(tmp_path / "people.json", Op="operator")
    with Attended(tmp_path / "l") as service, served(service.directory, "--people", str(people)) as server:
        operator = Browser(server)
        operator.sign_in("Op")
        answer = operator.send("/api/pace", {"paused": True})
        assert answer.status == 409 and "attached" in answer.json["error"] and "\n" not in answer.json["error"]
