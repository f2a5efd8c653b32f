"""What a plant in a folder takes and gives: ``python -m benchmarks.plants.two_tanks`` writes the page of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.host import ROOT, commit, measured_on
from benchmarks.plants.__main__ import TITLE
from benchmarks.plants.kernels import MEMBERS, SECONDS, compared
from benchmarks.plants.page import PAGE, section
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.links.clock import DeclaredClock
from homeostat.plants.learning import learned
from homeostat.plants.plant import Plant, load_plant

EXAMPLE = ROOT / "examples" / "two_tanks"
HEAD = """# A plant from a folder

Made by `python -m benchmarks.plants.two_tanks` for the sources of `{commit}`.

## Two heated tanks

`examples/two_tanks`: {model} lines of physics, {lines} lines in all, comments included; asked for: at most 25
and 260. From them follow {states} states, {parameters} parameters, {tags} tags and {faults} faults. A process
that has no machine code and no graph yet has the plant ready after {ready:.1f} s (asked for: 10 s), one that
has them after {again:.1f} s.

Every fault at the size that its table calls typical, seed 1, from 2000 s on, thinking declared as one second,
the true plant with the equations of the model and its own parameters. *Held*: nothing is produced, and the
plant may go on when it is repaired.
*Needless action*: no limit would have been violated with nobody acting. A negative loss is more than by design:
more is fed, to carry heat away or because a valve is open.

| fault | outcome | detected after | first release after | lost of the production | outside a hard limit |
|---|---|---|---|---|---|
"""
KERNELS = """
## Kernels side by side

The reactor put together from blocks (`benchmarks/plants/kernels.py`) beside the hand-written one: {members}
members over {seconds} s on one thread, with noise, in turns, medians. Hand-written {hand:.2f} s, from blocks
{blocks:.2f} s: {ratio:.2f} times as long; asked for: at most 1.3.

{mistakes}## Not measured yet

Three further small plants, the shipped plants on blocks, and causes that a person named.

"""


def main() -> None:
    """Run the plant with each of its faults, time what is timed, and write the page."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "two_tanks"
        shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("plant.ttl", "baseline.csv"))
        cold, warm = (_ready_s(folder, Path(scratch) / "cache") for _ in range(2))
        plant = load_plant(str(folder), learned=False)
        (folder / "baseline.csv").write_bytes(learned(plant))
        plant = load_plant(str(folder))
        rows = [_row(plant, name) for name in plant.model.faults]
    written = [p for p in EXAMPLE.rglob("*") if p.suffix in (".py", ".csv", ".toml") and p.name != "baseline.csv"]
    lines = {path.name: len(path.read_text("utf-8").splitlines()) for path in written}
    sources = commit("src", "examples", "benchmarks/plants")
    head = HEAD.format(
        commit=sources, model=lines["process.py"], lines=sum(lines.values()), states=len(plant.model.states),
        parameters=len(plant.model.parameters), tags=len(plant.description.tags), faults=len(rows), ready=cold,
        again=warm,
    )  # fmt: skip
    beside = compared()
    told = KERNELS.format(
        mistakes=section(PAGE.read_text("utf-8"), TITLE),
        members=MEMBERS,
        seconds=SECONDS,
        hand=beside.hand_written_s,
        blocks=beside.from_blocks_s,
        ratio=beside.ratio,
    )
    PAGE.write_text(head + "\n".join(rows) + "\n" + told + measured_on() + "\n", encoding="utf-8")


def _ready_s(folder: Path, cache: Path) -> float:
    """Wall-clock time of a process that loads the plant and its kernel [s]."""
    load = f"load_plant({str(folder)!r}, learned=False).model.kernel.load()"
    code = f"from homeostat.plants.plant import load_plant; {load}"
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ | {"NUMBA_CACHE_DIR": str(cache)})
    return time.perf_counter() - begun


def _row(plant: Plant, fault: str) -> str:
    """What became of the plant with ``fault``, as a row of the page."""
    done = run(plant, scenario_of(plant, [Fault(fault)], seed=1), clock=DeclaredClock(1.0)).result(Path())
    outside = sum(each.total_s for each in done.limit_exposure_s)
    lost = "none" if done.production_loss is None else f"{100.0 * done.production_loss:.1f} %"
    after = [
        "none" if at_s is None or done.onset_s is None else f"{at_s - done.onset_s:.0f} s"
        for at_s in (done.detected_s, done.released_s)
    ]
    return f"| {fault} | {done.outcome.value.replace('_', ' ')} | {after[0]} | {after[1]} | {lost} | {outside:.0f} s |"


if __name__ == "__main__":
    main()
