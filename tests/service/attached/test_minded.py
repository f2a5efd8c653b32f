"""Processes are started again when they die or say nothing, at once the first time, and then after longer waits."""

from __future__ import annotations

import os
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import replace

from homeostat.service.keeping.child import Child
from homeostat.service.keeping.minded import Minded, Patience

QUICK = Patience(start_s=5.0, quiet_s=0.5, again_s=0.2, most_s=0.4, lasts_s=60.0)


def speaks(pulse: int) -> int:
    while True:
        os.write(pulse, b".")
        time.sleep(0.02)


def speaks_once(pulse: int) -> int:
    os.write(pulse, b".")
    time.sleep(60.0)
    return 0


def looked(minded: Minded, until: Callable[[], object], within_s: float = 20.0) -> None:
    end = time.monotonic() + within_s
    while not until():
        assert time.monotonic() < end, "it did not come to that"
        minded.look()
        time.sleep(0.01)


def pid_of(minded: Minded) -> int | None:
    return None if minded.child is None else minded.child.pid


def test_a_process_that_is_killed_is_started_again_at_once() -> None:
    told: list[str] = []
    minded = Minded("it", speaks, replace(QUICK, quiet_s=60.0, again_s=600.0, most_s=600.0), told.append)
    looked(minded, lambda: minded.child is not None and minded.child.pulsed)
    assert minded.child is not None
    first = minded.child.pid
    os.kill(first, signal.SIGKILL)
    looked(minded, lambda: pid_of(minded) not in (None, first))  # long before the wait of a second time is over
    assert told[0] == "it is gone: it was killed by SIGKILL; it is started again in 0 s"
    minded.end(5.0)
    assert pid_of(minded) is None and minded.status == -signal.SIGTERM


def test_a_process_that_says_nothing_is_killed_and_started_again() -> None:
    told: list[str] = []
    minded = Minded("it", speaks_once, QUICK, told.append)
    looked(minded, lambda: len(told) >= 2)
    assert "it said nothing for 0.5 s, and was killed" in told[0] and "started again, process" in told[1]
    minded.end(0.0)


def test_a_process_that_stands_is_killed() -> None:
    told: list[str] = []
    minded = Minded("it", speaks, QUICK, told.append)
    looked(minded, lambda: minded.child is not None and minded.child.pulsed)
    assert minded.child is not None
    os.kill(minded.child.pid, signal.SIGSTOP)
    looked(minded, lambda: told)
    assert "said nothing" in told[0]
    minded.end(0.0)


def test_waits_double_up_to_the_longest_where_it_dies_at_once() -> None:
    told: list[str] = []
    minded = Minded("it", lambda pulse: 7, QUICK, told.append)
    looked(minded, lambda: len(told) >= 9)
    gone = [line for line in told if "is gone" in line]
    assert [line.rpartition(" in ")[2] for line in gone[:5]] == ["0 s", "0.2 s", "0.4 s", "0.4 s", "0.4 s"]
    assert all("status 7" in line for line in gone) and minded.status == 7
    minded.end(0.0)


def test_what_ignores_the_wish_to_end_is_killed() -> None:
    def stubborn(pulse: int) -> int:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        os.write(pulse, b".")
        time.sleep(60.0)
        return 0

    child = Child(stubborn)
    end = time.monotonic() + 10.0
    while not child.pulsed and time.monotonic() < end:
        child.listen()
    assert child.end(signal.SIGTERM, 0.2) == -signal.SIGKILL


def test_what_cannot_be_started_is_tried_again_and_ends_nobody() -> None:
    told: list[str] = []
    opened = len(os.listdir("/proc/self/fd"))
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    minded = Minded("it", speaks, QUICK, told.append)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, before[1]))
    try:
        for _ in range(2):
            minded.look()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    assert told[0] == "it could not be started: Too many open files; it is tried again in 0 s"
    assert len(os.listdir("/proc/self/fd")) == opened
    looked(minded, lambda: minded.child is not None and minded.child.pulsed)
    minded.end(5.0)


def test_a_process_that_dies_for_weeks_is_still_started_again() -> None:
    told: list[str] = []
    minded = Minded("it", lambda pulse: 1, QUICK, told.append)
    minded._deaths = 1100  # thinking that never lasts needs 18 hours for that, and a guard 20 minutes
    looked(minded, lambda: len(told) >= 2)
    assert "it ended with status 1; it is started again in 0.4 s" in told[1]
    minded.end(5.0)
