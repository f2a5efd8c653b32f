"""A process killed while it writes leaves a run that verifies to its last whole line."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify

pytestmark = pytest.mark.slow

WRITER = """
import itertools, sys
from homeostat.journal import Journal
from tests.journal.samples import Health, Margin, Measured
journal = Journal(sys.argv[1])
for number in itertools.count(1):
    margins = tuple(Margin(f"criterion {i}", 0.1 * i) for i in range(number % 50))
    journal.record(Measured("T1", float(number), Health.GOOD, margins), 0.5 * number)
"""

REPO = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("delay_s", [0.0, 0.003, 0.017, 0.041, 0.09, 0.2])
def test_a_killed_run_verifies_to_its_last_whole_line(tmp_path: Path, delay_s: float) -> None:
    journal = tmp_path / "events.jsonl"
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path)], cwd=REPO)
    try:
        while writer.poll() is None and not (journal.exists() and journal.stat().st_size):
            time.sleep(0.0005)
        time.sleep(delay_s)
    finally:
        writer.send_signal(signal.SIGKILL)
        assert writer.wait(timeout=240) == -signal.SIGKILL
    whole = journal.read_bytes().count(b"\n")
    report = verify(tmp_path)
    assert whole > 0 and (report.lines, report.complete, report.intact) == (whole, False, True)
    assert report.problem and report.problem.startswith(f"incomplete run: verifies up to line {whole}")
    assert [record.fields["value"] for record in read_events(tmp_path)] == [float(n) for n in range(1, whole + 1)]
