"""Blind beginning: where a quantity stood at the start of a window whose instrument was stuck before.

A replay begins where the readings say. One that says nothing leaves its vessel as full as it was when it got stuck, and
everything that flows from there looks wrong. What the other instruments read first says where it was: Gauss-Newton
steps of one reading, on what they show beyond the model.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from homeostat.domain.plant.tag import Range
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import replay

FIRST = 30
"""Readings at the beginning that say it: what follows later may have another cause."""
STEPS = 4
"""How often it is worked out, each time from where it was found before: a vessel empties along no straight line."""
SMALL = 0.005
"""By how much a reading is moved to see what follows, as a share of its range [1]."""
TOLD = 0.05
"""Standard deviation to which the others must say it, as a share of its range [1]; else it stays where it was read."""


def begun(
    model: ProcessModel,
    window: Window,
    mean: Vec,
    present: Carried,
    stuck: tuple[str, Range],
    noise: Mapping[str, float],
) -> Window:
    """``window`` with a reading throughout, in place of the ``stuck`` one's, that its first other readings agree with.

    ``mean``: parameters; ``present``: what is wrong besides; ``noise``: variable -> standard deviation of a reading, in
    its unit, of those that are believed. Where they do not say, or the model leaves the physical world: as it is.
    """
    variable, allowed = stuck
    begin = replace(window.part(0, min(window.settle_rows + FIRST, window.length)), unseen=window.unseen)
    names, ticks = tuple(noise), slice(1, begin.length)
    seen = np.stack([begin.readings[v][ticks] for v in names], axis=1)
    weight = np.ones(seen.shape) / np.array(list(noise.values()))
    for j, v in enumerate(names):
        if v in window.held:
            weight[window.held[v][ticks], j] = 0.0

    def left(value: float) -> Vec:
        predicted = replay(model, _with(begin, variable, value), mean[None], present, names).predicted[0]
        return np.asarray(((seen - predicted) * weight).ravel())

    value, small = float(begin.readings[variable][0]), SMALL * allowed.span
    try:
        for _ in range(STEPS):
            side = small if value + small <= allowed.high else -small
            here = left(value)
            slope = (left(value + side) - here) / side
            steep = float(slope @ slope)
            if steep < (TOLD * allowed.span) ** -2:
                return window
            value = allowed.clip(value - float(slope @ here) / steep)
    except ProcessError:
        return window
    return _with(window, variable, value)


def _with(window: Window, variable: str, value: float) -> Window:
    return replace(window, readings={**window.readings, variable: np.full(window.length, value)})
