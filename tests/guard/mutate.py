"""Are the guard's tests worth anything? Every small change to the guard must make one of them fail.

``python -m tests.guard.mutate`` makes one mutant after the other of ``homeostat/guard/*.py`` (`tests.guard.mutants`)
and names those that survive the fast tests of the guard. The tests are collected once, and each is run once to see
which lines it reaches; a child process then gives the functions of the guard the mutant's code and runs the tests that
reach its line until one fails, those of the mutant's own module first. ``--sample`` takes so many of the mutants at
random. ``--area recovery`` does the same with the loop of recovery and its tests.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from _pytest.runner import runtestprotocol

from tests.guard.equivalent import EQUIVALENT
from tests.guard.infection import infect
from tests.guard.mutants import SOURCES, Mutant, mutants
from tests.guard.reach import Reach, reach_of

REPO = SOURCES.parent
SAFETY_LAYER = SOURCES / "homeostat" / "guard"


def name_in(package: Path, file: Path) -> str:
    """Name of the module in ``file`` below ``package``, with dots."""
    return ".".join(file.relative_to(package).with_suffix("").parts)


def file_of(package: Path, name: str) -> Path:
    """File of the module ``name`` below ``package``."""
    return package.joinpath(*name.split(".")).with_suffix(".py")


@dataclass(frozen=True)
class Area:
    """Modules that are mutated together, and the tests that must notice."""

    package: str
    """Name of the package below ``homeostat``."""
    modules: tuple[str, ...]
    """Names of the modules."""
    tests: tuple[str, ...]
    """Their fast tests, below ``tests``."""


SLOW = {"kills", "mutants", "on_links", "random_requests"}
"""Tests of the guard that take too long to be run for every mutant."""
AREAS = {
    "guard": Area(
        "guard",
        tuple(sorted(name_in(SAFETY_LAYER, p) for p in SAFETY_LAYER.rglob("[!_]*.py"))),
        tuple(
            f"guard/{p.name}"
            for p in sorted((REPO / "tests" / "guard").glob("test_*.py"))
            if p.stem.removeprefix("test_") not in SLOW
        ),
    ),
    "recovery": Area(
        "recovery",
        ("supervisor", "agenda", "endings", "look.news", "look.prospect"),
        tuple(
            f"recovery/test_{name}.py"
            for name in (
                "supervisor",
                "agenda",
                "prospect",
                "recovery",
                "deviation",
                "news",
                "thinking",
                "deadline",
                "proposers",
            )
        ),
    ),
}
NEAREST = {
    "lane": "blocking_links", "bounded": "blocking_links",
    "persons": "orders", "verification": "refusals", "seal": "verification", "mailbox": "sizes", "hearing": "sizes",
    "texts": "sizes", "wanted": "time_to_act", "response": "effect",
}  # fmt: skip
"""Module of the guard -> the tests that look at it most closely, where they do not have its name."""
CPU_LIMIT_S, STILL_S = 60.0, 15.0
"""A mutant that computes for longer, or stands still for so long, counts as noticed [s]."""

Infection = tuple[Callable[[], None], Sequence[pytest.Item]]
"""What changes the code, and the tests that are asked."""


@functools.cache
def everywhere() -> frozenset[tuple[str, str]]:
    """(line of source, change) of every mutant of every area."""
    areas = [(SOURCES / "homeostat" / area.package, area.modules) for area in AREAS.values()]
    return frozenset((m.source, m.change) for at, names in areas for n in names for m in mutants(file_of(at, n)))


def is_equivalent(mutant: Mutant) -> bool:
    """Whether nobody can tell it from the original, with a reason."""
    return (mutant.source, mutant.change) in EQUIVALENT


class Trial:
    """A pytest plugin that runs the collected tests once as they are and once per mutant."""

    def __init__(self, asked: Sequence[Mutant], every: Sequence[Mutant], workers: int) -> None:
        """``every``: all mutants that there are of the modules, where not all of them are asked."""
        self._mutants, self._every, self._workers = asked, every, workers
        self.report = "no test was collected"
        self.good = False

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        started, asked = time.monotonic(), self._mutants
        if not session.items or session.testsfailed or not _passes(session.items):
            self.report = "the safety tests fail on the original; nothing can be said about mutants"
            return True
        names = {m.module for m in asked}
        reaches = {item: reach_of(functools.partial(_fails, item), names) for item in session.items}
        infections = [(functools.partial(infect, m), _asked(m, reaches)) for m in asked]
        dead = noticed(infections, self._workers, survived=lambda n: print(f"survived: {asked[n]}", flush=True))
        stale = [key for key in EQUIVALENT if key not in everywhere()]
        lines = [f"EQUIVALENT names a mutant that there is not: {change}    {source}" for source, change in stale]
        seconds = time.monotonic() - started
        for module in dict.fromkeys(m.module for m in self._every):
            found = [d for m, d in zip(asked, dead, strict=True) if m.module == module]
            equivalent = sum(m.module == module and is_equivalent(m) for m in self._every)
            lines.append(f"{module}: {sum(found)} of {len(found)} mutants noticed, {equivalent} equivalent ones")
        lines.append(f"{sum(dead)} of {len(asked)} mutants noticed (there are {len(self._every)}), {seconds:.0f} s")
        self.report, self.good = "\n".join(lines), bool(asked) and all(dead) and not stale
        return True


def _asked(mutant: Mutant, reaches: dict[pytest.Item, Reach]) -> list[pytest.Item]:
    """The tests that run the mutant's lines: those of its module first, the quick before the slow."""
    module = mutant.module.rpartition(".")[2]
    near = f"test_{NEAREST.get(module, module)}.py"
    meeting = [item for item, reach in reaches.items() if reach.meets(mutant.module, mutant.lines)]
    return sorted(meeting, key=lambda item: (item.path.name != near, reaches[item].lasts_s))


def _passes(items: Sequence[pytest.Item], attempts: int = 3) -> bool:
    """Whether the original passes its tests; on a busy machine one that looks at the clock may need another attempt."""
    return any(noticed([(lambda: None, items)], 1) == [False] for _ in range(attempts))


def noticed(
    infections: Sequence[Infection], workers: int, survived: Callable[[int], None] = lambda number: None
) -> list[bool]:
    """For each infection, whether one of its tests fails in a child process that has it; each other one is told."""
    results = [False] * len(infections)
    waiting = list(enumerate(infections))[::-1]
    running: dict[int, tuple[int, Progress]] = {}
    while waiting or running:
        while waiting and len(running) < workers:
            index, (infection, items) = waiting.pop()
            child = _tested(infection, items)
            running[child] = index, Progress(child)
        for child, (index, progress) in list(running.items()):
            if progress.is_over():
                os.kill(child, signal.SIGKILL)
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                results[index] = os.waitstatus_to_exitcode(status) != 0
                if not results[index]:
                    survived(index)
                del running[child]
        time.sleep(0.005)
    return results


class Progress:
    """Whether a child process still gets on with its tests."""

    def __init__(self, child: int) -> None:
        self._process = psutil.Process(child)
        self._used_s, self._moved_s = 0.0, time.monotonic()
        self._next_s = self._moved_s

    def is_over(self) -> bool:
        """True where the process used up its time, or none of it for too long."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return False
        self._next_s = now_s + 0.5
        used_s = sum(self._process.cpu_times()[:2])
        if used_s > self._used_s + 0.02:
            self._used_s, self._moved_s = used_s, now_s
        return used_s > CPU_LIMIT_S or now_s - self._moved_s > STILL_S


def _tested(infection: Callable[[], None], items: Sequence[pytest.Item]) -> int:
    """Start a child process that runs the tests until one fails; its exit status is 0 where none does."""
    child = os.fork()
    if child:
        return child
    failed = True
    try:
        infection()
        failed = any(_fails(item) for item in items)
    finally:
        os._exit(failed)


def _fails(item: pytest.Item) -> bool:
    return any(report.failed for report in runtestprotocol(item, log=False, nextitem=None))


def main(arguments: list[str] | None = None) -> int:
    """Print what survived; 0 where nothing did."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--area", choices=sorted(AREAS), default="guard")
    parser.add_argument("--modules", nargs="+", help="only these modules of the area")
    parser.add_argument("--lines", nargs="+", type=int, help="only these lines of the modules")
    parser.add_argument("--tests", nargs="+", help="these tests instead of the area's")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    area = AREAS[chosen.area]
    os.chdir(REPO)
    os.environ.pop("PYTEST_ADDOPTS", None)  # they are for whoever started this
    modules, tests = chosen.modules or area.modules, chosen.tests or area.tests
    if unknown := [name for name in modules if name not in area.modules]:
        parser.error(f"area {chosen.area!r} has no module {unknown[0]!r}; it has {', '.join(area.modules)}")
    for module in modules:
        importlib.import_module(f"homeostat.{area.package}.{module}")
    every = [m for name in modules for m in mutants(file_of(SOURCES / "homeostat" / area.package, name))]
    asked = [m for m in every if not is_equivalent(m) and m.line in (chosen.lines or [m.line])]
    if chosen.sample:
        asked = random.Random(chosen.seed).sample(asked, min(chosen.sample, len(asked)))
    trial = Trial(asked, every, chosen.workers)
    options = ["-s", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:terminal"]
    pytest.main([*options, *(str(REPO / "tests" / name) for name in tests)], plugins=[trial])
    print(trial.report)
    return 0 if trial.good else 1


if __name__ == "__main__":
    sys.path[:0] = [str(SOURCES)]
    sys.exit(main())
