"""Make ``docs/results/console.md``: ``python -m benchmarks.console``; it takes three minutes."""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template
from typing import Any, Final

from benchmarks.console.browser import chromium
from benchmarks.console.runs import served
from benchmarks.console.speed import PANS, WATCHED_S, WATCHERS
from benchmarks.host import kept, measured_on

HERE: Final = Path(__file__).parent
PAGE: Final = HERE.parents[1] / "docs" / "results" / "console.md"
PICTURE: Final = HERE.parents[1] / "docs" / "images" / "console.png"
RUN: Final = ("cstr", "--fault", "cool_stuck_closed", "--onset", "900", "--end", "1050")


def claims(found: Mapping[str, Any], packed: int) -> Iterator[str]:
    """Rows of the table."""
    panned, painted, watched = found["panned"], found["painted"], found["watched"]
    told = (
        ("Script of a step while a day of 5 tags is panned", "<= 8 ms", panned["script_per_pan_ms"], 8.0, "ms"),
        ("First paint", "<= 1 s", painted["paint_ms"], 1000.0, f"ms, {painted['paint_most_ms']} ms at most"),
        (f"{WATCHERS} watchers", "<= 0.1 core", watched["cores"], 0.1, "cores"),
        ("The page, compressed", "< 120 kB", round(packed / 1000.0, 1), 120.0, "kB"),
    )
    for what, bar, measured, most, unit in told:
        yield f"| {what} | {bar} | {measured} {unit} | {'yes' if measured <= most else '**no**'} |"


def looked() -> Iterator[str]:
    """Rows of what was seen on pictures."""
    with (HERE / "looked.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            yield f"| {' | '.join(row.values())} |"


def measured(folder: Path) -> dict[str, Any]:
    """What the present sources come to; what was measured for them before is read back."""
    there = folder / "speed.json"
    if not there.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        run = folder / "run"
        command = [sys.executable, "-m", "homeostat", "run", *RUN, "--out", str(run)]
        if not run.is_dir():
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        speed = [sys.executable, "-m", "benchmarks.console.speed", str(run)]
        there.write_text(subprocess.run(speed, check=True, capture_output=True, text=True).stdout, encoding="utf-8")
    found: dict[str, Any] = json.loads(there.read_text(encoding="utf-8"))
    return found


def picture(run_dir: Path) -> None:
    """The page at the moment at which something was first decided, for the documentation."""
    with served(run_dir) as (address, _), chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 960}, color_scheme="light")
        page.goto(address)
        page.wait_for_selector(".trend canvas")
        page.wait_for_timeout(1500)
        page.screenshot(path=PICTURE)


def text(found: Mapping[str, Any], packed: int) -> str:
    """The page."""
    return Template((HERE / "console.md").read_text(encoding="utf-8")).substitute(
        measured=measured_on(),
        claims="\n".join(claims(found, packed)),
        looked="\n".join(looked()),
        pans=PANS,
        per_frame=found["panned"]["script_ms"],
        answers=found["painted"]["answers_ms"],
        seconds=f"{WATCHED_S:g}",
        bytes=found["watched"]["bytes_each_s"],
        alone=found["watched"]["cores_alone"],
        load=found["load"],
    )


def main() -> None:
    """Measure and write."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    import gzip

    static = HERE.parents[1] / "src" / "homeostat" / "console" / "server" / "static"
    packed = sum(len(gzip.compress(path.read_bytes())) for path in static.iterdir() if path.suffix != ".txt")
    folder = kept("console")
    PAGE.write_text(text(measured(folder), packed), encoding="utf-8")
    picture(folder / "run")


if __name__ == "__main__":
    main()
