"""``kill -9`` of each process of an attached reactor: ``python -m benchmarks.attached.killed [--seeds 0-199]``.

Each kill is a line of a file, and those that are there are not done again. What is written there: how soon the guard
had a sample again, in which mode, whether its latch stood, and what of the history was lost.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from benchmarks.arguments import names, numbers
from benchmarks.attached.rows import Rows
from benchmarks.host import commit
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.samples import ALWAYS
from homeostat.history.store import UnknownTag
from homeostat.journal.verify.verify import verify
from homeostat.service.historian.observed import PROCESS_TIME
from tests.equipment.opcua.attached import Attached, Reactor

LIFE: Final = 20
"""Kills that one service lives through; then it is stopped, and its journal verified."""
MODULES: Final = {"thinking": "homeostat.service.thinking", "historian": "homeostat.service.historian"}
WHO: Final = ("guard", "thinking", "historian", "the first")


def _sampled(now: dict[str, Any]) -> bool:
    return now["now_s"] is not None and not now["link"]["trouble"] and now["ticks"]["number"] > now["ticks"]["without"]


def _process(attached: Attached, who: str) -> int:
    """The number of the process that is killed."""
    if who == "guard":
        return int(attached.waits_for(_sampled, "a guard")["guard_process"])
    if who == "the first":
        return attached.process.pid
    listed = subprocess.run(
        ["ps", "--ppid", str(attached.process.pid), "-o", "pid=,args="], capture_output=True, text=True
    )
    return next(int(line.split()[0]) for line in listed.stdout.splitlines() if MODULES[who] in line)


def _kept(folder: Path) -> list[float]:
    """Process times of all samples in the history."""
    try:
        return EmbeddedHistory(folder).read([PROCESS_TIME], ALWAYS)[PROCESS_TIME].value.tolist()
    except (UnknownTag, ValueError):
        return []


def killed(begin: Callable[[], Attached], attached: Attached, who: str, seed: int) -> tuple[Attached, dict[str, Any]]:
    """One kill at a moment that ``seed`` says; whoever is attached then, and what came of it."""
    chance, history = random.Random(f"{who}/{seed}"), Path(f"{attached.directory}.history")
    latch = chance.random() < 0.5
    before = attached.waits_for(_sampled, "a sample")
    attached.order("mode", "closed-loop", "--reason", "study")
    if latch:
        attached.order("fall-back", "--reason", "study")
        attached.waits_for(lambda now: now["latched"], "the latch", 60.0)
    time.sleep(chance.uniform(0.0, 3.0))
    mode, pid, known = attached.status["mode"]["actual"], _process(attached, who), _kept(history)
    guards = attached.status["guard_process"]
    began = time.monotonic()
    os.kill(pid, signal.SIGKILL)
    if who == "the first":
        attached.process.wait(30.0)
        attached = begin()
    other = who in ("guard", "the first")
    now = attached.waits_for(lambda n: _sampled(n) and (n["guard_process"] != guards or not other), "a guard", 120.0)
    row: dict[str, Any] = {"who": who, "seed": seed, "guard_s": round(time.monotonic() - began, 2)}
    row |= {"before": mode, "mode": now["mode"]["actual"], "latch": latch, "latched": bool(now["latched"])}
    if not other:
        find = time.monotonic()
        while _found(attached, who) in (None, pid) and time.monotonic() - find < 60.0:
            time.sleep(0.05)
        row["again_s"] = round(time.monotonic() - began, 2)
    time.sleep(2.0)
    after = _kept(history)
    row |= {"kept": len(known), "lost": len(set(known) - set(after)), "twice": len(after) - len(set(after))}
    row |= {"longest_s": round(attached.status["ticks"]["longest_s"], 2), "load": round(os.getloadavg()[0], 1)}
    row["process_s"] = before["now_s"]
    if latch:
        attached.order("reset", "--reason", "study")
    attached.order("mode", "observe", "--reason", "study")
    return attached, row


def _found(attached: Attached, who: str) -> int | None:
    try:
        return _process(attached, who)
    except StopIteration:
        return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=numbers, default=list(range(200)))
    parser.add_argument("--who", type=names, default=list(WHO))
    parser.add_argument("--minutes", type=float, default=1e6)
    parser.add_argument("--out", type=Path, default=Path("runs/attached/killed.jsonl"))
    options = parser.parse_args()
    rows, until = Rows(options.out), time.monotonic() + 60.0 * options.minutes
    done = {(row["who"], row["seed"]) for row in rows.all()}
    jobs = [(who, seed) for seed in options.seeds for who in options.who if (who, seed) not in done]
    with tempfile.TemporaryDirectory(prefix="killed") as folder:
        _keep_compiled(Path(folder) / "compiled")
        _kill(rows, jobs, until, Path(folder))


def _keep_compiled(folder: Path) -> None:
    """Have every process keep what it compiles in ``folder``, as where the package was installed."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = str(folder)


def _kill(rows: Rows, jobs: list[tuple[str, int]], until: float, folder: Path) -> None:
    """One kill after the other, until all were done, or the monotonic clock says ``until`` [s]."""
    with Reactor(folder, 1.0) as reactor:
        while jobs and time.monotonic() < until:
            live = folder / f"live{len(jobs)}"

            def begin(live: Path = live) -> Attached:
                return Attached(reactor, live)

            attached = begin()
            for _ in range(min(LIFE, len(jobs))):
                who, seed = jobs.pop(0)
                try:
                    attached, row = killed(begin, attached, who, seed)
                except (AssertionError, StopIteration) as never:
                    print(who, seed, str(never)[:3000], flush=True)
                    rows.add({"commit": commit(), "who": who, "seed": seed, "never": str(never)[:200]})
                    break
                rows.add({"commit": commit(), **row})
                if time.monotonic() >= until:
                    break
            with attached:
                status = attached.interrupt()
            report = verify(live)
            if status or not report.complete:
                print("verify", status, report, flush=True)


if __name__ == "__main__":
    main()
