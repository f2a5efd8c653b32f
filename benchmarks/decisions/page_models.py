"""Sections of the page about models beside the search, and about other optimisers in the place of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import fmean

from benchmarks.decisions.better import CASES, Better
from benchmarks.decisions.models import ALONE, Seated, compared
from benchmarks.decisions.optimisers import BAYES, EVOLUTION, INSTALL, OWN, Tuned
from benchmarks.unknown.sections import listed, table

WORSE = 0.5
"""Points that no run may cost more than with the search alone."""
MODELS = f"""## A model beside the search

The same runs with a script in the language model's seat, as in operation: asked after the search where the best costs
more than 2 % of the design production. *Careful* reads which command moves which margin and steps until what is
violated holds with a reserve; it takes tests on offer, holds what is dear and waits where there is time. *Careless*
waits as long as it may, holds as long as it may or takes the first path for good, with every number at an end of its
range. Points of the design production from detection on, as above. *Own*: done and counted as the
model's; *bettered*: of these, releases whose numbers the search had bettered. Asked for: never more than {WORSE} points
worse than the search alone in any run, with a careful, a careless and a recorded competent model. No recorded
answers of a competent model are part of this project; that arm is not measured."""
BETTER = """## Where a wait, a test or a duration is the better answer

Situations of the reactor that were made for this, each with a script that gives one stated answer at its first chance
and nothing else. Everything is as in operation, but that the first diagnosis is stated in those that need one moment,
that a model has 60 s, and what the situation says of prices. Asked for: in at least three situations the answer is
released and counted as the model's own."""
OPTIMISERS = f"""## Optimisers side by side

The first choice of numbers of runs with three faults of each plant, of nominal size: the search's own optimiser,
CMA-ES (`cmaes`), and a Bayesian one (a Gaussian process of our own with expected improvement,
`benchmarks/decisions/bayes.py`); both begin with the design, as the search does. The objective is the search's: price
over the ensemble that it decides by, ten for each scale of missing margin, a little for leaving the design. Each other
optimiser has as many rollouts as the search took, all of them on that ensemble; the search takes most of its own on
fewer members. Processor time with rollouts, one thread. {INSTALL}."""


def beside(found: Mapping[str, Mapping[str, Sequence[Seated]]], runs: Mapping[str, int]) -> str:
    """The section about models; ``found``: plant -> arm -> runs, of which so many ``runs`` are wanted of each plant."""
    header = (
        "plant", "model", "runs", "compared", "asked in", "waits", "tests", "holds", "releases", "of them bettered",
        "cost", "more in the mean", "most", f"more than {WORSE} worse", "outside a hard limit",
    )  # fmt: skip
    rows: list[tuple[object, ...]] = []
    worse: list[str] = []
    for plant, arms in found.items():
        alone = arms.get(ALONE, ())
        for arm, every in arms.items():
            held = compared(alone, every)
            more = [by for _, by in held]
            done = sum((Counter(one.done) for one in every), Counter[str]())
            rows.append((
                plant, arm, f"{len(every)} of {runs[plant]}", len(held), sum(one.asked > 0 for one in every),
                done["wait"], done["test"], done["hold"], done["release"], sum(one.bettered for one in every),
                _mean([one.cost for one, _ in held if one.cost is not None]), _mean(more), _most(more),
                sum(by > WORSE for by in more), sum(one.outside_s > 0.0 for one in every),
            ))  # fmt: skip
            worse += [f"{plant}, {arm}: {_run(one)}: {by:+.1f} points" for one, by in held if by > WORSE]
    return f"{MODELS}\n\n{table(header, rows)}{listed(worse)}"


def _run(one: Seated) -> str:
    own = ", ".join(f"{count} {kind}" for kind, count in one.done.items()) or "nothing of its own"
    return f"`{one.fault}` {one.severity:.3g}, seed {one.seed}, {own}, {one.outcome}"


def better_answers(found: Sequence[Better]) -> str:
    """The section about situations in which another answer is better."""
    header = ("answer", "situation", "cost with it", "search alone", "less", "done as the model's own", "outside")
    rows = []
    for one in found:
        why = next((case.why for case in CASES if case.kind.value == one.kind), "")
        both = one.cost is not None and one.alone is not None
        less = f"{one.alone - one.cost:.2f}" if both else "none"  # type: ignore[operator]  # both are numbers here
        rows.append((
            one.kind, f"`{one.fault}`: {why}", _points(one.cost), _points(one.alone), less,
            "yes" if one.own else "**no**", f"{one.outside_s:.0f} s",
        ))  # fmt: skip
    own = sum(one.own for one in found)
    return f"{BETTER}\n\n{len(found)} of {len(CASES)} are in; {own} done as the model's own.\n\n{table(header, rows)}"


def side_by_side(found: Mapping[str, Sequence[Tuned]]) -> str:
    """The section about optimisers; ``found``: plant -> decisions."""
    names = (OWN, EVOLUTION, BAYES)
    header = (
        "plant", "fault", "numbers", "rollouts", "evaluations of the others", *(f"{name}: objective" for name in names),
        *(f"{name}: time [s]" for name in names),
    )  # fmt: skip
    rows: list[tuple[object, ...]] = []
    for plant, every in found.items():
        for one in every:
            reached = [f"{one.reached[n]:.4f}" if n in one.reached else "none" for n in names]
            took = [f"{one.took_s[n]:.2f}" if n in one.took_s else "none" for n in names]
            evaluations = one.rollouts // one.members if one.members else 0
            rows.append((plant, one.fault, one.dimensions, one.rollouts, evaluations, *reached, *took))
    return f"{OPTIMISERS}\n\n{table(header, rows)}"


def _points(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f}"


def _mean(values: Sequence[float]) -> str:
    return f"{fmean(values):.2f}" if values else "none"


def _most(values: Sequence[float]) -> str:
    return f"{max(values):+.2f}" if values else "none"
