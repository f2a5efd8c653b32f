"""What follows from a row of an actuator: the tag that drives it, and the standard ways in which it fails."""

from typing import Final

from homeostat.knowledge.build.derived.draft import Cells, Draft
from homeostat.knowledge.build.derived.loops import actuators_of, add_command, has_two_positions

COMMAND: Final = ".cmd"
"""Ending of the tag that commands an actuator."""
MANUAL: Final = ".man"
"""Ending of its manual output."""
STUCK_OPEN: Final = "stuck_open"
"""Ending of the fault of an actuator that stays open."""
STUCK_CLOSED: Final = "stuck_closed"
"""Ending of the fault of an actuator that stays closed."""
WEAK: Final = "weak"
"""Ending of the fault of an actuator that does less than it should."""
_FAULTS: Final[dict[str, tuple[str, str, Cells]]] = {
    STUCK_OPEN: ("stuck open", "It stays at severity whatever the command", {"nominal": "1", "high": "1"}),
    STUCK_CLOSED: ("stuck closed", "It stays at 1 - severity whatever the command", {"nominal": "1", "high": "1"}),
    WEAK: ("weak", "It lost severity of its capacity", {"nominal": "0.5", "high": "0.95"}),
}
"""Ending of the name -> words for the label, what severity means, its nominal and highest value."""


def fault_names(actuator: str) -> tuple[str, ...]:
    """The standard faults of an actuator."""
    return tuple(f"{actuator}_{ending}" for ending in _FAULTS)


def add_actuators(draft: Draft) -> None:
    """Add commands of actuators without a loop, and faults of all; what follows from loops must be there already."""
    driven = {name for line in draft.lines("loops") for name in actuators_of(draft, line)}
    drives = [line for line in draft.lines("signals") if line["relation"] == "drives"]
    otherwise = {line["component"] for line in drives if line["tag"] != f"{line['component']}{COMMAND}"}
    for line in draft.lines("equipment"):
        if line["kind"] != "Actuator":
            continue
        if line["id"] not in driven | otherwise:
            add_command(draft, line.follows, line["id"], by_hand=True)
        for ending, (words, meaning, size) in _FAULTS.items():
            own = {
                "id": f"{line['id']}_{ending}",
                "label": f"{line['label']}: {words}",
                "component": line["id"],
                "severity_unit": "1",
                "low": "0.05",
                "prior": "0.1",
                "disables": "" if ending == WEAK else line["id"],
                "description": meaning,
            }
            if ending == WEAK and draft.find("faults", own["id"]) is None and _opens_or_closes(draft, line["id"]):
                draft.pass_over("faults", own)  # what is open or closed has no capacity to lose
                continue
            draft.add("faults", line.follows, own | size)


def _opens_or_closes(draft: Draft, actuator: str) -> bool:
    """Whether what drives an actuator has two positions."""
    drives = [line for line in draft.lines("signals") if line["relation"] == "drives"]
    return any(has_two_positions(line) for line in drives if line["component"] == actuator)
