"""What reacts in the reactor, over its gas (Downs and Vogel 1993).

    A + C + D -> G     r1 = k1 exp(31.586 - 40000 / (1.987 T)) pA^1.1544 pC^0.3735 pD V
    A + C + E -> H     r2 = k2 exp(3.0009 - 20000 / (1.987 T)) pA^1.1544 pC^0.3735 pE V
    A + E -> F         r3 = exp(53.406 - 60000 / (1.987 T)) pA pE V
    1.5 D -> F         r4 = 0.76749 exp(53.406 - 60000 / (1.987 T)) pA pD V

in lb-mol/h with pressures in mmHg, V in ft3 and T in K; k1 and k2 are 1 by design. By hand: at 120.4 degC (393.55 K)
exp(31.586 - 51.15) = 3.2e-9, and 2.6e3, 2.0e3 and 0.06e3 ... give some 130 lb-mol/h of G.
"""

from __future__ import annotations

from homeostat.plants.tennessee_eastman.substances import BTU, FT3, LB, MMHG
from homeostat.plants.tennessee_eastman.vessels import ZERO, Drum
from homeostat.process.blocks import Term, exp, number, term


def reactions(reactor: Drum, k1: Term, k2: Term) -> tuple[list[Term], Term]:
    """What is made of each substance [kmol/h], and the heat that comes of it [MJ/h]."""
    a, _, c, d, e, *_ = (p / number(MMHG, "kPa") for p in reactor.partial)
    kelvin, gas = reactor.kelvin / number(1.0, "K"), reactor.gas * number(LB / FT3, "kmol/(h m3)")
    both = a**1.1544 * c**0.3735
    r1 = k1 * exp(31.5859536 - 20130.85052843482 / kelvin) * both * d * gas
    r2 = k2 * exp(3.00094014 - 10065.42526421741 / kelvin) * both * e * gas
    slow = exp(53.4060443 - 30196.27579265224 / kelvin) * a * gas
    r3, r4 = slow * e, 0.767488334 * slow * d
    made = [-(r1 + r2 + r3), ZERO, -(r1 + r2), -(r1 + 1.5 * r4), -(r2 + r3), r3 + r4, r1, r2]
    heat = number(0.06899381054 * BTU / LB, "MJ/kmol") * r1 + number(0.05 * BTU / LB, "MJ/kmol") * r2
    return [term(each) for each in made], heat
