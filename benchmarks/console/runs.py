"""Runs whose faults are drawn by a seed, so that whoever looks at a picture does not know what is wrong."""

from __future__ import annotations

import contextlib
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from homeostat.plants.plant import load_plant

KINDS: Final = ("reactor", "mixer", "unknown")


def drawn(kind: str, seed: int) -> list[str]:
    """The arguments of ``homeostat run``."""
    draw = random.Random(f"{kind} {seed}")
    if kind == "unknown":
        onset = draw.randrange(700, 1200)
        what = f"T_coolant + {draw.randrange(6, 12)} from {onset}"
        return ["run", "cstr", "--disturb", what, "--seed", str(seed), "--end", str(onset + 1500)]
    plant = {"reactor": "cstr", "mixer": "mixing_module"}[kind]
    fault = draw.choice(sorted(fault.name for fault in load_plant(plant).description.faults))
    return ["run", plant, "--fault", fault, "--seed", str(seed)]


def made(kind: str, seed: int, folder: Path) -> Path:
    """The directory of the run, which is made where it is not there; what it says is not shown."""
    out = folder / f"{kind}-{seed}"
    if not (out / "manifest.json").is_file():
        command = [sys.executable, "-m", "homeostat", *drawn(kind, seed), "--out", str(out)]
        subprocess.run(command, capture_output=True, check=False)
    return out


@contextlib.contextmanager
def served(run_dir: Path, *options: str) -> Iterator[tuple[str, int]]:
    """Address and number of a console in a process of its own."""
    command = [sys.executable, "-m", "homeostat", "console", str(run_dir), "--no-browser", "--port", "0", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout is not None
        said = process.stdout.readline()
        found = re.match(r"https?://\S+", said)
        if found is None:
            raise RuntimeError(f"the console said {said!r}")
        yield found[0], process.pid
    finally:
        process.terminate()
        process.wait(10.0)
