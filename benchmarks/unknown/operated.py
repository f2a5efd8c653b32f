"""Runs with everything on: whether acting on what is not known does harm that doing nothing would not."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks.unknown.jobs import Job, scenario_of
from benchmarks.unknown.judge import named
from benchmarks.unknown.looks import said
from benchmarks.unknown.workers import plant_named
from homeostat.domain.diagnosis import by_fault_set
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import Diagnosed
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.links.clock import DeclaredClock

THINKING_S = 1.0
"""Declared time of each deliberation, so that figures do not depend on the host [s]."""


@dataclass(frozen=True, slots=True)
class Operated:
    """One run with guard and recovery, and the same plant left alone."""

    run: str
    """Name of the run."""
    longer_outside_s: float
    """Longest time that it is longer outside a hard limit than if left alone [s]; negative where it is shorter."""
    alone_safe: bool
    """Whether the plant that is left alone keeps every hard limit."""
    lost_more: float
    """Production that it loses more than if left alone, as a share of the fault-free one [1]; NaN for none to make."""
    writes: int
    """Requests and fallbacks that were sent."""
    alarms: int
    """Alarms that were raised."""
    diagnoses: int
    """How often something was said to be wrong; that nothing explains a symptom is not counted."""
    names: tuple[str, ...]
    """Faults that were named at 0.5 or more."""
    outcome: str
    """How it ended."""
    cpu_s: float
    """Processor time of the run with everything on [s]."""


def operated(job: Job) -> Operated:
    """Run ``job`` with everything on, and leave the same plant alone."""
    plant, began = plant_named(job.plant), time.process_time()
    truth = scenario_of(plant, job)
    acted = run(plant, truth, clock=DeclaredClock(THINKING_S))
    cpu_s = time.process_time() - began
    left = run(plant, truth, clock=DeclaredClock(THINKING_S), proposing=Proposing(propose=None))
    alone_s, mine_s = _outside_s(left), _outside_s(acted)
    writes = [e for e in acted.record.of_kind(WriteIntended) if e.cause in (Cause.REQUEST, Cause.FALLBACK)]
    diagnosed = acted.record.of_kind(Diagnosed)
    names = {n: None for e in diagnosed for n in named(said(plant, e.hypotheses))}
    return Operated(
        job.name,
        max((mine_s[limit] - alone_s[limit] for limit in alone_s), default=0.0),
        not any(alone_s.values()),
        acted.production_loss - left.production_loss,
        len({e.write for e in writes}),
        len(acted.record.of_kind(AlarmRaised)),
        sum(_says_wrong(e) for e in diagnosed),
        tuple(names),
        acted.outcome.value,
        cpu_s,
    )


def _says_wrong(event: Diagnosed) -> bool:
    """Whether the likeliest answer is that something is wrong."""
    sets = by_fault_set(event.hypotheses)
    return bool(sets) and bool(sets[0].faults)


def _outside_s(one: Run) -> dict[str, float]:
    """Hard limit -> how long the true plant was outside it [s]."""
    hard = {limit.name for limit in one.plant.description.limits.hard}
    return {e.limit: e.total_s for e in one.exposures if e.limit in hard}


def longer(found: Iterable[Operated], by_s: float = 10.0) -> tuple[Operated, ...]:
    """Runs that are longer outside a hard limit than if left alone, by more than ``by_s`` [s]."""
    return tuple(one for one in found if one.longer_outside_s > by_s)


def poorer(found: Iterable[Operated], by: float) -> tuple[Operated, ...]:
    """Runs that lose more production than if left alone, by more than ``by`` [1], where that is safe."""
    return tuple(one for one in found if one.alone_safe and math.isfinite(one.lost_more) and one.lost_more > by)
