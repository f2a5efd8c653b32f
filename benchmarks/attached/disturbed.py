"""The link disturbed at random moments: ``python -m benchmarks.attached.disturbed [--seeds 0-199] [--at-once 4]``.

Each disturbance is a line of a file, and those that are there are not done again.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.arguments import names, numbers
from benchmarks.attached.asking import number_of
from benchmarks.attached.disturbances import DISTURBANCES
from benchmarks.attached.rig import Never, Rig
from benchmarks.attached.rows import Rows
from benchmarks.attached.tank import GRACE_S, STALE_S
from benchmarks.host import commit
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import WriteIntended
from homeostat.journal import Record, read_events
from homeostat.record.decode import decode

LIFE = 20
"""Disturbances that one rig lives through before another one takes its place."""


def disturbed(rig: Rig, kind: str, seed: int) -> dict[str, Any]:
    """One disturbance at a moment that ``seed`` says, and what came of it."""
    chance = random.Random(f"{kind}/{seed}")
    before = len(tuple(read_events(rig.live)))
    row: dict[str, Any] = {"kind": kind, "seed": seed, "pace": rig.pace, "at": round(time.time())}
    row["moved"] = rig.status.get("out_of_service", [])
    try:
        row["raised_s"] = round(rig.closed_loop(), 2)
        time.sleep(chance.uniform(0.0, 4.0))
        seen = DISTURBANCES[kind](rig, chance)
        row |= {k: round(v, 3) if isinstance(v, float) else v for k, v in seen._asdict().items()}
        row["mode"] = rig.mode
        time.sleep(1.0)
    except Never as never:
        row["never"] = str(never)
    records = tuple(read_events(rig.live))
    row |= _written(rig, records) | _silence(records[before:])
    row["load"] = round(os.getloadavg()[0], 1)
    return row


def _written(rig: Rig, records: Sequence[Record]) -> dict[str, Any]:
    """What reached the present server more often than the guard meant it to, or from before it began."""
    intended = Counter(v for event in _events(records, WriteIntended) for v in _values(event))
    try:
        arrived = Counter(rig.arrived)
    except OSError:
        return {"never": "the server is gone"}
    again = [n for n, times in arrived.items() if times > intended[n]]
    late = [n for n in arrived if rig.lost and n <= rig.lost[-1]]
    tried = sum(1 for event in _events(records, WriteIntended) if event.attempt > 1)
    return {"arrived": sum(arrived.values()), "repeated": len(again), "late": len(late), "tried_again": tried}


def _values(event: WriteIntended) -> Iterator[int]:
    for c in event.commands:
        if c.tag == "L.sp" and c.value is not None and c.value > 6.0:
            yield number_of(c.value)


def _silence(records: Sequence[Record]) -> dict[str, Any]:
    """Fallbacks, and those that came before a limit may count as undecided."""
    fallbacks, early, last_s = 0, 0, None
    for record in records:
        if record.kind == FallbackActivated.kind:
            fallbacks += 1
            early += last_s is not None and record.happened_s - last_s < STALE_S + GRACE_S
        elif record.kind == "alarm-raised" and last_s is None:
            last_s = record.happened_s
    return {"fallbacks": fallbacks, "early": early}


def _events(records: Sequence[Record], kind: type[Any]) -> Iterator[Any]:
    for record in records:
        if record.kind == kind.kind:
            yield decode(record)


def _worker(jobs: list[tuple[str, int]], rows: Rows, taking: threading.Lock, until: float) -> None:
    while jobs and time.monotonic() < until:
        with tempfile.TemporaryDirectory(prefix="rig") as folder, Rig(Path(folder)) as rig:
            for _ in range(LIFE):
                with taking:
                    if not jobs or time.monotonic() >= until:
                        return
                    kind, seed = jobs.pop(0)
                row = disturbed(rig, kind, seed)
                rows.add({"commit": commit(), **row})
                if "never" in row:
                    _tell(rig, row)
                    break


def _tell(rig: Rig, row: dict[str, Any]) -> None:
    """Say what is known of a disturbance that was not survived."""
    print(row, rig.status, (rig.folder / "guard.txt").read_text()[-2000:])
    for record in tuple(read_events(rig.live))[-60:]:
        print(f"{record.at_s:8.1f} {record.kind} {dict(record.fields)}"[:300], flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=numbers, default=list(range(200)))
    parser.add_argument("--kinds", type=names, default=list(DISTURBANCES))
    parser.add_argument("--at-once", type=int, default=4)
    parser.add_argument("--minutes", type=float, default=1e6)
    parser.add_argument("--out", type=Path, default=Path("runs/attached/disturbed.jsonl"))
    options = parser.parse_args()
    rows, taking = Rows(options.out), threading.Lock()
    done = {(row["kind"], row["seed"]) for row in rows.all()}
    jobs = [(kind, seed) for seed in options.seeds for kind in options.kinds if (kind, seed) not in done]
    until = time.monotonic() + options.minutes * 60.0
    workers = [
        threading.Thread(target=_worker, args=(jobs, rows, taking, until), daemon=True) for _ in range(options.at_once)
    ]
    signal.signal(signal.SIGTERM, lambda *ended: jobs.clear())  # what is under way is finished
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


if __name__ == "__main__":
    main()
