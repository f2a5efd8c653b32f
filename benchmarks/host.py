"""What a page says of its figures: for which sources, and on what host, they were measured."""

from __future__ import annotations

import os
import platform
import subprocess
import time
import tomllib
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

ROOT = Path(__file__).parents[1]


def commit(*paths: str) -> str:
    """The last commit that touched ``paths``, the sources by default; with a ``+`` where they were changed since."""
    named = paths or ("src",)
    text = _git("log", "-1", "--format=%h", "--", *named)
    return f"{text}+" if _git("status", "--porcelain", "--", *named) else text


def changed(*paths: str) -> str:
    """How ``paths`` differ from the last commit: a patch, and the files that it lacks; empty where they do not."""
    lacking = _git("ls-files", "--others", "--exclude-standard", "--", *paths).splitlines()
    texts = ((ROOT / name).read_bytes().hex() for name in lacking)
    return "\n".join((_git("diff", "HEAD", "--", *paths), *lacking, *texts)).strip()


@cache
def run_sources() -> tuple[str, ...]:
    """The sources that a run of a plant passes through, as the table of pages has them."""
    return tuple(tomllib.loads((ROOT / "benchmarks" / "pages.toml").read_text("utf-8"))["everything"])


def kept(name: str) -> Path:
    """Folder of what was measured of ``name`` for the present sources: a measurement that stopped goes on there."""
    return Path("runs") / "results" / name / commit()


def yardstick_s(times: int = 5) -> float:
    """Median CPU time of a fixed computation on this host [s]: two million steps of a congruential generator."""
    found = []
    for _ in range(times):
        began, x = time.process_time(), 1
        for _ in range(2_000_000):
            x = (x * 1_103_515_245 + 12_345) & 0x7FFFFFFF
        found.append(time.process_time() - began)
    return median(found)


def host() -> dict[str, Any]:
    """What it was measured on, and how busy that was."""
    return {
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "yardstick_s": yardstick_s(),
        "load": round(os.getloadavg()[0], 1),
    }


def measured_on(*paths: str) -> str:
    """A sentence for a page; ``paths`` are those whose last commit it names, the sources by default."""
    here, last = host(), commit(*paths)
    return (
        f"Measured for the sources of `{last}` with Python {here['python']} on {here['cores']} cores. Yardstick\n"
        f"of the host: two million steps of a congruential generator take {here['yardstick_s']:.3f} s there."
    )


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()
