"""Actuators that are far slower than the loop that moves them: as likely as not in another unit than they are in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from homeostat.domain.plant.description import ControlLoop
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Severity, amount

SLOWER: Final = 20.0
"""By how many times the reset time of a loop the time constant of its actuator may be longer [1].

Of the plants that ship and of the examples it is up to 3.
"""


def sluggish(bench: Bench) -> Iterator[Finding]:
    """A warning for each such actuator, once."""
    d, said = bench.plant.description, set[str]()
    stated = {p.symbol: p for p in d.parameters}
    for loop in d.loops:
        driven = next(s.component for s in d.signals if s.tag.name == loop.manipulated_variable)
        symbol, acts_s = f"tau_{driven}", reset_s(bench, loop)
        if symbol not in stated or symbol in said or not 0.0 < SLOWER * acts_s < stated[symbol].value:
            continue
        said.add(symbol)
        rows = [str(bench.places.row("parameters", symbol=each)) for each in (loop.gain, loop.reset)]
        what = (
            f"{symbol} = {amount(stated[symbol].value, stated[symbol].unit)} is {stated[symbol].value / acts_s:.3g} "
            f"times the reset time of loop {loop.name!r}, {acts_s:.3g} s: {driven!r} is far slower than what moves it"
        )
        remedy = (
            f"correct the time constant (in seconds, not in minutes or milliseconds), or give the loop a reset time "
            f"that is as long ({' and '.join(rows)})"
        )
        yield Finding(Severity.WARNING, "causes", bench.places.row("parameters", symbol=symbol), what, remedy)


def reset_s(bench: Bench, loop: ControlLoop) -> float:
    """Reset time of a loop, its gain through its integral gain [s]; 0 where it has none."""
    values = {p.symbol: p.value for p in bench.plant.description.parameters}
    gain, reset = abs(values.get(loop.gain, 0.0)), abs(values.get(loop.reset, 0.0))
    return gain / reset if reset else 0.0
