"""A run shall not depend on how many cores there are: numpy's sums use one thread, unless somebody asks for more."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(("asked", "threads"), [(None, "1"), ("2", "2")])
def test_sums_use_one_thread_unless_asked_for_more(asked: str | None, threads: str) -> None:
    code = "import homeostat, os; print(os.environ['OPENBLAS_NUM_THREADS'])"
    clean = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    told = clean if asked is None else {**clean, "OPENBLAS_NUM_THREADS": asked}
    done = subprocess.run([sys.executable, "-c", code], env=told, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == threads
