"""The reactor as it truly is in a simulated run: the model's equations, and what no twin of it knows.

Beside what :mod:`~homeostat.process.departures` puts before the actuators and behind the instruments:

    valves      flow = Cv (R^u - 1)/(R - 1) instead of Cv u: equal percentage with rangeability R
    pump        flow = K u (1 + a (V - 10 L)): more under more liquid
    jacket      UA u_d (u/u_d)^n (T - Tc) with u_d = 0.5: a film coefficient that grows with Re^n; the model has n = 1
    wall        C dTw/dt = k (T - Tw): steel that is warmed and cooled with the liquid
    agitator    W of stirring, which end as heat

Parameters: rangeabilities [1], 0 for a linear valve; ``P1_head``, which is a [1/L]; ``jacket_exponent``, n - 1 [1];
``wall_J_K`` and ``wall_W_K``, C and k, 0 for no wall; ``agitator_W``. Neutral values are the model to the bit. Sources:
Perry's Chemical Engineers' Handbook, 8th ed., sections 8 (valve characteristics) and 11 (film coefficients in jackets).

Hand check: R = 30 and u = 0.5 give (30^0.5 - 1)/29 = 0.154 of the flow; n = 0.8 and u = 1 give 2^-0.2 = 0.871 of UA.
"""

from homeostat.plants.cstr.process import Assumed, reactor
from homeostat.process.blocks import Flowsheet, Term, Vessel, exp, log, maximum, number, term, where
from homeostat.process.blocks.true import TrueFlowsheet
from homeostat.process.departures import Departures

DEPARTURES = Departures(
    actuators=("V1", "P1", "V2", "XV1"),
    instruments=("T1", "L1", "F1", "F2", "F3", "T2", "T3", "V1_zt", "P1_zt", "V2_zt"),
    structure=(
        "V1_rangeability", "V2_rangeability", "P1_head", "jacket_exponent", "wall_J_K", "wall_W_K", "agitator_W",
    ),
)  # fmt: skip
DESIGN_DUTY = 0.5
DESIGN_VOLUME = number(10.0, "L")


class Truly(Assumed):
    """What the reactor truly does."""

    def opened(self, valve: str, position: Term) -> Term:
        """Equal percentage where a rangeability is given."""
        r = maximum(f"{valve}_rangeability", 1.0)
        return where(r > 1.0, (exp(log(r) * position) - 1.0) / maximum(r - 1.0, 1e-9), position)

    def pumped(self, speed: Term, volume: Term) -> Term:
        """More under more liquid."""
        return speed * (1.0 + "P1_head" * (volume - DESIGN_VOLUME))

    def cooled(self, opening: Term) -> Term:
        """By the film coefficient of the jacket."""
        return opening * exp("jacket_exponent" * log(maximum(opening / DESIGN_DUTY, 1e-6)))

    def warm(self, sheet: Flowsheet, vessel: Vessel) -> None:
        """The wall, and the agitator."""
        assert vessel.temperature is not None
        wall = sheet.state("wall_T", "K", vessel.temperature)
        given = where(term("wall_J_K") > 0.0, "wall_W_K" * (wall - vessel.temperature), 0.0)
        sheet.rate(wall, -given / maximum("wall_J_K", 1.0))
        vessel.heat((given + "agitator_W") * vessel.wet / maximum(vessel.volume, 1.0))


TRUE = TrueFlowsheet(reactor(Truly()), DEPARTURES)
