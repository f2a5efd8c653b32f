"""What flows between the vessels and what heat passes: valves, compressor, stripper, coolers (Downs and Vogel 1993)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from homeostat.plants.tennessee_eastman.streams import Stream, both, liquid, shared, vapour
from homeostat.plants.tennessee_eastman.substances import BTU, FT3, LB, MMHG
from homeostat.plants.tennessee_eastman.vessels import Drum, Header, Sump
from homeostat.process.blocks import Term, limited, maximum, minimum, number, sqrt, where

_AIR: Final = number(101.325, "kPa")
_KEEPS: Final = (8.501, 11.402, 11.795, 0.048, 0.0242)
"""How readily D to H are stripped."""
_GASES: Final = (0.995, 0.991, 0.99)
"""Shares of A to C that leave at the top of the stripper."""
_WATER: Final = 500.53
"""Pounds of water per hour in a gallon per minute."""


def through(coefficient: float, drop: Term, mass: Term) -> Term:
    """Flow [kmol/h] of a gas of molar ``mass`` by a pressure drop [kPa]; ``coefficient`` in lb / (h mmHg^0.5)."""
    return number(coefficient * LB / MMHG**0.5, "kg/(h kPa^0.5)") * sqrt(maximum(drop, number(0.0, "kPa"))) / mass


def purged(opening: Term, separator: Drum) -> Term:
    """Flow through the purge valve [kmol/h]."""
    return opening * through(15.1169, separator.p - _AIR, separator.mass)


def drawn(opening: Term, most: Term, vessel: Drum | Sump) -> list[Term]:
    """Liquid through the valve under a vessel, of each substance [kmol/h].

    Not published: below 0.2 m3, a fifth of what shuts the plant down, less and less of it gets there.
    """
    there = limited(vessel.liquid / number(0.2, "m3"), 0.0, 1.0)
    return shared(vessel.x, opening * most * there)


@dataclass(frozen=True)
class Compressed:
    """What the compressor does."""

    flow: Term
    """What it moves, less what its recycle valve lets back [kmol/h]."""
    work: Term
    """Heat that it puts in [MJ/h]."""


def compressed(recycle: Term, separator: Drum, header: Header) -> Compressed:
    """The compressor from the separator to the header, with the opening [1] of its recycle valve."""
    ratio = limited(header.p / separator.p, 1.0, 1.3)
    moved = number(280275.0 * LB, "kg/h") * (1.0 + (1.0 - ratio * ratio * ratio) / 1.197) / separator.mass
    rise = (header.p - separator.p) / separator.p
    back = recycle * through(5334.9, header.p - separator.p, separator.mass)
    work = moved * separator.kelvin * number(1.8e-6 * 1.9872 * BTU / LB, "MJ/(kmol K)") * rise
    return Compressed(maximum(moved - back, number(0.001 * LB, "kmol/h")), work)


def stripped(gas: Stream, underflow: Stream, sump: Sump) -> tuple[Stream, Stream]:
    """What leaves the stripper at its top, and what falls into its sump."""
    t = sump.t / number(1.0, "degC")
    by_heat = where(t > 170.0, t - 120.262, where(t < 5.292, 0.1, 363.744 / (177.0 - minimum(t, 170.0)) - 2.22579488))
    ratio = gas.flow / maximum(underflow.flow, number(0.1 * LB, "kmol/h")) * by_heat
    shares: list[Term | float] = [*_GASES, *(k * ratio / (1.0 + k * ratio) for k in _KEEPS)]
    fed = both(gas, underflow).parts
    up = [share * each for share, each in zip(shares, fed, strict=True)]
    down = [each - gone for each, gone in zip(fed, up, strict=True)]
    return vapour(up, sump.t), liquid(down, sump.t)


def cooling(opening: Term, gallons: float, held: float, inlet: Term, outlet: Term, heat: Term) -> Term:
    """Change of a cooling water's outlet temperature [K/h]: ``held`` lb of water, and ``heat`` [MJ/h] that it gives.

    ``gallons``: what the open valve passes [gal/min].
    """
    renewed = opening * number(gallons * _WATER / held, "1/h")
    return renewed * (inlet - outlet) - heat * number(1e6 / 1.8 / BTU / held, "K/MJ")


def reactor_cooling(reactor: Drum, agitator: Term, water: Term) -> Term:
    """Heat that the reactor takes from its cooling water, less than 0 [MJ/h]."""
    covered = limited(reactor.liquid / number(7.8 * FT3, "m3") * 0.025 - 0.25, 0.0, 1.0)
    n = agitator + 1.5
    stirred = -0.5 * n * n + 2.75 * n - 2.5
    return covered * stirred * number(0.85549 * BTU, "MJ/(h K)") * (water - reactor.t)


def condenser_cooling(flow: Term, reactor: Drum, water: Term) -> Term:
    """Heat that the condenser's gas takes from its cooling water, less than 0 [MJ/h]; ``flow`` in kmol/h."""
    x = flow / number(3528.73 * LB, "kmol/h")
    share = 1.0 - 1.0 / (1.0 + x * x * x * x)
    return share * number(0.404655 * BTU, "MJ/(h K)") * (water - reactor.t)


def steamed(opening: Term, sump: Sump) -> Term:
    """Heat of the stripper's steam [MJ/h]."""
    return opening * number(0.03 * BTU, "MJ/(h K)") * maximum(100.0 - sump.t, number(0.0, "degC"))
