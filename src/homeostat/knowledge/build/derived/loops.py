"""What follows from a row of a loop: its controller, operator and flows, and the tags of setpoint, output and error."""

from typing import Final

from homeostat.knowledge.build.derived.draft import Draft, Line, number, one_digit, written
from homeostat.knowledge.build.derived.expansion import ALSO
from homeostat.knowledge.build.derived.instruments import plain
from homeostat.knowledge.build.derived.streams import operator_of, stated_operators
from homeostat.knowledge.build.tables.reading import Origin

RANGE_S: Final = 200.0
"""A setpoint is ramped through its range in this time, by the reference, where nothing else is stated [s]."""
BY_HAND_S: Final = 5.0
"""An actuator is moved through its range by hand in this time, by the reference [s]."""
INCREMENT: Final = 0.5
"""Share of a tag's scale that is the step in which it is set by hand [1]."""


def add_loops(draft: Draft) -> None:
    """Add what follows from every loop; operators of the plant's parts must be there already."""
    for line in draft.lines("loops"):
        held, driven = draft.find("signals", line["pv"]), actuators_of(draft, line)
        name, label = line["id"], held["description"] if held else line["pv"]
        own = {
            "controller": name,
            "operator": f"PO_{name}",
            "sp": f"{line['pv']}.sp",
            "gain": f"Kp_{name}",
            "reset": f"Ki_{name}",
            "label": label,
        }
        draft.fill("loops", line, own)
        place = _place(draft, driven[0] if driven else "")
        controller = {"kind": "InformationProcessing", "part_of": place, "label": f"Controller of {line['pv']}"}
        draft.add("equipment", line.follows, {"id": line["controller"]} | controller)
        _add_operator(draft, line, place, driven)
        if held is not None:
            _add_setpoint(draft, line, held)
        for actuator in driven:
            add_command(draft, line.follows, actuator, by_hand=False)
            _add_manual(draft, line.follows, actuator)


def commands_of(line: Line) -> tuple[str, ...]:
    """What a loop commands: one tag, or several that share the output of its controller."""
    return (line["mv"], *line[ALSO].split())


def actuators_of(draft: Draft, line: Line) -> tuple[str, ...]:
    """The actuators that a loop drives, those that are there."""
    return tuple(filter(None, (actuator_of(draft, command) for command in commands_of(line))))


def actuator_of(draft: Draft, command: str) -> str:
    """The actuator that a command drives: as the signals say, or else the one that the tag is named after."""
    line = draft.find("signals", command)
    name = (line["component"] if line is not None else "") or command.removesuffix(".cmd")
    place = draft.find("equipment", name)
    return name if place is not None and place["kind"] == "Actuator" else ""


def add_command(draft: Draft, origin: Origin, actuator: str, by_hand: bool) -> None:
    """Add the tag that drives an actuator; ``by_hand`` where no loop does."""
    own = {"tag": f"{actuator}.cmd", "relation": "drives", "description": f"Command to {actuator}"}
    _add_output(draft, origin, actuator, own, by_hand)


def _add_manual(draft: Draft, origin: Origin, actuator: str) -> None:
    words = f"Manual output of {actuator} (automatic where not given)"
    own = {"tag": f"{actuator}.man", "relation": "overrides", "description": words}
    _add_output(draft, origin, actuator, own, by_hand=True)


def _add_output(draft: Draft, origin: Origin, actuator: str, own: dict[str, str], by_hand: bool) -> None:
    rate = written(1.0 / draft.timing.time_s(BY_HAND_S))
    steps = has_two_positions(draft.find("signals", own["tag"]))
    speed = {"rate_limit": "" if steps else rate, "increment": "0.01"} if by_hand else {}
    shared = {"role": "MV", "unit": "1", "low": "0", "high": "1", "scale": "0.05", "component": actuator}
    draft.add("signals", origin, own | shared | {"variable": plain(own["tag"])} | speed)


def has_two_positions(stated: Line | None) -> bool:
    """Whether a stated row of a manipulated value says that one step leads from one end of its range to the other."""
    if stated is None:
        return False
    low, high, increment = (number(stated[column]) for column in ("low", "high", "increment"))
    return increment is not None and increment >= (1.0 if high is None else high) - (0.0 if low is None else low)


def _add_setpoint(draft: Draft, line: Line, held: Line) -> None:
    """Add setpoint and control error of what is ``held``."""
    low, high, scale = (number(held[column]) for column in ("low", "high", "scale"))
    if low is None or high is None or scale is None or not low < high:
        return
    span, error = high - low, f"{line['pv']}.err"
    shared = {"unit": held["unit"], "scale": held["scale"], "component": line["controller"]}
    setpoint = {
        "tag": line["sp"],
        "role": "SP",
        "low": held["low"],
        "high": held["high"],
        "rate_limit": written(one_digit(span / draft.timing.time_s(RANGE_S))),
        "increment": written(one_digit(INCREMENT * scale)),
        "relation": "sets",
        "variable": plain(line["sp"]),
        "description": f"Setpoint of {line['pv']}",
    }
    draft.add("signals", line.follows, shared | setpoint)
    deviation = {
        "tag": error,
        "role": "STATUS",
        "low": written(-span),
        "high": written(span),
        "relation": "reports",
        "variable": plain(error),
        "description": f"Control deviation of {line['pv']} (PV - SP)",
    }
    draft.add("signals", line.follows, shared | deviation)


def _add_operator(draft: Draft, line: Line, place: str, driven: tuple[str, ...]) -> None:
    operator = line["operator"]
    operators = stated_operators(draft)
    names = (operator_of(part, operators) for part in (*driven, place))
    successor = next((name for name in names if draft.find("operators", name)), "")
    own = {"id": operator, "resource": place, "successor": successor, "label": f"Control {line['pv']}"}
    draft.add("operators", line.follows, own)
    said = [("input", "Reading", line["pv"]), ("input", "Setpoint", line["sp"])]
    inner = draft.column("loops", "sp") | {f"{each['pv']}.sp" for each in draft.lines("loops")}
    said += [("output", "Setpoint" if tag in inner else "Command", tag) for tag in commands_of(line)]
    for direction, word, tag in said:
        flow = {"operator": operator, "direction": direction, "flow": f"info_{plain(tag)}", "kind": "Information"}
        draft.add("flows", line.follows, flow | {"tag": tag, "label": f"{word} {tag}"})


def is_commanded(draft: Draft, setpoint: str) -> bool:
    """Whether a state or a fallback gives this setpoint; else another controller does, and from outside it has none."""
    return setpoint in draft.column("setpoints", "tag") | draft.column("fallbacks", "tag")


def driven_by_loops(draft: Draft) -> frozenset[str]:
    """The actuators that have an automatic command: what is driven by a tag that a loop commands."""
    by_loop = {command for line in draft.lines("loops") for command in commands_of(line)}
    return frozenset(line["component"] for line in draft.lines("signals") if line["tag"] in by_loop)


def deviation_of(draft: Draft, line: Line) -> str:
    """What the controller of a loop says that it is off its setpoint by."""
    said = (
        s["tag"] for s in draft.lines("signals") if (s["relation"], s["component"]) == ("reports", line["controller"])
    )
    return next(said, f"{line['pv']} - {line['sp']}")


def _place(draft: Draft, driven: str) -> str:
    """The part of the plant that the actuator of a loop is in, or else the whole plant."""
    actuator = draft.find("equipment", driven)
    return actuator["part_of"] if actuator is not None else system_of(draft)


def system_of(draft: Draft) -> str:
    """The whole plant."""
    return next((line["id"] for line in draft.lines("equipment") if line["kind"] == "System"), "")
