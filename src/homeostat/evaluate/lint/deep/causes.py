"""Which number makes loops restless: each is changed in turn, and the one with which every loop holds is the cause.

A loop that swings takes along what it is coupled to, the inner one of a cascade first; where a loop does not hold is
therefore not where the mistake is. A number that mends all of them by itself is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from homeostat.domain.plant.description import ControlLoop
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.mended import Restless, inner_of, outer_of, restless, stated_action, with_factors
from homeostat.evaluate.lint.deep.scaled import broken, mistyped
from homeostat.evaluate.lint.deep.sluggish import reset_s, sluggish
from homeostat.evaluate.lint.deep.ticked import ticked
from homeostat.evaluate.lint.finding import Finding, Place, Severity, amount

MOST: Final = 60
"""Courses that are tried at most."""
SIZES: Final[Mapping[float, str]] = {
    0.1: "a tenth",
    1 / 60: "a sixtieth",
    0.01: "a hundredth",
    10.0: "ten times",
    100.0: "a hundred times",
}
"""What a number is tried with, and how it is called."""
_LOWER: Final = (0.1, 0.01)
_HIGHER: Final = (10.0, 100.0)
_QUICKER: Final = (0.1, 1 / 60)


class Mend(NamedTuple):
    """Numbers that are changed together."""

    loop: ControlLoop
    """Of which loop they are, or of which the actuator is."""
    symbols: tuple[str, ...]
    """Their symbols."""
    factor: float
    """What they are multiplied with [1]."""

    @property
    def turns(self) -> bool:
        """Whether it turns the loop's action round."""
        return self.factor < 0.0


def causes(bench: Bench) -> Iterator[Finding]:
    """What one number of the tables explains of a plant that does not come to rest, or breaks; then what is likely."""
    if bench.quiet.broke:
        yield from broken(bench)
        return
    found = restless(bench, bench.quiet)
    mends = _that_mend(bench, found)
    if mends:
        yield _finding(bench, found, mends)
        yield from ticked(bench)
        return
    typed = list(mistyped(bench)) if found else []
    if typed:
        yield from typed
        return
    yield from sluggish(bench)
    yield from ticked(bench)


def _that_mend(bench: Bench, found: Sequence[Restless]) -> list[Mend]:
    """Every mend with which all loops hold, the likeliest first."""
    tried = list(_mends(bench, found))[:MOST] if found else []
    mending = [each for each in tried if _mends_all(bench, each)]
    best: dict[tuple[str, ...], Mend] = {}
    for each in mending:  # the smaller change of the same numbers comes first
        best.setdefault(each.symbols, each)
    kept = [each for each in best.values() if not _wider(each, list(best.values()))]
    return sorted(kept, key=lambda each: _unlikely(bench, each))


def _mends_all(bench: Bench, mend: Mend) -> bool:
    course = with_factors(bench, dict.fromkeys(mend.symbols, mend.factor))
    return not course.broke and not restless(bench, course)


def _wider(mend: Mend, others: Sequence[Mend]) -> bool:
    """Whether fewer numbers of it mend as well."""
    return any(set(each.symbols) < set(mend.symbols) for each in others)


def _unlikely(bench: Bench, mend: Mend) -> tuple[bool, bool, int]:
    """Sorts what mends: the action first, then an actuator slower than its loop is, then what another loop follows."""
    slow = _actuator(bench, mend) and _value(bench, mend.symbols[0]) > reset_s(bench, mend.loop)
    return not mend.turns, not slow, 0 if inner_of(bench, mend.loop) is not None else 1


def _actuator(bench: Bench, mend: Mend) -> bool:
    return not {mend.loop.gain, mend.loop.reset} & set(mend.symbols)


def _mends(bench: Bench, found: Sequence[Restless]) -> Iterator[Mend]:
    """What is tried: smaller changes before larger ones of all loops that are restless, and of those that set them."""
    asked = {each.loop.name: each for each in found}
    loops = [each.loop for each in found]
    loops += [o for each in found if (o := outer_of(bench, each.loop)) is not None and o.name not in asked]
    known = set(bench.plant.model.parameters)
    for loop in loops:
        both = tuple(symbol for symbol in (loop.gain, loop.reset) if symbol in known)
        if both:
            yield Mend(loop, both, -1.0)
    for place in (0, 1):
        for loop in loops:
            swings = loop.name not in asked or asked[loop.name].swings
            factor = _LOWER[place] if swings else _HIGHER[place]  # what is only off its setpoint may be too slow
            both = tuple(symbol for symbol in (loop.gain, loop.reset) if symbol in known)
            yield from (Mend(loop, each, factor) for each in dict.fromkeys((both[-1:], both)) if each)
            lags = _lags(bench, loop) if swings else ()
            yield from (Mend(loop, (symbol,), _QUICKER[place]) for symbol in lags if symbol in known)


def _lags(bench: Bench, loop: ControlLoop) -> Iterator[str]:
    driven = {s.component for s in bench.plant.description.signals if s.tag.name == loop.manipulated_variable}
    yield from (f"tau_{component}" for component in sorted(driven))


def _value(bench: Bench, symbol: str) -> float:
    return float(bench.nominal[bench.plant.model.parameters.index(symbol)])


def _finding(bench: Bench, found: Sequence[Restless], mends: Sequence[Mend]) -> Finding:
    first = mends[0]
    others = [each.loop.name for each in found if each.loop.name != first.loop.name]
    told = ", ".join(_told(each) for each in found)
    what = f"at the end of a healthy course {told}, and with {_changed(bench, first)} every loop holds: "
    if _actuator(bench, first):
        acts_s = reset_s(bench, first.loop)
        what += f"what loop {first.loop.name!r} moves is too slow for it (it has a reset time of {acts_s:.3g} s)"
    else:
        what += f"loop {first.loop.name!r} is the cause"
    if others:
        what += f", and {', '.join(map(repr, others))} only {'follows' if len(others) == 1 else 'follow'}"
    return Finding(Severity.ERROR, "causes", _place(bench, first), what, _remedy(bench, mends))


def _told(each: Restless) -> str:
    if each.swings:
        return f"{each.loop.manipulated_variable!r} of loop {each.loop.name!r} swings"
    return f"{each.loop.process_variable!r} is off the setpoint of loop {each.loop.name!r}"


def _place(bench: Bench, mend: Mend) -> Place:
    return stated_action(bench, mend.loop) if mend.turns else bench.places.row("parameters", symbol=mend.symbols[0])


def _changed(bench: Bench, mend: Mend) -> str:
    d = {p.symbol: p for p in bench.plant.description.parameters}
    told = " and ".join(f"{symbol} = {amount(d[symbol].value, d[symbol].unit)}" for symbol in mend.symbols)
    if mend.turns:
        return f"{told} of the other sign"
    return f"{SIZES[mend.factor]} of {told}"


def _remedy(bench: Bench, mends: Sequence[Mend]) -> str:
    told = []
    for mend in mends:
        rows = " and ".join(str(bench.places.row("parameters", symbol=symbol)) for symbol in mend.symbols)
        if mend.turns:
            told.append(f"turn acts of {mend.loop.name!r} round, or the signs of its gains ({rows})")
        elif _actuator(bench, mend):
            told.append(f"correct the time constant of what {mend.loop.name!r} moves, in seconds ({rows})")
        else:
            told.append(f"{'lower' if mend.factor < 1.0 else 'raise'} {rows} of {mend.loop.name!r}")
    return ", or ".join(told[:3])
