"""What the shared headers of a site do to the modules on them.

Cooling water, one circuit with a cooling tower per group, T its supply temperature [K]:

    C dT/dt = sum(Q) - K (T - T_air),  Q = UA u (T1 - T_c) [W] of each reactor on it

K = 2000 W/K and C = 627 kJ/K per reactor. K is an approach of 2.8 K (5 degF, the closest that tower makers commonly
warrant) at the design duty of 5573 W; C is ten minutes of the design flow, 0.25 L/s of water at 4180 J/(L K); T_air is
the sink at which the design duty gives the design supply temperature. Q is taken up while the block before passed.

Feed main, quasi-steady, F the flow that is drawn [L/s]:

    p / p0 = 1 - a (sum(F) / F_design)^2,  flow of a valve ~ sqrt(p / p0)

a = 0.04: at full load the main takes 4 % of its pressure by friction, which goes with the flow squared.

Hand check: one of five reactors takes up nothing, the others the design duty: T falls by 5573 / (5 * 2000) = 0.557 K in
the end. A main at full load: sqrt(0.96) = 0.9798 of the flow.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from homeostat.process.types import Vec

DESIGN_T: Final = 290.0
"""Supply temperature at the design duty: the reactor's nominal T_coolant [K]."""
DESIGN_DUTY: Final = 5573.0
"""Heat that a reactor gives to its jacket in the design state, from the plant's hand check [W]."""
TOWER: Final = 2000.0
"""Heat that the tower takes per kelvin above its sink, per reactor [W/K]."""
HOLD_UP: Final = 0.25 * 600.0 * 4180.0
"""Heat capacity of the circuit, per reactor [J/K]."""
SINK_T: Final = DESIGN_T - DESIGN_DUTY / TOWER
"""Sink of the tower [K]."""
FRICTION: Final = 0.04
"""Share of its pressure that a main loses at full load [1]."""
DESIGN_DRAW: Final = {"cstr": 1.0 / 30.0, "mixing_module": 0.07}
"""Flow that a module of each plant draws from the main at most by design [L/s]."""


def supply_temperature(before: Vec, heat: Vec, reactors: Vec, seconds: float) -> Vec:
    """Supply temperatures [K] after ``seconds`` in which ``heat`` [W] was taken up, shape (circuits,).

    ``before``: those at the beginning [K]; ``reactors``: how many each circuit serves. A circuit without reactors keeps
    its temperature.
    """
    served = np.maximum(reactors, 1.0)
    steady = SINK_T + heat / (served * TOWER)
    after = steady + (before - steady) * math.exp(-seconds * TOWER / HOLD_UP)
    return np.where(reactors > 0, after, before)


def flow_factor(drawn: Vec, design: Vec) -> Vec:
    """Flow of an open valve as a share of that at full pressure [1], shape (mains,).

    ``drawn``: flow that is taken from each main, and ``design``: its largest by design [L/s]. No main is loaded beyond
    twice its design.
    """
    load = np.minimum(drawn / np.maximum(design, 1e-9), 2.0)
    return np.sqrt(1.0 - FRICTION * load * load)
