"""Whether the tests of the guard and of recovery's loop notice every small change, some modules at a time."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import Any

from benchmarks.guard.store import Sizes
from benchmarks.host import ROOT
from tests.guard.mutate import AREAS

AT_ONCE = 22
"""Modules that are mutated together, and kept as soon as they are measured; finding out which tests reach them takes
minutes each time."""
LINE = re.compile(r"^(\S+): (\d+) of (\d+) mutants noticed, (\d+) equivalent ones$", re.MULTILINE)

Group = tuple[str, tuple[str, ...]]
"""An area and some of its modules."""


def groups() -> list[Group]:
    """Every module, some at a time."""
    return [
        (name, area.modules[first : first + AT_ONCE])
        for name, area in AREAS.items()
        for first in range(0, len(area.modules), AT_ONCE)
    ]


def missing(area: str, modules: tuple[str, ...], measured: set[str]) -> tuple[str, ...]:
    """Those of the ``modules`` of an area that are not among those ``measured``, which have their whole names."""
    return tuple(m for m in modules if f"homeostat.{AREAS[area].package}.{m}" not in measured)


def measure(group: Group, sizes: Sizes) -> list[dict[str, Any]]:
    """What the tests notice of each module of ``group``; RuntimeError where they fail on the original."""
    area, modules = group
    words = [sys.executable, "-m", "tests.guard.mutate", "--area", area, "--modules", *modules]
    words += ["--sample", str(sizes.mutants)] if sizes.mutants else []
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    rows = [
        {"module": m[1], "noticed": int(m[2]), "asked": int(m[3]), "equivalent": int(m[4])}
        for m in LINE.finditer(done.stdout)
    ]
    if len(rows) != len(modules):
        raise RuntimeError(f"{' '.join(words)}: {(done.stdout + done.stderr)[-500:]}")
    survivors = [line.removeprefix("survived: ") for line in done.stdout.splitlines() if line.startswith("survived: ")]
    return [row | {"survivors": [s for s in survivors if s.startswith(f"{row['module']}:")]} for row in rows]
