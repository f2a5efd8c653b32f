"""Decentralised control after Ricker (1996): ratios to one production index, inventories, trims and overrides.

Gains are those of the published structure, turned into outputs from 0 to 1. Ratio loops follow their setpoints within
a few ticks, as flows follow their valves within seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from homeostat.process.blocks import Actuator, Flowsheet, Law, Term, limited, maximum, number, term


@dataclass(frozen=True)
class Valves:
    """What is commanded: the twelve manipulated variables in their published order."""

    all: tuple[Actuator, ...]

    def __getitem__(self, i: int) -> Actuator:
        """The manipulated variable number ``i``, 1 to 12."""
        return self.all[i - 1]


def controlled(s: Flowsheet) -> Valves:
    """All controllers, outer ones first, and the actuators that they drive."""
    trim = Law(least=term(-1.0))
    product = s.controller("UC11", "Q11", acts=-1, forward="base_index")
    held_back = "gain_override" * maximum(s.reading("PR") - "P_override", number(0.0, "kPa"))
    index = limited(0.7 + 0.6 * product.output - held_back, 0.3, 1.3)
    a = s.controller("AC1", "yA", acts=-1, law=trim).output
    ac = s.controller("AC4", "yAC", acts=-1, law=trim).output
    g = s.controller("AC2", "X11G", acts=-1, law=trim).output
    level = s.controller("LC8", "LR", acts=-1, forward="base_cold").output
    pressure = s.controller("PC7", "PR", acts=1, forward="base_purge").output
    separator = s.controller("LC12", "LS", acts=1, forward="base_V7").output
    stripper = s.controller("LC15", "LC", acts=1, forward="base_V8").output
    asked = s.setpoint("X11G") / number(1.0, "%")
    richer = (1.5192e-3 * asked + 0.59446) * asked + 0.2769
    leaner = (-1.1377e-3 * asked - 0.80893) * asked + 91.06
    feeds = {
        "1": (index * ("ratio_F1" + a * "trim_F1"), "V3", "base_V3"),
        "2": (index * "ratio_F2" * (richer / 36.6 + 0.1 * g), "V1", "base_V1"),
        "3": (index * "ratio_F3" * (leaner / 44.3 - 0.1 * g), "V2", "base_V2"),
        "4": (index * ("ratio_F4" + ac * "trim_F4" - a * "trim_F1"), "V4", "base_V4"),
        "9": (index * pressure * "most_F9", "V6", "base_V6"),
        "10": (index * separator * "most_F10", "V7", "base_V7"),
        "11": (index * stripper * "most_F11", "V8", "base_V8"),
    }
    made: dict[str, Actuator] = {}
    for name, (setpoint, valve, base) in feeds.items():
        flow = s.controller(f"FC{name}", f"F{name}", acts=-1, forward=base, setpoint=setpoint)
        made[valve] = _valve(s, valve, flow.output)
    cold = s.controller("TC11", "TS", acts=1, forward="base_V11", setpoint="coldest" + level * "span_TS").output
    hot = s.controller("TC9", "TR", acts=1, forward="base_V10").output
    outputs = {"V10": hot, "V11": cold}
    made |= {name: _valve(s, name, output) for name, output in outputs.items()}
    made |= {
        "V5": s.actuator("V5", start=0.2221),
        "V9": s.actuator("V9", start=0.4744573456),
        "V12": s.actuator("V12", start=0.5),
    }
    return Valves(tuple(made[f"V{i}"] for i in range(1, 13)))


_STARTS: Final = {
    "V1": 0.6305263039, "V2": 0.5397970677, "V3": 0.2464355755, "V4": 0.6130192144, "V6": 0.4006374673,
    "V7": 0.381003437, "V8": 0.4653415582, "V10": 0.4110581288, "V11": 0.1811349055,
}  # fmt: skip


def _valve(s: Flowsheet, name: str, automatic: Term) -> Actuator:
    return s.actuator(name, automatic, start=_STARTS[name])
