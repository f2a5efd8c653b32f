"""A run that was killed is gone on with, also while somebody looks whether it goes on."""

from __future__ import annotations

import fcntl
import os
import threading
from pathlib import Path

import pytest

from homeostat.journal import RunStarted
from homeostat.record.directory import LOOKED_S, RunDirectory, RunDirectoryError


def test_who_only_looks_does_not_keep_a_run_from_being_gone_on_with(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run") as directory:
        directory.record(RunStarted("vessel", (), 1), 0.0)
    looking = os.open(tmp_path / "run" / "events.jsonl", os.O_RDONLY)
    fcntl.flock(looking, fcntl.LOCK_SH)
    over = threading.Timer(LOOKED_S / 10.0, os.close, (looking,))
    over.start()
    with RunDirectory.resume(tmp_path / "run"), pytest.raises(RunDirectoryError, match="still goes on"):
        RunDirectory.resume(tmp_path / "run")
    over.join()
