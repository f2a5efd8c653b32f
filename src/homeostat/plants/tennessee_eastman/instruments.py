"""The 41 published measurements: 22 that show something new each tick, 19 from three analysers with dead times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from homeostat.process.blocks import Flowsheet, Term, number

GAS_S, PRODUCT_S = 360.0, 900.0
"""Time and dead time of the analysers of gases and of the product [s]."""
STANDARD: Final = number(0.359 / 35.3145 / 0.454 * 1000.0, "m3/kmol")
"""Volume of a kmol of gas under standard conditions, as the published instruments have it."""
_AIR: Final = number(101.325, "kPa")


def gauge(p: Term) -> Term:
    """A pressure above that of the air [kPa]."""
    return p - _AIR


def level(liquid: Term, empty: float, span: float) -> Term:
    """Reading of a level [%] for a volume of ``liquid`` [m3]; ``empty`` and ``span`` in ft3."""
    return (liquid - number(empty / 35.3145, "m3")) / number(span / 100.0 / 35.3145, "m3") * number(1.0, "%")


def transmitters(s: Flowsheet, shown: Mapping[str, Term]) -> None:
    """What is shown at once: variable -> what it is."""
    for name, value in shown.items():
        s.sensor(name, value)


def analyser(s: Flowsheet, stream: str, substances: str, shares: Sequence[Term], every_s: float) -> dict[str, Term]:
    """Mole fractions [mol %] of ``substances`` in a stream: each is what it was ``every_s`` ago, every ``every_s``.

    Gives what reaches the instrument of each.
    """
    late = {}
    for name in substances:
        share = shares["ABCDEFGH".index(name)] * number(100.0, "%")
        late[name] = s.delay(f"X{stream}{name}_taken", share, every_s)
        s.sensor(f"X{stream}{name}", late[name], every_s=every_s)
    return late
