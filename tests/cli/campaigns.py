"""Studies as processes of their own, which are stopped, killed and started again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from homeostat.evaluate.study.ledger import DATASET, LEDGER, read_dataset
from homeostat.record.row import WALL
from tests.cli.command import LIMIT_S, environment

SMALL = """
title = "Small"
seeds = 4
keep = "none"
proposers = ["do-nothing", "hindsight"]

[[scenarios]]
case = "mixing_module"
end_s = 400.0

[[scenarios]]
case = "mixing_module"
fault = "pump_failure"
end_s = 400.0
"""
"""Sixteen jobs of about a tenth of a second each."""
JOBS = 16
INTERRUPTIBLE = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from homeostat.__main__ import main
sys.exit(main(sys.argv[1:]))
"""
"""The command where the tests run as a shell's background job, whose children ignore Ctrl-C."""


def wait_for(happened: Callable[[], bool], what: str, limit_s: float = LIMIT_S) -> None:
    """Return as soon as something has happened."""
    deadline = time.monotonic() + limit_s
    while not happened():
        assert time.monotonic() < deadline, f"not in time: {what}"
        time.sleep(0.005)


def rows_in(folder: Path) -> int:
    """Whole lines of the ledger in ``folder``."""
    ledger = folder / LEDGER
    return ledger.read_bytes().count(b"\n") if ledger.exists() else 0


def started(cwd: Path, *options: str) -> subprocess.Popen[str]:
    """``homeostat campaign small.toml --out out options`` in ``cwd``, in a process group of its own, as in a shell."""
    (cwd / "small.toml").write_text(SMALL)
    arguments = [sys.executable, "-c", INTERRUPTIBLE, "campaign", "small.toml", "--out", "out", *options]
    return subprocess.Popen(
        arguments, cwd=cwd, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip


def ended(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Status, output and errors of a process, once it has ended."""
    out, err = process.communicate(timeout=LIMIT_S)
    return process.returncode, out, err


def stop(process: subprocess.Popen[str], how: signal.Signals) -> tuple[int, str, str]:
    """Send ``how`` to a study and all that it started, and wait for its end."""
    os.killpg(process.pid, how)
    return ended(process)


def table(folder: Path) -> list[dict[str, Any]]:
    """The dataset in ``folder`` without what depends on the machine."""
    rows = map(asdict, read_dataset(folder / DATASET))
    return [{name: value for name, value in row.items() if not name.startswith(WALL)} for row in rows]


def tables(folder: Path) -> dict[str, str]:
    """The tables of the report that do not depend on the machine: name -> content."""
    return {p.name: p.read_text() for p in sorted((folder / "tables").iterdir()) if "latency" not in p.name}


def prints(folder: Path) -> list[str]:
    """Fingerprints in the ledger, one for each time that a job was carried out."""
    return [json.loads(line)["fingerprint"] for line in (folder / LEDGER).read_text().splitlines()]


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and its workers, each a process of its own; address and workers."""
    at = folder / "scheduler.json"
    scheduler = _dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--dashboard-address", ":0",
                      "--scheduler-file", str(at))  # fmt: skip
    there: list[subprocess.Popen[bytes]] = []  # whoever adds to it need not care for its end
    try:
        wait_for(lambda: at.exists() and at.read_text().endswith("}"), "a scheduler")
        address = str(json.loads(at.read_text())["address"])
        there += [one_worker(address) for _ in range(workers)]
        yield address, there
    finally:
        for process in (*there, scheduler):
            process.kill()
            process.wait()


def one_worker(address: str) -> subprocess.Popen[bytes]:
    """A worker of the scheduler at ``address``."""
    return _dask("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")


def _dask(what: str, *arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments], env=environment(),
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
