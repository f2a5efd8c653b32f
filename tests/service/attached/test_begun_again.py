"""The process that was started is killed, and with it everything: what begins anew, and what must not.

Whoever starts services begins it again; what is left of the one before may still be there then.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.service.thinking.consulted import Consulted
from tests.cli.command import environment
from tests.equipment.opcua.attached import Attached, Reactor, until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

SCALE = 5.0


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reactor]:
    with Reactor(tmp_path_factory.mktemp("served"), SCALE) as reactor:
        yield reactor


@pytest.fixture
def reactor(served: Reactor) -> Reactor:
    """The reactor at its start, which behaves as it should."""
    for order in ("behave", "repair", "begin"):
        served.ask(order)
    return served


@pytest.fixture
def live(tmp_path: Path) -> Path:
    return tmp_path / "live"


def sampled(now: dict[str, Any]) -> bool:
    return now["now_s"] is not None and not now["link"]["trouble"]


def another(than: int) -> Callable[[dict[str, Any]], bool]:
    return lambda now: sampled(now) and now["guard_process"] != than


def is_gone(process: int) -> bool:
    """Whether ``process`` has ended, also where nobody has asked how yet."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def left(live: Path) -> list[str]:
    """Processes of the service in ``live``, as they were started."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:  # it has ended
            continue
        if os.fsencode(live) in words and int(process.name) != os.getpid():
            found.append(b" ".join(words).decode())
    return found


def killed(attached: Attached) -> None:
    """The first process, by a kill that leaves it no time."""
    os.kill(attached.process.pid, signal.SIGKILL)
    attached.process.wait(30.0)


def child_of(attached: Attached) -> int:
    """The guard's process as soon as there is one, also where it does not answer yet."""
    children = Path(f"/proc/{attached.process.pid}/task/{attached.process.pid}/children")

    def forked() -> int | None:
        for child in children.read_text().split():
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            if b"attach" in words:
                return int(child)
        return None

    return int(until(forked, "the guard's process"))


def test_after_a_kill_of_the_first_the_latch_stands_and_nobody_commands(reactor: Reactor, live: Path) -> None:
    first = Attached(reactor, live)
    first.waits_for(sampled, "samples")
    assert first.order("mode", "closed-loop", "--reason", "test")[0] == 0
    assert first.order("fall-back", "--reason", "smoke")[0] == 0
    guard = first.waits_for(lambda now: now["latched"], "the latch")["guard_process"]
    time.sleep(2.0)
    written = reactor.commands
    killed(first)
    with Attached(reactor, live) as second:
        now = second.waits_for(another(guard), "another guard")
        assert is_gone(guard) and now["latched"] and now["mode"]["actual"] == "observe"
        assert second.order("reset", "--reason", "no smoke")[0] == 0
        assert second.interrupt() == 0
    assert reactor.commands == written, "what had been written was not written again"
    report = verify(live)
    assert report.complete and report.contradictions == ()


def test_a_guard_that_does_not_notice_keeps_its_directory_until_it_has_left(reactor: Reactor, live: Path) -> None:
    first = Attached(reactor, live)
    guard = first.waits_for(sampled, "samples")["guard_process"]
    os.kill(guard, signal.SIGSTOP)  # it is there, has the journal, and can look at nothing
    try:
        killed(first)
        second = Attached(reactor, live)
        assert second.process.wait(60.0) == 2
        assert "is attached already" in second.errors.read_text()
        assert not [e for e in read_events(live) if e.kind == "resumed"], "nobody else wrote meanwhile"
        third = Attached(reactor, live)
    finally:
        os.kill(guard, signal.SIGCONT)
    with third:
        third.waits_for(another(guard), "another guard")
        assert is_gone(guard) and third.interrupt() == 0
    kinds = [e.kind for e in read_events(live)]
    assert kinds.count("resumed") == 1 and verify(live).complete


def test_a_guard_that_had_not_begun_leaves_at_once(reactor: Reactor, live: Path) -> None:
    """It waits for a plant that does not answer, and for nobody that it would have to tell of its end."""
    reactor.freeze(True)
    try:
        first = Attached(reactor, live)
        guard = child_of(first)
        until((live / "events.jsonl").exists, "a journal")
        killed(first)
        until(lambda: is_gone(guard), "its end", 10.0)
        assert next(e.kind for e in read_events(live)) == "run-started"
    finally:
        reactor.freeze(False)
    with Attached(reactor, live) as second:
        second.waits_for(another(guard), "another guard")
        assert second.interrupt() == 0
    assert verify(live).complete


def test_a_journal_that_was_altered_ends_it_although_the_plant_is_connected(reactor: Reactor, live: Path) -> None:
    first = Attached(reactor, live)
    guard = first.waits_for(sampled, "samples")["guard_process"]
    killed(first)
    until(lambda: is_gone(guard), "the guard's end")
    journal = live / "events.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(whole.replace(b'"seq":2', b'"seq":3', 1))
    second = Attached(reactor, live)
    assert second.process.wait(60.0) == 2 and "line 2 carries number 3" in second.errors.read_text()
    assert reactor.commands == [] and journal.read_bytes() == whole.replace(b'"seq":2', b'"seq":3', 1)
    journal.write_bytes(whole)
    with Attached(reactor, live) as third:
        third.waits_for(sampled, "samples")
        assert third.interrupt() == 0
    assert verify(live).complete


@pytest.mark.parametrize("module", ["thinking", "historian"])
def test_who_was_alone_before_it_had_loaded_anything_leaves_all_the_same(live: Path, module: str) -> None:
    """Else it takes the folder of the history, or the guard's ear, from those who are begun after it."""
    live.mkdir()
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait(60.0)
    given, after = (("cstr", "1.0"), (Consulted().to_text(),)) if module == "thinking" else ((f"{live}.history",), ())
    command = [sys.executable, "-m", f"homeostat.service.{module}", str(live), *given, "1", str(dead.pid), *after]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, env=environment(), timeout=120.0)
    assert done.returncode == 0


def test_nobody_is_left_of_a_service_that_dies_while_it_begins(reactor: Reactor, live: Path) -> None:
    """Thinking and historian were started a moment ago, and have loaded nothing yet."""
    attached = Attached(reactor, live)
    until(lambda: any("homeostat.service.thinking" in line for line in left(live)), "thinking")
    killed(attached)
    until(lambda: not left(live), f"the end of {left(live)}", 120.0)


@pytest.mark.wide
def test_kills_in_a_row_lose_nothing_that_was_recorded(reactor: Reactor, live: Path) -> None:
    """At moments from the first instruction on: while it loads, reads, connects, and guards."""
    before = b""
    for wait_s in (0.3, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0):
        attached = Attached(reactor, live)
        time.sleep(wait_s)
        killed(attached)
        journal = live / "events.jsonl"
        after = journal.read_bytes() if journal.exists() else b""
        assert after.startswith(before[: before.rfind(b"\n") + 1])
        before = after
    until(lambda: not left(live), f"the end of {left(live)}", 120.0)
    with Attached(reactor, live) as last:
        last.waits_for(sampled, "samples")
        assert last.status["mode"]["actual"] == "observe" and last.interrupt() == 0
    assert verify(live).complete and reactor.commands == []
