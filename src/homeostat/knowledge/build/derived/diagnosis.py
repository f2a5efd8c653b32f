"""What monitoring computes of loops and actuators, and which faults that shows, where no row says it."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.build.derived.actuators import WEAK, fault_names
from homeostat.knowledge.build.derived.draft import Cells, Draft, Line, number, written
from homeostat.knowledge.build.derived.instruments import absolute_noise, is_position
from homeostat.knowledge.build.derived.loops import actuators_of, deviation_of, is_commanded
from homeostat.knowledge.build.derived.parameters import time_constant
from homeostat.knowledge.build.tables.reading import Origin

FILTER: Final = 5.0
"""Filter of a control deviation, in ticks."""
LEAST: Final = 3.0
"""An actuator that follows within so many ticks is not waited for longer."""
LAGS: Final = 3.0
"""Time constants after which an actuator has followed [1]."""
STROKES: Final = 7.0
"""Time constants after which an actuator that opens or closes at once has, by a filter of :data:`LAGS` [1].

From command to position it is 1/2 (exp(-t / 3 tau) - exp(-t / tau)) of its travel, less than 5 % from 7 tau on."""
MOST_S: Final = 600.0
"""No symptom waits for longer for an actuator, by the reference [s]."""
TRAVEL: Final = 0.05
"""A position that is so far from its command does not follow it [1]."""
NOISES: Final = 3.0
"""A deviation counts from so many standard deviations of a reading on [1]."""


@dataclass(frozen=True, slots=True)
class _Sign:
    """A symptom that was added."""

    symptom: str
    """Its name."""
    actuators: tuple[str, ...]
    """What is moved where it is seen."""
    near: frozenset[str]
    """Parts of the plant that it is about."""
    deviation: bool
    """Whether it is one of a loop, or else one of a position."""


def add_diagnosis(draft: Draft) -> None:
    """Add features, symptoms and what they indicate; signals, faults and loops must be there already."""
    instruments = {line["tag"]: line for line in draft.lines("instruments")}
    stated = draft.column("symptom_faults", "symptom")
    signs = [*_deviations(draft, instruments), *_positions(draft)]
    told = draft.column("symptom_faults", "fault")
    for line in draft.lines("faults"):
        if line["id"] not in told:
            for sign in _shown(line, signs):
                draft.add("symptom_faults", line.follows, {"symptom": sign.symptom, "fault": line["id"]})
    for sign in signs:
        if sign.symptom not in stated | draft.column("symptom_faults", "symptom"):
            _indicate_something(draft, sign)


def _deviations(draft: Draft, instruments: Mapping[str, Line]) -> Iterator[_Sign]:
    for line in draft.lines("loops"):
        held, instrument = draft.find("signals", line["pv"]), instruments.get(line["pv"])
        scale = number(held["scale"]) if held is not None else None
        if held is None or scale is None:
            continue
        noise = absolute_noise(instrument) if instrument is not None else 0.0
        about = {"unit": held["unit"], "component": held["component"], "description": f"Deviation of {line['pv']}"}
        filter_s = written(FILTER * draft.timing.tick_s)
        deviation = f"{line['pv']} - {line['sp']}" if is_commanded(draft, line["sp"]) else deviation_of(draft, line)
        feature = about | {"expression": deviation, "filter_s": filter_s}
        size = {"sigma": "7", "threshold": written(max(scale, NOISES * noise)), "on_delay_s": filter_s}
        words = f"{line['pv']} is not at its setpoint"
        symptom = _add(draft, line.follows, line["id"], feature, size | {"description": words})
        if symptom is None:
            continue
        driven, place = actuators_of(draft, line), instrument["at"] if instrument is not None else ""
        yield _Sign(symptom, driven, frozenset({held["component"], line["controller"], place, *driven}), True)


def _positions(draft: Draft) -> Iterator[_Sign]:
    """Positions against commands; what no loop drives is opened and closed at once, as a recipe does."""
    driven = {name for line in draft.lines("loops") for name in actuators_of(draft, line)}
    for line in draft.lines("instruments"):
        shown, command = draft.find("signals", line["tag"]), draft.find("signals", f"{line['at']}.cmd")
        if not is_position(draft, line) or shown is None or command is None or shown["unit"] != command["unit"]:
            continue
        tau_s, lags = time_constant(draft, line["at"]), LAGS if line["at"] in driven else STROKES
        lag_s, delay_s = (_followed_s(draft.timing, each * tau_s) for each in (LAGS, lags))
        about = {"unit": shown["unit"], "component": line["at"], "description": f"{line['at']}: position and command"}
        feature = about | {"expression": f"{line['tag']} - {command['tag']}", "filter_s": written(lag_s)}
        size = {
            "sigma": "8",
            "threshold": written(max(TRAVEL, NOISES * absolute_noise(line))),
            "on_delay_s": written(delay_s),
        }
        words = f"{line['at']} does not follow its command"
        symptom = _add(draft, line.follows, line["at"], feature, size | {"description": words})
        if symptom is not None:
            yield _Sign(symptom, (line["at"],), frozenset({line["id"], line["at"]}), False)


def _followed_s(timing: Timing, after_s: float) -> float:
    """How long an actuator is waited for that has followed ``after_s`` [s], in whole ticks [s]."""
    lag_s = timing.at_s(math.ceil(after_s / timing.tick_s))
    return max(timing.at_s(LEAST), min(lag_s, timing.time_s(MOST_S)))


def _add(draft: Draft, origin: Origin, name: str, feature: Cells, symptom: Cells) -> str | None:
    """Add a feature with its symptom; the symptom's name, None where one of them is omitted."""
    draft.add("features", origin, {"id": f"F-{name}", "window_s": "0"} | feature)
    own = {"id": f"S-{name}-OFF", "feature": f"F-{name}", "direction": "both"}
    if draft.find("features", own["feature"]) is None:
        return None
    draft.add("symptoms", origin, own | symptom)
    return own["id"] if draft.find("symptoms", own["id"]) is not None else None


def _shown(fault: Line, signs: list[_Sign]) -> list[_Sign]:
    """The symptoms nearest to a fault, or else every deviation; an actuator that is only weak takes its position."""
    weak = fault["id"].endswith(f"_{WEAK}")
    seen = [sign for sign in signs if sign.deviation or not weak]
    near = [sign for sign in seen if fault["component"] in sign.near]
    if any(sign.deviation for sign in near) or (near and not weak):
        return near
    return [sign for sign in seen if sign.deviation] or seen


def _indicate_something(draft: Draft, sign: _Sign) -> None:
    """A symptom that no fault is near to indicates those of its actuator, or else every fault."""
    names = {name for actuator in sign.actuators for name in fault_names(actuator)}
    own = [line for line in draft.lines("faults") if line["id"] in names]
    for line in own or draft.lines("faults"):
        draft.add("symptom_faults", line.follows, {"symptom": sign.symptom, "fault": line["id"]})
