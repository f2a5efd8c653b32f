"""A scripted tank for tests: a level that follows its setpoint, and a temperature that cooling by hand lowers."""

from __future__ import annotations

from homeostat.links.simulated import SimulatedLink
from tests.equipment.links.misbehaving.link import Misbehaving, Misbehaviour
from tests.equipment.links.scripted import PlantScript, Push, ScriptedPlant, ScriptedTag


def script(end_s: float = 600.0, noise: float = 0.0, pushes: tuple[Push, ...] = (), seed: int = 0) -> PlantScript:
    """The tank, quiet unless ``noise`` is stated."""
    level = ScriptedTag("L", 10.0, {"L.sp": 1.0}, lag_s=5.0, noise=noise)
    heat = ScriptedTag("T", 300.0, {"cool.man": -20.0}, lag_s=5.0, noise=noise)
    return PlantScript((level, heat), {"L.sp": 10.0, "cool.man": None}, end_s, pushes, seed=seed)


def tank(end_s: float = 600.0) -> SimulatedLink:
    return SimulatedLink(ScriptedPlant(script(end_s)))


def misbehaving(*misbehaviours: Misbehaviour) -> tuple[Misbehaving, SimulatedLink]:
    """The tank that misbehaves, and the honest link beneath."""
    beneath = SimulatedLink(ScriptedPlant(script(noise=1.0)))
    return Misbehaving(beneath, misbehaviours), beneath
