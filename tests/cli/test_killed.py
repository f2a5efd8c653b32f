"""A run that is stopped, gently or not, leaves a record that verifies."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from tests.cli.command import COMMAND, LIMIT_S, environment, homeostat, refused

pytestmark = pytest.mark.slow

LONG = ("run", "cstr", "--fault", "cool_stuck_closed", "--onset", "700", "--end", "86400", "--out", "run")


INTERRUPTIBLE = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from homeostat.__main__ import main
sys.exit(main(sys.argv[1:]))
"""
"""The command where the tests run as a shell's background job, whose children ignore Ctrl-C."""


def stopped(folder: Path, how: signal.Signals, kinds: int, delay_s: float) -> tuple[int, str, str]:
    """Start a long run, stop it ``delay_s`` after ``kinds`` events are in its journal; status, output, errors."""
    journal = folder / "run" / "events.jsonl"
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTIBLE, *LONG], cwd=folder, env=environment(), stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + LIMIT_S
        while process.poll() is None and time.monotonic() < deadline:
            if journal.exists() and journal.read_bytes().count(b"\n") >= kinds:
                break
            time.sleep(0.002)
        time.sleep(delay_s)
    finally:
        process.send_signal(how)
        out, err = process.communicate(timeout=LIMIT_S)
    return process.returncode, out, err


@pytest.mark.parametrize(
    ("events", "delay_s"), [(1, 0.0), *(pytest.param(*each, marks=pytest.mark.wide) for each in ((2, 0.1), (8, 0.2)))]
)
def test_killed_at_any_moment(tmp_path: Path, events: int, delay_s: float) -> None:
    status, _, _ = stopped(tmp_path, signal.SIGKILL, events, delay_s)
    assert status == -signal.SIGKILL
    whole = (tmp_path / "run" / "events.jsonl").read_bytes().count(b"\n")
    report = verify(tmp_path / "run")
    assert whole >= events and (report.lines, report.intact, report.complete) == (whole, True, False)
    checked = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert (checked.status, checked.err) == (1, "")
    assert f"verifies up to line {whole}" in checked.out and checked.out.count("\n") == 1


def test_ctrl_c_closes_the_trace(tmp_path: Path) -> None:
    status, out, err = stopped(tmp_path, signal.SIGINT, 2, 0.05)
    assert (status, err) == (130, "homeostat: interrupted\n")
    assert out.splitlines()[-1].endswith("end       interrupted")
    assert verify(tmp_path / "run").complete
    last, signed = list(read_events(tmp_path / "run"))[-2:]
    assert (last.kind, last.fields["outcome"], signed.kind) == ("run-finished", "interrupted", "signed")
    again = homeostat("replay", "run", cwd=tmp_path)
    assert (again.status, again.out, again.err) == (0, out, "")
    without = homeostat("replay", "run", "--json", cwd=tmp_path)
    assert (without.status, without.out) == (2, "") and "no result" in without.err


def test_a_reader_that_goes_away_does_not_stop_the_run(tmp_path: Path) -> None:
    arguments = [*COMMAND, "run", "cstr", "--end", "700", "--out", "run"]
    process = subprocess.Popen(arguments, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert "cstr" in process.stdout.readline()
    process.stdout.close()
    assert process.wait(LIMIT_S) == 141
    assert verify(tmp_path / "run").complete


def test_a_killed_run_is_resumed(tmp_path: Path) -> None:
    refused(homeostat("resume", str(tmp_path), cwd=tmp_path), "not a run directory")
    command = ("run", "cstr", "--mode", "approve", "--pace", "1", "--end", "300", "--out", "run")
    process = subprocess.Popen([*COMMAND, *command], cwd=tmp_path, env=environment(), stdout=subprocess.DEVNULL)
    journal, deadline = tmp_path / "run" / "events.jsonl", time.monotonic() + LIMIT_S
    while not (journal.exists() and b"guard-started" in journal.read_bytes()) and time.monotonic() < deadline:
        time.sleep(0.05)
    refused(homeostat("resume", "run", cwd=tmp_path), "still goes on")
    process.kill()
    process.wait(LIMIT_S)
    done = homeostat("resume", "run", "--out", "copy", "--pace", "100", cwd=tmp_path)
    assert done.status == 0 and "goes on from the journal in mode approve" in done.out
    assert "homeostat: it goes on at " in done.err
    assert homeostat("trace", "verify", "copy", cwd=tmp_path).status == 0
    refused(homeostat("resume", "copy", cwd=tmp_path), "is over")
    again = homeostat("replay", "copy", cwd=tmp_path)
    assert again.status == 0 and again.out.endswith(done.out)
