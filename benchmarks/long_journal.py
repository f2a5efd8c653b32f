"""How long a guard takes to know where it stood, by the length of its journal: all of it read, and only followed.

    python -m benchmarks.long_journal RUN [--events 10000,100000]

The journal is that of the recorded ``RUN``, its events again and again as one chain. *Read*: as before the chain was
only followed, twice (by the guard and by the journal that goes on), and folded; *followed*: as it is now.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterable
from itertools import cycle, islice
from pathlib import Path

from benchmarks.arguments import numbers
from benchmarks.host import measured_on
from homeostat.guard.restart.memory import Memory
from homeostat.journal import Journal, read_events
from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.chain import GENESIS, digest
from homeostat.journal.encode import canonical
from homeostat.journal.found import Found
from homeostat.journal.reading import scan
from homeostat.service.attached.place import RECALLED

ONCE = ("run-started", "run-finished", "resumed", "signed")
"""Kinds that a journal has where it begins, goes on or ends."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.long_journal", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN")
    parser.add_argument("--events", type=numbers, default=[10_000, 100_000])
    asked = parser.parse_args()
    print(measured_on())
    for events in asked.events:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            size = _lengthen(asked.run, path, events)
            read, before = _cpu_s(lambda at=path: _read(at))
            followed, after = _cpu_s(lambda at=path: _followed(at))
            assert before == after, "both remember the same"
            print(f"{events} events, {size / 1e6:.0f} MB: read {read:.2f} s, followed {followed:.2f} s")


def _lengthen(run: Path, folder: Path, events: int) -> int:
    """Write a journal of so many ``events`` into ``folder``; its size [byte]."""
    lines = [json.loads(line) for line in (run / JOURNAL).read_bytes().splitlines()]
    between: Iterable[dict[str, object]] = cycle(line for line in lines if line["event"] not in ONCE)
    last = GENESIS
    with (folder / JOURNAL).open("wb") as file:
        for number, content in enumerate((lines[0], *islice(between, events - 1)), start=1):
            raw = canonical({**content, "seq": number, "prev": last, "at_s": float(number)}).encode("ascii")
            file.write(raw + b"\n")
            last = digest(raw)
    return (folder / JOURNAL).stat().st_size


def _read(folder: Path) -> Memory:
    memory = Memory.of(read_events(folder))
    for line in scan(folder / JOURNAL):
        digest(line.raw)
    return memory


def _followed(folder: Path) -> Memory:
    found = Found.in_directory(folder, kinds=RECALLED)
    with Journal.go_on(found):
        return Memory.of(found.records)


def _cpu_s(action: Callable[[], Memory]) -> tuple[float, Memory]:
    began = time.process_time()
    found = action()
    return time.process_time() - began, found


if __name__ == "__main__":
    main()
