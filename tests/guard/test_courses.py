"""What the guard does in random courses is what it did before, second by second, whatever the order of its sets."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.guard.courses import COURSES, KEPT, LONG, digests

REFERENCE = json.loads(KEPT.read_text(encoding="utf-8"))


@pytest.mark.parametrize("number", range(COURSES))
def test_the_guard_decides_in_a_course_as_before(number: int) -> None:
    kept, found = REFERENCE[str(number)].split(" "), digests(number)
    differs = [k for k, (then, now) in enumerate(zip(kept, found, strict=True)) if then != now]
    assert len(found) == LONG
    assert not differs, f"second {differs[0]} differs: python -m tests.guard.courses --show {number} {differs[0]}"


def test_no_decision_depends_on_the_order_of_a_set() -> None:
    code = "from tests.guard.courses import digests; print([digests(n) for n in range(10, 16)])"
    found = [
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("1", "4")
    ]
    assert found[0] == found[1] != b""
