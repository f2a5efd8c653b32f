"""What the guard costs: CPU time per tick, and CPU time of the whole demo command against an earlier commit."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.guard.store import Sizes
from benchmarks.guard.wire_log import measure as run
from benchmarks.host import ROOT

EARLIER = "170fbcd"
DEMO = ("run", "cstr", "--fault", "cool_stuck_closed", "--seed")
RUNS = (("mixing_module", "none"), ("mixing_module", "pump_failure"), ("cstr", "none"), ("cstr", "cool_stuck_closed"))


def measure(sizes: Sizes) -> dict[str, Any]:
    """Both figures; the command runs alternately at both commits, after one run of each that is not counted.

    How long is thought differs from seed to seed and, because thinking is measured, from run to run; so there are
    several seeds.
    """
    ticks = [{"plant": plant, "fault": fault, **run(plant, fault)["decision"]} for plant, fault in RUNS]
    with tempfile.TemporaryDirectory() as folder:
        earlier = _archive(Path(folder))
        if earlier is None:
            return {"ticks": ticks, "demo": None}
        sources = {"now": ROOT / "src", EARLIER: earlier / "src"}
        found: dict[str, list[float]] = {name: [] for name in sources}
        for k in range(sizes.repeats + 1):
            for name, source in sources.items():
                cpu_s = _demo_cpu_s(source, str(max(k, 1)), Path(folder) / f"{name}-{k}")
                if k:
                    found[name].append(round(cpu_s, 2))
    return {"ticks": ticks, "demo": found}


def _archive(folder: Path) -> Path | None:
    """The sources of the earlier commit in ``folder``; None where the history does not go back so far."""
    packed = subprocess.run(["git", "archive", EARLIER, "src"], capture_output=True, cwd=ROOT)
    if packed.returncode:
        return None
    subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)
    return folder


def _demo_cpu_s(source: Path, seed: str, folder: Path) -> float:
    """CPU time of one run of the command with the sources in ``source`` [s]."""
    folder.mkdir()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "homeostat", *DEMO, seed], cwd=folder, env={**os.environ, "PYTHONPATH": str(source)},
        capture_output=True, check=False,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
