"""Do the numbers about instruments agree with the instruments: noise, frozen readings, fastest changes?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from homeostat.domain.events.guard import QualityChanged
from homeostat.domain.ports import GuardEvent
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.deep.safe_states import after_fallbacks
from homeostat.evaluate.lint.finding import Finding, Place, Severity, amount
from homeostat.guard.watch.quality import QualityWatch
from homeostat.plants.files.folder import SETTINGS

NOISE: Final = (1.0 / 3.0, 3.0)
"""Between which multiples of what an instrument shows its stated noise lies [1]."""

AT_ONCE: Final = 0.02
"""A time constant that is less than this share of a tick is none [1]."""


def numbers(bench: Bench) -> Iterator[Finding]:
    """Noise, quality and errors of the twin against what instruments show."""
    bench.told("instruments")
    yield from _noise(bench)
    yield from _errors(bench)
    yield from at_once(bench)
    seen = set[str]()
    for course in (*bench.noisy, *after_fallbacks(bench)):
        for tag, finding in _doubted(bench, course):
            if tag not in seen:
                seen.add(tag)
                yield finding


def _noise(bench: Bench) -> Iterator[Finding]:
    d = bench.plant.description
    for tag, rule in sorted(d.qualities.items()):
        if rule.noise is None or not (shown := bench.noise[tag]):
            continue
        share = rule.noise / shown
        if not NOISE[0] <= share <= NOISE[1]:
            unit = d.tag(tag).unit
            noise, true = amount(rule.noise, unit, 6), amount(shown, unit, 3)
            what = f"noise {noise} is stated of {tag!r}, whose instrument shows {true}"
            place = bench.places.row("quality", tag=tag)
            yield Finding(Severity.ERROR, "numbers", place, what, "state what the instrument shows (sensors.csv)")


def _errors(bench: Bench) -> Iterator[Finding]:
    tags = {variable: tag for tag, variable in bench.plant.description.variables.items()}
    for variable, (noise, _) in bench.plant.twin.errors.items():
        if not (shown := bench.noise[tags[variable]]):
            continue
        if noise < NOISE[0] * shown:
            what = f"noise {noise:g} is stated of {variable!r}, whose instrument shows {shown:.3g}"
            place = Place(SETTINGS, None, f"twin, errors, {variable}")
            remedy = "state the noise of one reading, as sensors.csv has it: the twin believes it too much"
            yield Finding(Severity.ERROR, "numbers", place, what, remedy)


def at_once(bench: Bench) -> Iterator[Finding]:
    """Time constants of actuators that are nothing beside a tick: as likely as not in another unit than they are in."""
    d = bench.plant.description
    values = {p.symbol: p.value for p in d.parameters}
    for component in d.components:
        symbol = f"tau_{component.name}"
        if 0.0 < values.get(symbol, 0.0) < AT_ONCE * d.timing.tick_s:
            what = (
                f"{symbol} = {values[symbol]:g} s is less than {AT_ONCE:.0%} of a tick of {d.timing.tick_s:g} s: "
                f"{component.name!r} is where it is sent at once"
            )
            place = bench.places.row("parameters", symbol=symbol)
            yield Finding(
                Severity.WARNING, "numbers", place, what, "state it in seconds, or give [time] a shorter tick_s"
            )


def _doubted(bench: Bench, course: Course) -> Iterator[tuple[str, Finding]]:
    """Readings of a plant without faults that the guard does not believe."""
    d, said = bench.plant.description, list[tuple[str, str, float]]()

    def note(event: GuardEvent, at_s: float) -> None:
        if isinstance(event, QualityChanged) and event.quality != "good":
            said.append((event.tag, event.reason, at_s))

    watch = QualityWatch(d.qualities, d.tags_by_name, note)
    for snapshot in course.seen:
        if snapshot.at_s > course.started_s:  # while it starts, a plant may move as it never does later
            watch.assess(snapshot.at_s, snapshot)
    when = "after a fallback of" if course.acted_s < course.truth.times_s[-1] else "of"
    for tag, reason, at_s in said:
        what = f"a reading {when} the fault-free plant is doubted at {at_s:g} s: {reason}"
        place = bench.places.row("quality", tag=tag)
        remedy = f"correct frozen_s, fastest or noise in {place.file} (state every_s of an analyser), or its range"
        yield tag, Finding(Severity.ERROR, "numbers", place, what, remedy)
