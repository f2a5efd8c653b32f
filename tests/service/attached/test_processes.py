"""The served reactor attached, with real processes: what is written, what is kept, and what comes back."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from tests.cli.command import homeostat, refused
from tests.equipment.opcua.attached import Attached, Reactor

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

SCALE = 5.0


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reactor]:
    with Reactor(tmp_path_factory.mktemp("served"), SCALE) as reactor:
        yield reactor


@pytest.fixture
def reactor(served: Reactor) -> Reactor:
    """The reactor at its start, which behaves as it should."""
    served.ask("behave")
    served.ask("repair")
    served.ask("begin")
    return served


@pytest.fixture
def live(tmp_path: Path) -> Path:
    return tmp_path / "live"


def thinks(now: dict) -> bool:  # type: ignore[type-arg]
    return now["thinking"]["process"] is not None and now["now_s"] is not None


def test_it_observes_writes_nothing_and_stops_without_moving_the_plant(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        now = attached.waits_for(thinks, "thinking")
        assert now["mode"]["actual"] == now["mode"]["requested"] == "observe" and now["link"]["trouble"] == ""
        maps = Path(f"/proc/{now['guard_process']}/maps").read_text()
        assert "llvmlite" not in maps, "the guard's process loads no compiler"
        second = ("attach", "cstr", "--link", str(reactor.mapping), "--dir", str(live))
        done = homeostat(*second, "--pki", str(reactor.pkis[1].folder), cwd=live.parent)
        assert done.status == 2 and "is attached already" in done.err.splitlines()[-1]
        refused(
            homeostat("attach", "cstr", "--link", str(reactor.mapping), "--dir", str(live), "--pki",
                      str(reactor.pkis[1].folder), "--history", str(live / "h"), cwd=live.parent),
            "is inside --dir",
        )  # fmt: skip
        shown = homeostat("status", str(live), cwd=live.parent)
        assert shown.status == 0 and "observe; nobody has asked for another one" in shown.out
        assert attached.order("mode", "approve", "--role", "operator")[0] == 3
        assert attached.order("in-service", "T1.sp", "--out", "--reason", "repair")[0] == 0
        assert attached.status["out_of_service"] == ["T1.sp"]
        assert attached.interrupt() == 0
    assert reactor.commands == []
    shown = homeostat("history", "show", "T1", "--store", f"{live}.history", cwd=live.parent)
    assert shown.status == 0 and "good" in shown.out
    report = verify(live)
    assert report.complete and report.contradictions == ()
    refused(homeostat("status", str(live), cwd=live.parent), "no service runs")
    with Attached(reactor, live) as again:
        now = again.waits_for(lambda now: now["now_s"] is not None, "a second life")
        assert now["out_of_service"] == ["T1.sp"]
    assert verify(live).complete and homeostat("replay", str(live), cwd=live.parent).status == 0


def test_thinking_that_is_killed_is_started_again_and_the_guard_keeps_its_second(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        first = attached.waits_for(thinks, "thinking")["thinking"]["process"]
        os.kill(first, signal.SIGKILL)
        attached.waits_for(lambda now: now["thinking"]["process"] is None, "its end")
        now = attached.waits_for(thinks, "thinking again")
        assert now["thinking"]["process"] != first and now["thinking"]["begun"] == 2
        # A busy host may keep one sample back; a guard that waits for thinking misses one a second until it is there.
        assert now["link"]["missed"] <= 1 and now["ticks"]["longest_s"] < 2.0
    kinds = [e.kind for e in read_events(live) if e.kind.startswith("thinking")]
    assert kinds.count("thinking-began") == 2 and kinds.count("thinking-ended") >= 1
    assert verify(live).complete


@pytest.mark.wide
def test_thinking_that_gets_no_time_is_ended_and_started_again(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        frozen = attached.waits_for(thinks, "thinking")["thinking"]["process"]
        os.kill(frozen, signal.SIGSTOP)
        attached.waits_for(lambda now: now["thinking"]["process"] not in (None, frozen), "thinking after a starved one")
        assert attached.status["ticks"]["longest_s"] < 2.0
    assert [e.kind for e in read_events(live)].count("thinking-began") == 2
    assert verify(live).complete


def test_a_guard_that_is_killed_observes_within_seconds_and_keeps_its_latch(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        attached.waits_for(lambda now: now["now_s"] is not None and not now["link"]["trouble"], "samples")
        assert attached.order("mode", "closed-loop", "--reason", "test") == (0, "mode closed-loop: done\n")
        assert attached.order("fall-back", "--reason", "smoke")[0] == 0
        now = attached.waits_for(lambda now: now["latched"], "the latch")
        time.sleep(2.0)
        written, killed = reactor.commands, now["guard_process"]
        os.kill(killed, signal.SIGKILL)
        begin = time.monotonic()
        now = attached.waits_for(lambda now: now["guard_process"] != killed and now["now_s"], "another guard", 30.0)
        took_s = time.monotonic() - begin
        assert now["latched"] and now["mode"]["actual"] == "observe" and now["mode"]["requested"] == "closed-loop"
        assert now["mode"]["why"] == "the guard began again" and took_s < 5.0
        status, said = attached.order("mode", "closed-loop")
        assert status == 3 and "latched" in said
        assert attached.order("reset", "--reason", "no smoke")[0] == 0
        assert attached.order("mode", "advise")[0] == 0
        assert reactor.commands == written, "what had been written was not written again"
    assert verify(live).complete


def test_a_lost_connection_leaves_the_mode_at_observe(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        attached.waits_for(lambda now: now["now_s"] is not None and not now["link"]["trouble"], "samples")
        assert attached.order("mode", "closed-loop", "--reason", "test")[0] == 0
        reactor.freeze(True)
        try:
            now = attached.waits_for(lambda now: now["link"]["trouble"], "the loss")
        finally:
            reactor.freeze(False)
        now = attached.waits_for(lambda now: not now["link"]["trouble"] and now["mode"]["actual"] == "observe", "data")
        assert now["mode"]["requested"] == "closed-loop" and "the connection was lost" in now["mode"]["why"]
        attached.waits_for(lambda now: not now["readings"], "good readings")
        assert attached.status["mode"]["actual"] == "observe"
        assert attached.interrupt() == 0


@pytest.mark.wide
def test_in_advise_what_would_be_released_is_shown_and_nothing_reaches_the_plant(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        attached.waits_for(thinks, "thinking")
        assert attached.order("mode", "advise")[0] == 0
        attached.waits_for(lambda now: now["state"] == "normal", "normal operation")
        reactor.ask("fault pump_degrade")
        attached.waits_for(lambda now: any(e.kind == "diagnosed" for e in read_events(live)), "a diagnosis")
        time.sleep(10.0)
    assert reactor.commands == [] and verify(live).complete


@pytest.mark.wide
def test_in_closed_loop_a_fault_is_recovered_from_over_the_wire(reactor: Reactor, live: Path) -> None:
    with Attached(reactor, live) as attached:
        attached.waits_for(thinks, "thinking")
        assert attached.order("mode", "closed-loop", "--reason", "test")[0] == 0
        attached.waits_for(lambda now: now["state"] == "normal", "normal operation", 300.0)
        before = len(reactor.commands)
        reactor.ask("fault cool_stuck_open")
        attached.waits_for(lambda now: any(e.kind == "released" for e in read_events(live)), "a release", 300.0)
        (written,) = reactor.commands[before:]
        assert {tag for tag, _, _ in written} >= {"T1.sp", "V2.man"}
        now = attached.status
        assert now["latched"] is None and now["mode"]["actual"] == "closed-loop" and now["state"] == "reduced_load"
        assert attached.interrupt() == 0
        assert reactor.commands[before:] == [written], "stopping has written nothing"
    report = verify(live)
    assert report.complete and report.contradictions == ()
