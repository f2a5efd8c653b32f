"""A journal without room: nothing torn stays, and the chain goes on when there is room again."""

from __future__ import annotations

import errno
import gc
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from homeostat.journal import Journal, Summary, read_events
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.verify.verify import verify
from tests.journal.samples import Measured

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs /dev/full and limits on file size")

NO_ROOM = """
import resource, sys
from homeostat.journal.verify.verify import verify
from homeostat.journal import Journal, Signature, Summary
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.signing.signing import EVERY_LINES
from tests.journal.samples import Measured
key = SigningKey(bytes(32))
journal, refused = Journal(sys.argv[1], key), 0
path = journal.directory / "events.jsonl"
unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
number = 0
for room in [0, 1, 40, 170, 171, 400, 5000] * 6:
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + room, resource.RLIM_INFINITY))
    for _ in range(15):
        try:
            journal.record(Measured("T1", float(number)), float(number))
        except OSError:
            refused += 1
        else:
            number += 1
    resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    journal.record(Measured("T1", float(number)), float(number))
    number += 1
troubles = journal.take_troubles()
journal.close(Summary(1, "done"))
report = verify(sys.argv[1], {key.public})
assert report.complete and report.vouched.signature is Signature.TRUSTED, report
print(number, refused, len(troubles))
"""


def test_a_disk_that_fills_again_and_again_costs_only_what_did_not_fit(tmp_path: Path) -> None:
    repo = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", NO_ROOM, str(tmp_path / "run")]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    number, refused, _ = map(int, done.stdout.split())
    values = [r.fields["value"] for r in read_events(tmp_path / "run") if r.kind == "measured"]
    assert values == [float(n) for n in range(number)] and refused > 100


def onto(journal: Journal, target: int) -> int:
    """Make the journal write to the descriptor ``target``; what it wrote to before."""
    kept = os.dup(journal._file)
    os.dup2(target, journal._file)
    return kept


def test_a_full_device_is_an_error_and_no_end(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "run", SigningKey(bytes(32)))
    journal.record(Measured("T1", 1.0), 1.0)
    full = os.open("/dev/full", os.O_WRONLY)
    kept = onto(journal, full)
    for _ in range(3):
        with pytest.raises(OSError) as refusal:
            journal.record(Measured("T1", 2.0), 2.0)
    assert refusal.value.errno in (errno.ENOSPC, errno.EINVAL)
    os.dup2(kept, journal._file)
    journal.record(Measured("T1", 3.0), 3.0)
    journal.close(Summary(1, "done"))
    assert verify(tmp_path / "run").complete
    assert [r.fields["value"] for r in read_events(tmp_path / "run") if r.kind == "measured"] == [1.0, 3.0]


def test_a_pipe_that_takes_half_a_line_leaves_no_half_line_behind(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "run")
    journal.record(Measured("T1", 1.0), 1.0)
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    kept = onto(journal, writer)
    with pytest.raises(OSError):
        while True:  # until the pipe is full
            os.write(writer, b"x" * 4096)
    os.read(reader, 4096)
    with pytest.raises(OSError, match=r"fit on the disk|unavailable"):
        journal.record(Measured("T" * 100_000, 2.0), 2.0)
    with pytest.raises(OSError):  # a pipe cannot be mended
        journal.record(Measured("T1", 2.0), 2.0)
    os.dup2(kept, journal._file)
    journal.record(Measured("T1", 3.0), 3.0)
    journal.close(Summary(1, "done"))
    assert verify(tmp_path / "run").complete
    assert [r.fields["value"] for r in read_events(tmp_path / "run")] == [1.0, 3.0]
    os.close(reader)


def test_a_sync_that_hangs_keeps_nobody_from_recording(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "run")
    with journal._syncing:  # as a thread holds it whose disk does not answer
        journal.record(Measured("T1", 1.0), 1.0)
    journal.close(Summary(1, "done"))
    assert verify(tmp_path / "run").lines == 1


@pytest.mark.slow
def test_memory_does_not_grow_with_the_journal(tmp_path: Path) -> None:
    with Journal(tmp_path / "run", SigningKey(bytes(32))) as journal:
        journal.subscribe(lambda event, at_s: None)
        used = []
        tracemalloc.start()
        for thousand in range(6):
            for number in range(1000):
                journal.record(Measured("T1", float(number)), 1000.0 * thousand + number)
            gc.collect()
            used.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()
    assert used[-1] - used[2] < 10_000
