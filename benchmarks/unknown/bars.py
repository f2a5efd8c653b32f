"""The bars of the study, each beside its figure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median

from benchmarks.unknown.causes import HARMLESS, HEALTHY, KNOWN
from benchmarks.unknown.jobs import DAY, LOOKS_S, UNKNOWN, Job
from benchmarks.unknown.judge import reliability
from benchmarks.unknown.operated import Operated, longer, poorer
from benchmarks.unknown.tally import Look, Share, of_runs, right_from, severity_errors, statements, with_a_name
from homeostat.evaluate.score.scoring import SAME_LOSS
from homeostat.plants.plant import Plant

LIKELY = (0.85, 0.95)
"""What counts as said with 90 % [1]."""


class Study:
    """What was measured of one plant."""

    def __init__(
        self, plant: Plant, jobs: Sequence[Job], looks: Sequence[Look], operated: Sequence[Operated] = ()
    ) -> None:
        """``jobs``: every run that was asked for; ``looks``, ``operated``: what is in."""
        self.plant, self.jobs, self.looks, self._operated = plant, jobs, looks, operated

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
        """Runs of one part with everything on; of unknown causes only those that are truly unknown."""
        mine = self._to_operate(name)
        return [one for one in self._operated if one.run in mine]

    def _to_operate(self, name: str) -> set[str]:
        return {j.name for j in self.jobs if j.part == name and not j.cause.known}

    def runs(self, name: str) -> str:
        """How many runs of a part are in."""
        return _in(self.looks, [j for j in self.jobs if j.part == name])

    def runs_operated(self, name: str) -> str:
        """The same of those with everything on."""
        return f"{len(self.operated(name))} of {len(self._to_operate(name))}"


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
        if self.runs.startswith("0 "):
            return "not measured"
        return "yes" if self.met else "**no**"


def bars(study: Study) -> Iterator[Bar]:
    """Every bar of one plant."""
    yield from _of_unknown(study)
    yield from _of_known(study)
    yield from _of_calibration(study)
    yield from _of_operation(study)
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


def _of_known(study: Study) -> Iterator[Bar]:
    known, runs, after_s = study.part(KNOWN), study.runs(KNOWN), LOOKS_S[study.plant.name]
    for at_s in (after_s[0], after_s[2]):
        mine = [x for x in known if x.looked and x.judged.after_s == at_s]
        yield _at_least(f"known faults named at +{at_s} s", 0.85, Share.that(mine, lambda x: x.named), runs)
        yield _at_most(f"known faults taken for others at +{at_s} s", 0.02, Share.that(mine, lambda x: x.bad), runs)
    errors = [e for f in study.plant.description.faults for e in severity_errors(known, f)]
    typical = median(errors) if errors else math.nan
    text = f"{100 * typical:.0f} % of the range, {len(errors)} stated" if errors else "none"
    yield Bar("severity of known faults, median error", "<= 10 % of the range", text, typical <= 0.1, runs)


def _of_calibration(study: Study) -> Iterator[Bar]:
    told = next(b for b in reliability(statements(study.looks)) if (b.low, b.high) == LIKELY)
    text = f"{100 * told.right:.0f} % of {told.count} said with {100 * told.said:.0f} %" if told.count else "none"
    met = abs(told.right - told.said) <= 0.05
    yield Bar("what is said with 90 % is true", "90 +- 5 %", text, met, _in(study.looks, study.jobs))


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
    harmless, runs = study.operated(HARMLESS), study.runs_operated(HARMLESS)
    yield _none("harmless runs with a write", sum(one.writes > 0 for one in harmless), runs)
    yield _none("harmless runs with a name at 0.5 or more, everything on", sum(bool(x.names) for x in harmless), runs)
    stirred = sum(one.alarms + one.writes + one.diagnoses for one in study.operated(DAY))
    yield _none("alarms, diagnoses and writes in a fault-free day", stirred, study.runs_operated(DAY))
