"""Texts behind events are kept once each, by files: what is asked in weeks fits into no memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

from homeostat.record.directory import RunDirectory

LENGTH, COUNT = 400_000, 10


def test_texts_are_kept_on_the_disk_and_not_in_memory(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run") as directory:
        first = directory.store_prompt("0" * LENGTH)
        tracemalloc.start()
        try:
            for number in range(1, COUNT):
                directory.store_prompt(str(number) * LENGTH)
            held, _ = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert held < LENGTH
        assert directory.store_prompt("0" * LENGTH) == first and first.size_bytes == LENGTH
        assert len([*(tmp_path / "run" / "prompts").iterdir()]) == COUNT
