"""No acknowledged sample is lost by ``kill -9``, whatever the store was doing: appending or making tables."""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS
from tests.cli.command import environment
from tests.contracts.history_store import T0, S
from tests.history.test_embedded import MEMORY
from tests.history.writing import TAGS

REPO = Path(__file__).resolve().parents[2]
MOST = 800
"""Most batches that are waited for before a kill: twenty tables are made of them."""


def killed_after(folder: Path, batches: int, seconds: float) -> list[int]:
    """Batches that a writer acknowledged before it was killed, ``seconds`` after the first so many."""
    surroundings = environment()
    surroundings["PYTHONPATH"] = f"{surroundings['PYTHONPATH']}:{REPO}"
    command = [sys.executable, "-m", "tests.history.writing", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=surroundings, cwd=REPO) as writer:
        assert writer.stdout is not None
        acknowledged = [writer.stdout.readline() for _ in range(batches)]
        time.sleep(seconds)
        writer.kill()
        acknowledged += writer.stdout.read().splitlines(keepends=True)
    return [int(line) for line in acknowledged if line.endswith("\n")]


def looked_through(folder: Path, acknowledged: set[int]) -> None:
    """Everything that was acknowledged is in the store, once, with the values that it had."""
    found = EmbeddedHistory(folder).read([f"tag {n:02d}" for n in range(TAGS)], ALWAYS)
    for n in range(TAGS):
        series = found[f"tag {n:02d}"]
        seconds = ((series.time_us - T0) // S).tolist()
        assert len(set(seconds)) == len(seconds), "a sample is there twice"
        assert acknowledged <= set(seconds)
        # What was written and never acknowledged may be there: one batch for each kill.
        assert series.value.tolist() == [k + n / 100 for k in seconds]


def deaths(times: int, seed: int) -> None:
    """Kill a writer again and again, and look through the store after each death."""
    draws, acknowledged, least = random.Random(seed), set[int](), 0
    with tempfile.TemporaryDirectory(dir=MEMORY) as base:
        folder = Path(base) / "history"
        for _ in range(times):
            batches = draws.randint(1, MOST)
            acknowledged |= set(killed_after(folder, batches, draws.uniform(0.0, 0.1)))
            least += batches
            looked_through(folder, acknowledged)
        with EmbeddedStore(folder) as store:
            # A torn record is told; it is no loss of what was acknowledged.
            assert all("torn" in line for line in store.take_troubles())
        looked_through(folder, acknowledged)
        assert len(acknowledged) >= least, "each life goes on behind the one before"


def test_a_writer_that_is_killed_three_times_loses_nothing() -> None:
    deaths(3, seed=1)


@pytest.mark.wide
@pytest.mark.slow
def test_a_writer_that_is_killed_twenty_times_loses_nothing() -> None:
    deaths(20, seed=2)
