"""The Tennessee Eastman plant as it truly is in a simulated run: the published equations, and what no twin of it knows.

Beside what :mod:`~homeostat.process.departures` puts before the actuators and behind the instruments:

    valves     flow = F (u + b u (1 - u)) instead of F u: a characteristic that is bent, with all of the flow at u = 1
    coolers    UA w^n, w the water's flow beside the design's: a film on the water's side; the published plant has n = 0
    air        Q = H (T - 25 degC): vessels that are not insulated; the published plant loses nothing

Parameters: ``valve_bend``, which is b [1]; ``R_film`` and ``S_film``, which are n [1]; ``R_loss`` and ``S_loss``, which
are H [MJ/(h K)]. Neutral values are the model to the bit. Sources: Perry's Chemical Engineers' Handbook, 8th ed.,
sections 8 (valve characteristics) and 11 (films and heat losses).

Hand check: b = 0.1 and u = 0.4 pass 0.424 of the flow; n = 0.2 and half the water give 0.5^0.2 = 0.871 of UA; with
2 MJ/(h K) a reactor at 120.4 degC loses 190.8 MJ/h, 0.8 % of the 23,300 MJ/h that its water takes at the design point.
"""

from homeostat.plants.tennessee_eastman.assumed import Assumed
from homeostat.plants.tennessee_eastman.process import TENNESSEE_EASTMAN, plant
from homeostat.process.blocks import Term, exp, log, maximum, number, term
from homeostat.process.blocks.true import TrueFlowsheet
from homeostat.process.departures import Departures

DEPARTURES = Departures(
    actuators=tuple(TENNESSEE_EASTMAN.actuators),
    instruments=tuple(TENNESSEE_EASTMAN.sensors),
    structure=("valve_bend", "R_film", "S_film", "R_loss", "S_loss"),
)
AIR = number(25.0, "degC")


class Truly(Assumed):
    """What the plant truly does."""

    def opened(self, position: Term) -> Term:
        """Bent."""
        return position + term("valve_bend") * position * (1.0 - position)

    def film(self, cooler: str, water: Term) -> Term:
        """By the film on the water's side."""
        return exp(term(f"{cooler}_film") * log(maximum(water, 0.01)))

    def given_off(self, vessel: str, warm: Term) -> Term:
        """Through a wall that is not insulated."""
        return term(f"{vessel}_loss") * number(1.0, "MJ/(h K)") * (warm - AIR)


TRUE = TrueFlowsheet(plant(Truly()), DEPARTURES)
