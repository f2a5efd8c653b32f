"""Runs with everything on: each is run once, and kept with others of its kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TypeAlias

from benchmarks.unknown import store
from benchmarks.unknown.causes import HARMLESS
from benchmarks.unknown.forced import Forced, forced
from benchmarks.unknown.jobs import DAY, LABELLED, PAIRED, UNKNOWN, Job, to_operate
from benchmarks.unknown.operated import Operated, operated
from benchmarks.unknown.pairs import Paired, paired
from benchmarks.unknown.store import keep, kept
from benchmarks.unknown.workers import each

Result: TypeAlias = Operated | Paired | Forced
"""What is kept of one run."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Runs that are made and kept alike."""

    kept_as: str
    """What the store calls it."""
    parts: tuple[str, ...]
    """Parts of the study that are of it."""
    made_by: Callable[[Job], Result]
    """Makes one run."""
    made: type[Operated] | type[Paired] | type[Forced]
    """What comes of it."""


KINDS = (
    Kind(store.OPERATED, (UNKNOWN, HARMLESS, DAY), operated, Operated),
    Kind(store.PAIRED, (PAIRED,), paired, Paired),
    Kind(store.FORCED, (LABELLED,), forced, Forced),
)


def operate(wanted: Sequence[Job], processes: int = 1) -> None:
    """Run every one of ``wanted`` that is run with everything on and is not in yet."""
    there = results(wanted)
    for kind in KINDS:
        todo = [job for job in to_operate(wanted) if job.part in kind.parts and job.name not in there]
        for job, one in each(kind.made_by, todo, processes):
            keep(kind.kept_as, job, asdict(one))
            print(told(one), flush=True)


def results(wanted: Sequence[Job]) -> Mapping[str, Result]:
    """Run -> what came of it, of every one of ``wanted`` that is in for the present sources, in their order."""
    found: dict[str, Result] = {}
    for kind in KINDS:
        mine = [job for job in wanted if job.part in kind.parts]
        found |= {job.name: kind.made(**row) for job, row in kept(kind.kept_as, mine)}
    return {job.name: found[job.name] for job in wanted if job.name in found}


def told(one: Result) -> str:
    """A line for whoever waits."""
    match one:
        case Operated():
            what = (
                f"{one.longer_outside_s:+.0f} s outside, {one.writes} writes, {one.alarms} alarms, "
                f"{', '.join(one.names) or 'no name'}"
            )
        case Paired():
            what = f"outside {', '.join(one.outside) or 'nothing'}, kept by {one.kept_by or 'nothing that was tried'}"
            what = f"{what}, {one.tried_cpu_s:.0f} s" if one.outside else "every hard limit kept"
        case Forced():
            caught = f", {'' if one.caught else 'not '}caught" if one.outside else ""
            what = f"{one.releases} releases, {one.outside_s:.0f} s outside after the first{caught}"
    return f"{one.run}: {one.outcome}, {what}; {one.cpu_s:.0f} s"
