"""The bars of the study, each beside its figure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import median

from benchmarks.unknown.causes import HARMLESS, HEALTHY, KNOWN
from benchmarks.unknown.forced import Forced
from benchmarks.unknown.jobs import DAY, LABELLED, LOOKED_AT, LOOKS_S, PAIRED, UNKNOWN, Job, to_operate
from benchmarks.unknown.judge import LEAST_COUNT, reliability
from benchmarks.unknown.operated import Operated, longer, poorer
from benchmarks.unknown.pairs import Paired
from benchmarks.unknown.running import Result
from benchmarks.unknown.sizes import NOMINAL, Sized, sized
from benchmarks.unknown.tally import (
    SLOW,
    SLOW_AFTER_S,
    Look,
    Share,
    of_runs,
    right_from,
    severity_errors,
    statements,
    with_a_name,
)
from homeostat.domain.diagnosis import FaultMode
from homeostat.evaluate.score.scoring import SAME_LOSS
from homeostat.plants.plant import Plant

LIKELY = (0.85, 1.0)
"""What counts as said with 90 % [1]."""
LATER_S = 240
"""When known faults are looked at again, after the first symptom [s]."""
MOST_CPU_S = {"cstr": 10.0}
"""Plant -> what a run of 6,000 s with one cause may take of the processor, without start and figure [s]."""
WITHIN = 0.05
"""How far a share may be from the probability that is stated [1]."""


class Study:
    """What was measured of one plant."""

    def __init__(
        self, plant: Plant, jobs: Sequence[Job], looks: Sequence[Look], results: Sequence[Result] = ()
    ) -> None:
        """``jobs``: every run that was asked for; ``looks``, ``results`` of runs with everything on: what is in."""
        self.plant, self.jobs, self.looks, self._results = plant, jobs, looks, results

    @property
    def title(self) -> str:
        """What the page calls it."""
        return {"cstr": "Reactor", "mixing_module": "Mixing Module"}.get(self.plant.name, self.plant.name)

    def part(self, name: str) -> list[Look]:
        """Looks of one part."""
        return [x for x in self.looks if x.job.part == name]

    def truly_unknown(self) -> list[Look]:
        """Looks at causes that are in no row of the fault list."""
        return [x for x in self.part(UNKNOWN) if not x.job.cause.known]

    def operated(self, name: str) -> list[Operated]:
        """Runs of one part with everything on; of unknown causes only those that are truly unknown.

        What is called harmless and violates something with nobody acting is left out.
        """
        return [one for one in self._of(name) if isinstance(one, Operated) and one.run not in self.harmful]

    @cached_property
    def harmful(self) -> frozenset[str]:
        """Runs of what is called harmless that violate something with nobody acting."""
        return frozenset(x.judged.run for x in self.looks if x.judged.violated)

    @property
    def paired(self) -> list[Paired]:
        """Runs with two faults."""
        return [one for one in self._of(PAIRED) if isinstance(one, Paired)]

    @property
    def forced(self) -> list[Forced]:
        """Runs with a wrong label."""
        return [one for one in self._of(LABELLED) if isinstance(one, Forced)]

    @cached_property
    def sizes(self) -> list[Sized]:
        """Sizes that were said of what is truly there."""
        return list(sized(self.plant, self.looks))

    def _of(self, name: str) -> list[Result]:
        mine = self._to_operate(name)
        return [one for one in self._results if one.run in mine]

    def _to_operate(self, name: str) -> set[str]:
        return {job.name for job in to_operate(self.jobs) if job.part == name}

    def runs(self, name: str) -> str:
        """How many runs of a part are in."""
        return _in(self.looks, [j for j in self.jobs if j.part == name])

    def runs_operated(self, name: str) -> str:
        """The same of those with everything on."""
        return f"{len(self._of(name))} of {len(self._to_operate(name))}"

    @property
    def runs_looked_at(self) -> str:
        """How many of all runs that are looked at are in."""
        return _in(self.looks, [j for j in self.jobs if j.part in LOOKED_AT])


@dataclass(frozen=True, slots=True)
class Bar:
    """One thing that was asked for."""

    text: str
    """What."""
    asked: str
    """The bar."""
    measured: str
    """The figure."""
    met: bool
    """Whether the figure meets the bar."""
    runs: str
    """How many of its runs are in, 'N of M'."""

    @property
    def judgement(self) -> str:
        """As a page has it; nobody can tell where nothing is in."""
        there, _, wanted = self.runs.partition(" of ")
        if there == "0":
            return "not measured"
        return ("yes" if there == wanted else "so far") if self.met else "**no**"


def bars(study: Study) -> Iterator[Bar]:
    """Every bar of one plant."""
    yield from _of_unknown(study)
    yield from _of_known(study)
    yield from _of_calibration(study)
    yield from _of_operation(study)
    yield from _of_several(study)
    for part, text in ((HARMLESS, "harmless runs"), (HEALTHY, "fault-free runs")):
        named = with_a_name(study.part(part))
        yield _none(f"{text} with a name at 0.5 or more, nobody acting", len(named), study.runs(part))


def _none(text: str, found: int, runs: str) -> Bar:
    """A bar that nothing may exceed."""
    return Bar(text, "0", str(found), not found, runs)


def _at_most(text: str, most: float, found: Share, runs: str) -> Bar:
    return Bar(text, f"<= {100 * most:.0f} %", str(found), found.value <= most, runs)


def _at_least(text: str, least: float, found: Share, runs: str) -> Bar:
    return Bar(text, f">= {100 * least:.0f} %", str(found), found.value >= least, runs)


def _of_unknown(study: Study) -> Iterator[Bar]:
    looks, second_s, runs = study.truly_unknown(), LOOKS_S[study.plant.name][1], study.runs(UNKNOWN)
    wrong = Share.that((x for x in looks if x.looked), lambda x: x.bad)
    yield _at_most("looks at unknown causes that say something wrong at 0.9 or more", 0.05, wrong, runs)
    yield _at_least(f"right where noticeable, from +{second_s} s on", 0.9, right_from(looks, second_s), runs)
    hidden = [x for x in looks if not x.job.cause.measured]
    text = f"the same without what acts on an input or a command that is shown, from +{second_s} s on"
    yield _at_least(text, 0.9, right_from(hidden, second_s), runs)


def _of_known(study: Study) -> Iterator[Bar]:
    known, runs = study.part(KNOWN), study.runs(KNOWN)
    for at_s in (0, LATER_S):
        mine = [x for x in known if x.looked and x.judged.after_s == at_s]
        yield _at_least(f"known faults named at +{at_s} s", 0.85, Share.that(mine, lambda x: x.named), runs)
        yield _at_most(f"known faults taken for others at +{at_s} s", 0.02, Share.that(mine, lambda x: x.bad), runs)
    faults = study.plant.description.faults
    yield _severity("severity of known faults", [f for f in faults if f.name not in SLOW], known, runs)
    for fault in (f for f in faults if f.name in SLOW):
        yield _severity(f"severity of {fault.name} after {SLOW_AFTER_S} s", [fault], known, runs)


def _severity(text: str, faults: Sequence[FaultMode], looks: Sequence[Look], runs: str) -> Bar:
    errors = [e for f in faults for e in severity_errors(looks, f)]
    typical = median(errors) if errors else math.nan
    told = f"{100 * typical:.0f} % of the range, {len(errors)} stated" if errors else "none"
    return Bar(f"{text}, median error", "<= 10 % of the range", told, typical <= 0.1, runs)


def _of_calibration(study: Study) -> Iterator[Bar]:
    every, runs = statements(study.looks), study.runs_looked_at
    told = next(b for b in reliability(every) if (b.low, b.high) == LIKELY)
    text = f"{100 * told.right:.0f} % of {told.count} said with {100 * told.said:.0f} %" if told.count else "none"
    asked, as_often = f"+- {100 * WITHIN:.0f} % of what is said", abs(told.right - told.said) <= WITHIN
    yield Bar(f"what is said with {100 * LIKELY[0]:.0f} % or more is true as often", asked, text, as_often, runs)
    least = min(b.count for b in reliability(every))
    asked = f">= {LEAST_COUNT}"
    yield Bar("statements in every bin of the reliability diagram", asked, str(least), least >= LEAST_COUNT, runs)
    held = Share(len(study.sizes), sum(one.holds for one in study.sizes))
    asked = f"{100 * NOMINAL:.0f} +- {100 * WITHIN:.0f} %"
    yield Bar("intervals of sizes that hold the truth", asked, str(held), abs(held.value - NOMINAL) <= WITHIN, runs)


def _in(looks: Sequence[Look], jobs: Sequence[Job]) -> str:
    there, wanted = of_runs(looks, jobs)
    return f"{there} of {wanted}"


def _of_operation(study: Study) -> Iterator[Bar]:
    """Bars of runs with everything on."""
    unknown, runs = study.operated(UNKNOWN), study.runs_operated(UNKNOWN)
    yield _none("longer outside a hard limit than left alone, by more than 10 s", len(longer(unknown)), runs)
    poor = Share(sum(one.alone_safe for one in unknown), len(poorer(unknown, SAME_LOSS)))
    yield _at_most("runs that lose more production than left alone, where that is safe", 0.05, poor, runs)
    yield _none("the same by more than 10 points", len(poorer(unknown, 0.1)), runs)
    if (most_s := MOST_CPU_S.get(study.plant.name)) is not None:
        typical = median(one.cpu_s for one in unknown) if unknown else math.nan
        text = "processor time of a run with one cause, median, on the host of this page"
        yield Bar(text, f"<= {most_s:g} s", f"{typical:.1f} s", typical <= most_s, runs)
    harmless, runs = study.operated(HARMLESS), study.runs_operated(HARMLESS)
    yield _none("harmless runs with a write", sum(one.writes > 0 for one in harmless), runs)
    yield _none("harmless runs with a name at 0.5 or more, everything on", sum(bool(x.names) for x in harmless), runs)
    stirred = sum(one.alarms + one.writes + one.diagnoses for one in study.operated(DAY))
    yield _none(
        "alarms, writes and answers that something is wrong in 24 fault-free hours", stirred, study.runs_operated(DAY)
    )


def _of_several(study: Study) -> Iterator[Bar]:
    """Bars of runs with two faults, and of runs with a wrong label."""
    text = "pairs of faults outside a hard limit after detection that a tried strategy keeps"
    yield _none(text, sum(one.avoidable for one in study.paired), study.runs_operated(PAIRED))
    text = "wrong labels with a release that violates a limit, and the guard does not catch it"
    yield _none(text, sum(one.missed for one in study.forced), study.runs_operated(LABELLED))
