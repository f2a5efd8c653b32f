"""What plants in folders take and give: ``python -m benchmarks.plants.examples [NAME ...]`` writes their page.

With names it runs these examples only, and prints what the page would say of them.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.host import ROOT, commit, measured_on
from benchmarks.plants.__main__ import TITLE as MISTAKES
from benchmarks.plants.adopted import TITLE as ADOPTED
from benchmarks.plants.kernels import MEMBERS, SECONDS, compared
from benchmarks.plants.page import LAST, PAGE, section
from benchmarks.plants.shipped import TITLE as SHIPPED
from benchmarks.plants.shipped import told as shipped
from benchmarks.ready import ready_s
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.learning import learned

EXAMPLES = ROOT / "examples"
GENERATED = ("plant.ttl", "baseline.csv")
HEAD = """# A plant from a folder

Made by `python -m benchmarks.plants.examples` for the sources of `{commit}`.

## Examples

Folders in `examples/`, each written from the guide. *Lines*: tables, settings and model, comments included;
asked for: at most 260 of the two tanks, of which at most 25 of physics, and 300 of each other one. *Outside*: of
a hard limit, all faults together. *Ready*: from
nothing to a plant with its kernel, in a process that has no machine code and no graph yet (asked for: 10 s), and in
one that has them.

| example | physics | lines | states | parameters | tags | faults | looked after | outside | ready | again |
|---|---|---|---|---|---|---|---|---|---|---|
"""
FAULTS = """
Every fault at the size that its table calls typical, seed 1, from the moment on that the plant's settings state,
thinking declared as one second, the true plant with the equations of the model and its own parameters. *Held*:
next to nothing is produced, and the plant may go on when it is repaired. *Needless action*: no limit would have been
violated with nobody acting, and it would have cost no more. A negative loss is more than by design. *Looked after*:
neither was a limit left, nor did the fallback have to act; {fallbacks}.
"""
ROWS = """
### {title}

| fault | outcome | detected after | first release after | lost of the production | outside a hard limit |
|---|---|---|---|---|---|
"""
KERNELS = """
## Kernels side by side

The reactor put together from blocks (`benchmarks/plants/kernels.py`) beside the hand-written one: {members}
members over {seconds} s on one thread, with noise, in turns, medians. Hand-written {hand:.2f} s, from blocks
{blocks:.2f} s: {ratio:.2f} times as long; asked for: at most 1.3.

## {shipped_title}

{shipped}

{others}## {last}

"""


@dataclass(frozen=True)
class Ended:
    """What became of a plant with one fault."""

    fault: str
    """Its name."""
    outcome: Outcome
    """How the run ended."""
    after_s: tuple[float | None, float | None]
    """From its onset to its detection and to the first release [s]; None for never."""
    lost: float | None
    """Share of the production [1]."""
    outside_s: float
    """Time outside hard limits [s]."""

    @property
    def looked_after(self) -> bool:
        """Whether no limit was left and no fallback had to act."""
        return self.outside_s == 0.0 and self.outcome not in (Outcome.FALLBACK, Outcome.LIMIT_VIOLATED)

    @property
    def row(self) -> str:
        """Its row of the page."""
        lost = "none" if self.lost is None else f"{100.0 * self.lost:.1f} %"
        after = " | ".join("none" if s is None else f"{s:.0f} s" for s in self.after_s)
        return f"| {self.fault} | {self.outcome.value.replace('_', ' ')} | {after} | {lost} | {self.outside_s:.0f} s |"


@dataclass(frozen=True)
class Example:
    """One plant, measured."""

    name: str
    """Its folder."""
    plant: Plant
    """It, with reference values."""
    lines: tuple[int, int]
    """Of its model, and of everything that somebody wrote."""
    ready_s: tuple[float, float]
    """What a process takes to have it ready, the first and the second time [s]."""
    ends: tuple[Ended, ...]
    """What became of it with each of its faults."""

    @property
    def row(self) -> str:
        """Its row of the page."""
        model, d = self.plant.model, self.plant.description
        counts = (*self.lines, len(model.states), len(model.parameters), len(d.tags), len(self.ends))
        kept = f"{sum(end.looked_after for end in self.ends)} of {len(self.ends)}"
        outside = f"{sum(end.outside_s for end in self.ends):.0f} s"
        ready = " | ".join(f"{seconds:.1f} s" for seconds in self.ready_s)
        return f"| `{self.name}` | {' | '.join(map(str, counts))} | {kept} | {outside} | {ready} |"

    @property
    def table(self) -> str:
        """What became of it, fault by fault."""
        return ROWS.format(title=self.plant.title) + "\n".join(end.row for end in self.ends) + "\n"


def main() -> None:
    """Run the examples, and write the page where it is about all of them."""
    every = sorted(folder.name for folder in EXAMPLES.iterdir() if (folder / "case.toml").exists())
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plants.examples", description=main.__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(every)}; all by default")
    names = parser.parse_args().names
    if unknown := sorted({*names} - {*every}):
        parser.error(f"no example is called {', '.join(map(repr, unknown))}; there are {', '.join(every)}")
    made = [measured(name) for name in names or every]
    told = "\n".join(example.row for example in made) + "\n" + FAULTS.format(fallbacks=_fallbacks(made))
    told += "".join(example.table for example in made)
    if names:
        print(told)
        return
    beside = compared()
    told += KERNELS.format(
        others="".join(section(PAGE.read_text("utf-8"), title) for title in (MISTAKES, ADOPTED)),
        members=MEMBERS,
        seconds=SECONDS,
        hand=beside.hand_written_s,
        blocks=beside.from_blocks_s,
        ratio=beside.ratio,
        shipped_title=SHIPPED,
        shipped=shipped(),
        last=LAST,
    )
    head = HEAD.format(commit=commit("src", "examples", "benchmarks/plants"))
    PAGE.write_text(head + told + measured_on() + "\n", encoding="utf-8")


def measured(name: str) -> Example:
    """The example ``name`` in a folder of its own: made ready twice, learned, and run with each of its faults."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / name
        shutil.copytree(EXAMPLES / name, folder, ignore=shutil.ignore_patterns(*GENERATED))
        cache = Path(scratch) / "cache"
        took_s = ready_s(str(folder), cache), ready_s(str(folder), cache)
        (folder / "baseline.csv").write_bytes(learned(load_plant(str(folder), learned=False)))
        plant = load_plant(str(folder))
        ends = tuple(_ended(plant, fault) for fault in plant.model.faults)
    return Example(name, plant, _lines(EXAMPLES / name), took_s, ends)


def _lines(folder: Path) -> tuple[int, int]:
    written = [p for p in folder.rglob("*") if p.suffix in (".py", ".csv", ".toml") and p.name not in GENERATED]
    lines = {path.name: len(path.read_text("utf-8").splitlines()) for path in written}
    return lines["process.py"], sum(lines.values())


def _ended(plant: Plant, fault: str) -> Ended:
    done = run(plant, scenario_of(plant, [Fault(fault)], seed=1), clock=DeclaredClock(1.0)).result(Path())
    after = [None if at_s is None or done.onset_s is None else at_s - done.onset_s
             for at_s in (done.detected_s, done.released_s)]  # fmt: skip
    hard = {limit.name for limit in plant.description.limits.hard}
    outside_s = sum(each.total_s for each in done.limit_exposure_s if each.limit in hard)
    return Ended(fault, done.outcome, (after[0], after[1]), done.production_loss, outside_s)


def _fallbacks(made: Sequence[Example]) -> str:
    """How often a fallback was what was left."""
    found = Counter(example.name for example in made for end in example.ends if not end.looked_after)
    return ", ".join(f"{n} of `{name}` were not" for name, n in found.items()) or "all were"


if __name__ == "__main__":
    main()
