"""A plant that leaves the physical world by itself: which number of its tables is the likeliest, before its equations.

Times that are typed in hours where seconds are stated, or the other way round, are the usual cause. Each number with a
time in its unit is tried so many times larger and smaller, and each loop the other way round; a course that goes
through tells the row. Where none does, those are told that are over within a tick: several may be wrong at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

from homeostat.domain.plant.parameter import ModelParameter
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import module_file
from homeostat.evaluate.lint.deep.mended import restless, with_factors
from homeostat.evaluate.lint.deep.numbers import AT_ONCE
from homeostat.evaluate.lint.finding import Finding, Place, Severity, amount

MOST: Final = 80
"""Courses that are tried at most; those that break are short."""
WHOLE: Final = 40
"""The same where none breaks."""
TOLD: Final = 4
"""So many rows are told that could be wrong."""
_TIMES: Final[Mapping[str, float]] = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
_FACTORS: Final[Mapping[float, tuple[str, str]]] = {
    3600.0: ("hour", "second"),
    60.0: ("minute", "second"),
    1 / 60: ("second", "minute"),
    1 / 3600: ("second", "hour"),
}
"""How much longer a time is if it is in the one and was typed as the other. A rate is smaller by as much."""


def broken(bench: Bench, why: str = "", check: str = "causes") -> Iterator[Finding]:
    """One finding of a plant that breaks, at the row that is likeliest to be wrong. ``why``: as the twin says it."""
    why = (bench.quiet.broke or why).replace("; ", ", ")
    d = bench.plant.description
    begun = f"the fault-free plant breaks: {why}" if bench.quiet.broke else f"the plant breaks: {why}"
    _, found = _going_through(bench) if bench.quiet.broke else (0, [])
    if found:
        first, told = found[0]
        others = [bench.places.row("parameters", symbol=symbol) for symbol, _ in found[1:TOLD]]
        what = f"{begun}, and it does not {told}"
        remedy = f"correct {first}" + (f", or {', or '.join(map(str, others))}" if others else "")
        yield Finding(Severity.ERROR, check, bench.places.row("parameters", symbol=first), what, remedy)
        return
    tick_s = d.timing.tick_s
    fast = sorted((s, p.symbol) for p in d.parameters if (s := scale_s(p)) is not None and s < _least_s(bench, p))[
        :TOLD
    ]
    if fast:
        rows = [f"{bench.places.row('parameters', symbol=symbol)}: {s:.3g} s" for s, symbol in fast]
        what = f"{begun}, and the tables state times that are over within a tick of {tick_s:g} s: {', '.join(rows)}"
        remedy = "look whether these are seconds, and not minutes or hours, then mend the equations"
        yield Finding(Severity.ERROR, check, bench.places.row("parameters", symbol=fast[0][1]), what, remedy)
        return
    remedy = "mend the equations, or the parameters in the tables; see where it goes with 'homeostat plant try'"
    yield Finding(Severity.ERROR, check, Place(module_file(bench), None, "kernel"), begun, remedy)


def mistyped(bench: Bench) -> Iterator[Finding]:
    """One finding of a plant whose loops do not hold, where they all do with some time or rate in another unit."""
    left, found = _going_through(bench)
    if not found or left:
        return
    first, told = found[0]
    others = [bench.places.row("parameters", symbol=symbol) for symbol, _ in found[1:TOLD]]
    loops = ", ".join(repr(each.loop.name) for each in restless(bench, bench.quiet))
    do = "do" if "," in loops else "does"
    what = f"{loops} {do} not hold at the end of a healthy course, and every loop does {told}"
    remedy = f"correct {first}" + (f", or {', or '.join(map(str, others))}" if others else "")
    yield Finding(Severity.ERROR, "causes", bench.places.row("parameters", symbol=first), what, remedy)


def scale_s(parameter: ModelParameter) -> float | None:
    """The time that a parameter states, or one through the rate [s]; None where it states neither."""
    per, _, unit = parameter.unit.rpartition("/")
    size = _TIMES.get(unit)
    if size is None or not parameter.value or per not in ("", "1") or (not per and "/" in parameter.unit):
        return None
    return size / abs(parameter.value) if per else size * abs(parameter.value)


def _least_s(bench: Bench, parameter: ModelParameter) -> float:
    """What a time of the tables is not usually shorter than [s]: a tick; an actuator follows its command exactly."""
    lags = {f"tau_{component.name}" for component in bench.plant.description.components}
    return bench.plant.description.timing.tick_s * (AT_ONCE if parameter.symbol in lags else 1.0)


def _going_through(bench: Bench) -> tuple[int, list[tuple[str, str]]]:
    """Symbols with which the plant does not break once they are changed, how they are, and how many loops do not hold.

    Those first with which most loops hold as well: what lets nothing flow breaks nothing either.
    """
    found = list[tuple[int, str, str]]()
    for symbols, factor, told in list(_tries(bench))[: MOST if bench.quiet.broke else WHOLE]:
        course = with_factors(bench, dict.fromkeys(symbols, factor))
        if not course.broke:
            found.append((len(restless(bench, course)), symbols[0], told))
    found.sort(key=lambda each: each[0])
    if not found:
        return 0, []
    best = {symbol: told for left, symbol, told in reversed(found) if left == found[0][0]}
    return found[0][0], list(reversed(best.items()))


def _tries(bench: Bench) -> Iterator[tuple[tuple[str, ...], float, str]]:
    """What is tried: loops the other way round, then times, those that are over soonest first, and all at once."""
    known = set(bench.plant.model.parameters)
    for loop in bench.plant.description.loops:
        both = tuple(symbol for symbol in (loop.gain, loop.reset) if symbol in known)
        if both:
            yield both, -1.0, f"if {' and '.join(both)} have the other sign (loop {loop.name!r})"
    timed = [p for p in bench.plant.description.parameters if p.symbol in known and p.value and _timed(p)]
    timed.sort(key=lambda p: scale_s(p) or bench.plant.end_s)
    for factor, (true, typed) in _FACTORS.items():
        names = {False: f"{true}s typed as {typed}s", True: f"a number per {true} typed as one per {typed}"}
        for p in timed:
            rate = "/" in p.unit
            times = 1.0 / factor if rate else factor
            yield (p.symbol,), times, f"if {p.symbol} = {amount(times * p.value, p.unit)}: {names[rate]}"
        for rate in (False, True):
            every = tuple(p.symbol for p in timed if ("/" in p.unit) is rate)
            if len(every) > 1:
                yield every, 1.0 / factor if rate else factor, f"if each of {', '.join(every)} is {names[rate]}"


def _timed(parameter: ModelParameter) -> bool:
    """Whether there is a time in its unit."""
    return bool(_TIMES.keys() & set(re.findall(r"[A-Za-z]+", parameter.unit)))
