"""What every kernel of a flowsheet does again and again, as blocks: a kernel's own source stays short to compile.

numba looks at a function branch by branch, and at some hundred branches it takes minutes or gives up.
"""

from __future__ import annotations

import math

from homeostat.process.compiled import compiled
from homeostat.process.equipment import clip
from homeostat.process.moving import SAME_S
from homeostat.process.noise import normal
from homeostat.process.types import Vec


@compiled
def begun(severity: float, onset_s: float, t: float) -> float:
    """Severity of a fault at ``t`` [s]: 0 before its onset."""
    return severity if t >= onset_s - SAME_S else 0.0


@compiled
def aged(onset_s: float, t: float) -> float:
    """Seconds since a fault began, 0 before."""
    return t - onset_s if t >= onset_s - SAME_S else 0.0


@compiled
def commanded(automatic: float, by_hand: float) -> float:
    """What reaches an actuator [1]: what is commanded by hand, or else ``automatic``."""
    return clip(automatic if math.isnan(by_hand) else by_hand, 0.0, 1.0)


@compiled
def stuck(go: float, severity: float, stands: float) -> float:
    """Where an actuator goes [1]: to ``stands`` where its fault has begun."""
    return stands if severity > 0.0 else go


@compiled
def shifted(xm: Vec, first: int, last: int, value: float) -> None:
    """A dead time by a tick, in place: columns ``first`` to ``last``, the oldest first, then ``value``."""
    for j in range(first, last):
        xm[j] = xm[j + 1]
    xm[last] = value


@compiled
def sensed(
    was: float, ideal: float, sd: float, noisy: float, seed: int, tick: int, channel: int, every: int, relative: bool
) -> float:
    """What a transmitter shows that showed ``was``: something new each ``every`` ticks, with noise where ``noisy``."""
    if tick % every != 0:
        return was
    if noisy <= 0.0:
        return ideal
    noise = noisy * sd * normal(seed, tick, channel)
    return ideal * (1.0 + noise) if relative else ideal + noise


@compiled
def coloured(noise: float, share: float, loud: float, seed: int, tick: int, channel: int) -> float:
    """Noise of a disturbance after a tick, in standard deviations; it stays where nothing is ``loud``."""
    return noise + share * (loud * normal(seed, tick, channel) - noise) if loud > 0.0 else noise
