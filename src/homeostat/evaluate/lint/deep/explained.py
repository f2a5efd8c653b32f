"""Does nothing being wrong explain what a healthy plant shows, whose parameters are not the best estimates?

It is what a diagnosis begins with: where a twin that has learned the plant's parameters does not follow it while
nothing is wrong, every fault is explained by what is wrong with the model as well, and none gets its name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import of_model
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.finding import Finding
from homeostat.process.batch import ProcessError
from homeostat.twin.isolation.evidence import WORST_BLOCK, Fit
from homeostat.twin.twin import Twin

SHARES = (0.5, 0.75, 1.0)
"""Shares of the time after the twin has learned after which it is asked [1]."""
SEED = 1
"""Seed of the twin."""
LEFT = 8.0
"""Mean square of what is left of a variable by which it is not explained [1].

Of plants that are it is up to 1.6, of actuators where a replay is by setpoints up to 4, and of a pH that runs away 15.
"""


def explained(bench: Bench) -> Iterator[Finding]:
    """A finding where a healthy plant is not explained in any of two plants."""
    bench.told("healthy plants, explained by a twin")
    every = [each for course in bench.noisy for each in _asked(bench, course) if not _explains(each[1])]
    if not every:
        return
    variable, fit, at_s = max(every, key=lambda each: each[1].unexplained)
    lead_s = bench.plant.twin.lead_s
    tag = next(s.tag.name for s in bench.plant.description.signals if s.variable == variable)
    what = (
        f"at {at_s:g} s a healthy plant, whose parameters are not the best estimates, is not followed over "
        f"{lead_s:g} s: what a replay leaves of {tag!r} has {fit.mean_square:.3g} times the variance of its noise, so "
        "what is wrong with the model is taken for a fault, or for what else is wrong beside one"
    )
    yield of_model(bench, "following", "replay_inputs", what, _remedy(bench))


def _explains(fit: Fit) -> bool:
    return fit.mean_square <= LEFT and fit.worst_block <= WORST_BLOCK


def _remedy(bench: Bench) -> str:
    settings = bench.plant.twin
    return (
        "where what is read runs away from what was commanded, let its own controllers act in a replay "
        '(Flowsheet(replayed="setpoints")); else state what the model does not know of it (errors or gain_error = '
        f"{settings.gain_error:g} in [twin], sd in parameters.csv), or look at less of it (lead_s = "
        f"{settings.lead_s:g} in [twin])"
    )


def _asked(bench: Bench, course: Course) -> Iterator[tuple[str, Fit, float]]:
    """Variable, fit and process time [s] of what is not explained of ``course``."""
    plant, timing = bench.plant, bench.plant.description.timing
    learned_s = course.settled_s + plant.monitoring.centre_s
    last_s = course.seen[-1].at_s if course.seen else 0.0
    if course.broke or not learned_s < last_s:
        return
    twin, moments = Twin(plant.model, plant.description, plant.twin, SEED), _moments(learned_s, last_s, timing.tick_s)
    for seen in course.seen:
        twin.observe(seen)
        if learned_s <= seen.at_s < learned_s + timing.tick_s:
            twin.calibrate(plant.monitoring.centre_s)
        if seen.at_s >= moments[0]:
            yield from _not_explained(twin, plant.twin.lead_s, seen.at_s)
            moments = moments[1:]
            if not moments:
                return


def _moments(learned_s: float, last_s: float, tick_s: float) -> Sequence[float]:
    return [learned_s + share * (last_s - learned_s) - tick_s for share in SHARES]


def _not_explained(twin: Twin, seconds: float, at_s: float) -> Iterator[tuple[str, Fit, float]]:
    try:
        fits = twin.nothing(seconds)
    except ProcessError:  # the contract of the model is another check's
        return
    yield from ((variable, fit, at_s) for variable, fit in fits.items())
