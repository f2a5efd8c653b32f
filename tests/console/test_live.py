"""A run that goes on is followed: its readings as they come, its events as they are written."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from homeostat.console.readings import Gathered
from homeostat.domain.snapshot import Snapshot
from tests.cli.command import COMMAND, LIMIT_S, environment
from tests.console.served import Served


@given(st.lists(st.floats(0.0, 1e5), min_size=1, max_size=60))
def test_readings_are_gathered_in_order_of_their_times(times: list[float]) -> None:
    gathered = Gathered(["T", "L"])
    assert gathered.readings() is None
    for at_s in times:
        gathered(Snapshot(at_s, {"T": 2.0 * at_s}))
    readings = gathered.readings()
    assert readings is not None and (np.diff(readings.times_s) > 0.0).all() and readings.last_s == max(times)
    assert (readings.signals["T"] == 2.0 * readings.times_s).all() and np.isnan(readings.signals["L"]).all()


def test_there_is_room_for_a_long_run() -> None:
    gathered = Gathered(["T"])
    for second in range(10_000):
        gathered(Snapshot(float(second), {"T": float(second)}))
    readings = gathered.readings()
    assert readings is not None and readings.times_s.size == 10_000
    assert (readings.signals["T"] == np.arange(10_000)).all()


@given(st.integers(1, 40), st.integers(1, 200))
def test_of_very_many_readings_the_latest_are_kept(most: int, count: int) -> None:
    gathered = Gathered(["T"], most)
    for second in range(count):
        gathered(Snapshot(float(second), {"T": 2.0 * second}))
    readings = gathered.readings()
    assert readings is not None and min(count, most) // 2 <= readings.times_s.size <= most
    assert (np.diff(readings.times_s) == 1.0).all() and readings.last_s == count - 1.0
    assert (readings.signals["T"] == 2.0 * readings.times_s).all()


def test_a_run_is_shown_while_it_goes_on_and_after_it(tmp_path: Path) -> None:
    arguments = ["run", "cstr", "--end", "300", "--console", "--pace", "40", "--out", "run"]
    with (tmp_path / "said").open("w+") as said:
        process = subprocess.Popen(
            [*COMMAND, *arguments], cwd=tmp_path, env=environment(), stdout=subprocess.DEVNULL, stderr=said
        )
        try:
            port = int(waited_for(tmp_path / "said", r"shown at http://127\.0\.0\.1:(\d+)/"))
            server = Served(port, process)  # type: ignore[arg-type]
            deadline = time.monotonic() + LIMIT_S
            while (told := server.ask("/api/run").json)["last_s"] < 100.0:
                assert time.monotonic() < deadline
                time.sleep(0.1)
            assert (told["live"], told["closed"], told["measured"]) == (True, False, True)
            moment = server.ask("/api/moment?at=100").json
            assert moment["sampled_s"] == 100.0 and moment["values"]["T1"] is not None
            assert moment["overview"]["mode"] == "closed-loop"
            first, *_, last = server.moments(f"/api/stream?at={told['last_s']}&speed=1000", 8)
            assert float(last["id"]) > float(first["id"])
            waited_for(tmp_path / "said", r"(the page stays until Ctrl-C)")
            told = server.ask("/api/run").json
            assert (told["live"], told["closed"], told["last_s"]) == (False, True, 300.0)
        finally:
            os.kill(process.pid, signal.SIGINT)
            process.wait(LIMIT_S)
    assert process.returncode == 0 and "Traceback" not in (tmp_path / "said").read_text()


def waited_for(path: Path, pattern: str) -> str:
    """What ``pattern`` finds in the file at ``path`` as soon as it is there."""
    deadline = time.monotonic() + LIMIT_S
    while (found := re.search(pattern, path.read_text())) is None:
        assert time.monotonic() < deadline, path.read_text()
        time.sleep(0.1)
    return found[1]
