"""Where modules and headers meet: what a module takes from them, and what they are to the module."""

from __future__ import annotations

import numpy as np

from homeostat.plants.mixing_module.layout import P as MIXER
from homeostat.plants.mixing_module.layout import S as MIXER_STATE
from homeostat.process.types import Table, Vec
from tests.plants.cstr.reactor import P as REACTOR
from tests.plants.cstr.reactor import S as REACTOR_STATE


def heat(kind: str, states: Table, parameters: Table) -> Vec:
    """Heat that each module gives to the cooling water, UA u (T1 - T_c) [W], shape (members,)."""
    if kind != "cstr":
        return np.zeros(len(states))
    warmer = states[:, REACTOR_STATE.T] - parameters[:, REACTOR.T_coolant]
    return np.asarray(states[:, REACTOR_STATE.UA] * states[:, REACTOR_STATE.V2_position] * warmer)


def draw(kind: str, states: Table) -> Vec:
    """Flow that each module draws from the feed main [L/s], shape (members,)."""
    if kind == "cstr":
        return states[:, REACTOR_STATE.F1_true].copy()
    return np.asarray(states[:, MIXER_STATE.q_in1 : MIXER_STATE.q_in3 + 1].sum(axis=1))


def impose(kind: str, parameters: Table, own: Table, warmer: Vec, factor: Vec) -> None:
    """Set what the headers are to each module, in place.

    ``own``: parameters without neighbours; ``warmer``: cooling water above design [K]; ``factor``: flow of an open
    valve as a share of that at full pressure [1], shape (members,) both.
    """
    if kind == "cstr":
        parameters[:, REACTOR.T_coolant] = own[:, REACTOR.T_coolant] + warmer
        parameters[:, REACTOR.Cv_V1] = own[:, REACTOR.Cv_V1] * factor
    else:
        parameters[:, MIXER.fill_rate] = own[:, MIXER.fill_rate] * factor
