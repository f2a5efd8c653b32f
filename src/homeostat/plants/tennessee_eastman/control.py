"""Decentralised control after Ricker (1996): ratios to one production index, inventories, trims and overrides.

Gains are those of the published structure, turned into outputs from 0 to 1. Ratio loops follow their setpoints within
a few ticks, as flows follow their valves within seconds. Trims, overrides and two pairings are switched by commands:

    AC1, AC2, AC4   trims; switched off, a ratio stays where it is, and the feeds stay at the grade that they were for
    PY7             pressure above a bound takes from the production index
    LY8             level of the reactor above a bound takes from the recycle valve of the compressor
    LC12F           the separator's level moves the index, and its liquid valve stays where it is
    LC15U           beside that the stripper's level moves the separator's liquid, and the product valve stays
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from homeostat.process.blocks import Actuator, Flowsheet, Law, Term, limited, maximum, number, term, where


@dataclass(frozen=True)
class Valves:
    """What is commanded: the twelve manipulated variables in their published order."""

    all: tuple[Actuator, ...]

    def __getitem__(self, i: int) -> Actuator:
        """The manipulated variable number ``i``, 1 to 12."""
        return self.all[i - 1]


def controlled(s: Flowsheet) -> Valves:
    """All controllers, outer ones first, and the actuators that they drive."""
    by_separator, below = s.command("LC12F_on") > 0.5, s.command("LC15U_on")
    by_stripper = below > 0.5
    made_by = Law(held=by_separator, meanwhile=s.output("LC12F"))
    _instead(s, "LC12F", "LS", "UC11", by_separator)
    product = s.controller("UC11", "Q11", acts=-1, forward="base_index", law=made_by)
    held_back = _override(s, "PY7", "gain_override" * maximum(s.reading("PR") - "P_override", number(0.0, "kPa")))
    index = limited(0.7 + 0.6 * product.output - held_back, 0.3, 1.3)
    a, ac = _trim(s, "AC1", "yA"), _trim(s, "AC4", "yAC")
    grade = s.command("AC2_on") < 0.5
    g = s.controller("AC2", "X11G", acts=-1, law=Law(least=term(-1.0), held=grade)).output
    level = s.controller("LC8", "LR", acts=-1, forward="base_cold").output
    pressure = s.controller("PC7", "PR", acts=1, forward="base_purge").output
    _instead(s, "LC15U", "LC", "LC12", by_stripper)
    drawn = Law(held=by_separator, meanwhile=where(by_stripper, s.output("LC15U"), s.output("LC12")))
    separator = s.controller("LC12", "LS", 1, "base_V7", setpoint=s.setpoint("LS"), law=drawn).output
    shut = Law(held=by_stripper)
    stripper = s.controller("LC15", "LC", 1, "base_V8", setpoint=s.setpoint("LC"), law=shut).output
    wanted = s.setpoint("X11G") / number(1.0, "%")
    asked = s.memory("grade", lambda was: where(grade, was, wanted), start=GRADE)
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
    stay = {"10": Law(held=by_separator & (below <= 0.5)), "11": Law(held=by_stripper)}
    for name, (setpoint, valve, base) in feeds.items():
        flow = s.controller(f"FC{name}", f"F{name}", -1, base, setpoint=setpoint, law=stay.get(name))
        made[valve] = _valve(s, valve, flow.output)
    cold = s.controller("TC11", "TS", acts=1, forward="base_V11", setpoint="coldest" + level * "span_TS").output
    hot = s.controller("TC9", "TR", acts=1, forward="base_V10").output
    outputs = {"V10": hot, "V11": cold}
    too_full = "gain_level" * maximum(s.reading("LR") - "L_override", number(0.0, "%"))
    made |= {name: _valve(s, name, output) for name, output in outputs.items()}
    made |= {
        "V5": s.actuator("V5", start=0.2221, withheld=_override(s, "LY8", too_full)),
        "V9": s.actuator("V9", start=0.4744573456),
        "V12": s.actuator("V12", start=0.5),
    }
    return Valves(tuple(made[f"V{i}"] for i in range(1, 13)))


GRADE: Final = 53.724
"""Mole fraction of G in the product that the feeds are for at the start [mol %]: as much G as H by mass."""
_STARTS: Final = {
    "V1": 0.6305263039, "V2": 0.5397970677, "V3": 0.2464355755, "V4": 0.6130192144, "V6": 0.4006374673,
    "V7": 0.381003437, "V8": 0.4653415582, "V10": 0.4110581288, "V11": 0.1811349055,
}  # fmt: skip


def _trim(s: Flowsheet, name: str, measured: str) -> Term:
    """By what the composition trims a ratio, from -1 to 1; it stays as it is while the trim is switched off."""
    law = Law(least=term(-1.0), held=s.command(f"{name}_on") < 0.5)
    return s.controller(name, measured, acts=-1, law=law).output


def _override(s: Flowsheet, name: str, takes: Term) -> Term:
    """What an override takes [1], or nothing while it is switched off."""
    return where(s.command(f"{name}_on") < 0.5, 0.0, takes)


def _instead(s: Flowsheet, name: str, measured: str, other: str, switched: Term) -> None:
    """A controller that acts in place of ``other`` while it is ``switched`` on: less output for a higher level."""
    law = Law(held=where(switched, 1.0, 0.0) < 0.5, meanwhile=s.output(other))
    s.controller(name, measured, acts=-1, setpoint=s.setpoint(measured), law=law)


def _valve(s: Flowsheet, name: str, automatic: Term) -> Actuator:
    return s.actuator(name, automatic, start=_STARTS[name])
