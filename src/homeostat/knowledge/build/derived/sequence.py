"""What states, transitions and limits leave open: ranks, events, decisions, and guards by their names."""

from homeostat.knowledge.build.derived.draft import Cells, Draft, Line
from homeostat.knowledge.build.derived.expansion import starts
from homeostat.knowledge.build.derived.loops import system_of

DIAGNOSED = "fault_diagnosed"
"""Event of a recovery."""
TRIPPED = "trip"
"""Event of a transition to where a fallback leads to."""
RESTARTED = "restart"
"""Event of a transition back to where the plant starts."""


def fill_sequence(draft: Draft) -> None:
    """Fill the rows of states, transitions, setpoints, fallbacks, limits and equipment."""
    formulas = {line["name"]: line["formula"] for line in draft.lines("guards")}
    safe = draft.column("fallbacks", "target")
    _states(draft, safe, formulas)
    for line in draft.lines("transitions"):
        _transition(draft, line, safe, formulas)
    for line in draft.lines("setpoints"):
        draft.fill("setpoints", line, {"low": line["design"], "high": line["design"]})
    for line in draft.lines("fallbacks"):
        draft.fill("fallbacks", line, {"out_of_service": "yes"})
    for line in draft.lines("limits"):
        draft.fill("limits", line, {"kind": "trip limit"})
        draft.fill("limits", line, {"hard": "yes" if line["kind"] == "trip limit" else "no"})
    system = system_of(draft)
    for line in draft.lines("equipment"):
        if not line["part_of"] and line["kind"] != "System":
            line.cells["part_of"] = system


def _states(draft: Draft, safe: frozenset[str], formulas: Cells) -> None:
    """The first state is the initial one, and the first after start-up the best: each further one has more risk."""
    lines = draft.lines("states")
    marked = bool(draft.column("states", "initial"))
    first = next((place for place, line in enumerate(lines) if not starts(line)), 0)
    for place, line in enumerate(lines):
        begins = starts(line)
        own = {
            "label": line["id"].replace("_", " ").capitalize(),
            "initial": "yes" if place == 0 and not marked else "no",
            "recovery_target": "no" if begins or line["id"] in safe else "yes",
            "risk": str(max(0, place - first)),
            "start_up": "yes" if begins else "no",
            "settled_when": "true",
        }
        draft.fill("states", line, own)
        _name_formula(line, "settled_when", formulas)


def _transition(draft: Draft, line: Line, safe: frozenset[str], formulas: Cells) -> None:
    source, target = draft.find("states", line["source"]), draft.find("states", line["target"])
    awaited = source is not None and source["start_up"] == "yes"
    draft.fill("transitions", line, {"decision": "no" if awaited else "yes", "guard": "true"})
    if line["decision"] == "no":
        event = line["id"]
    elif target is not None and target["initial"] == "yes":
        event = RESTARTED
    elif target is not None and target["recovery_target"] == "no" and target["id"] in safe:
        event = TRIPPED
    else:
        event = DIAGNOSED
    draft.fill("transitions", line, {"event": event})
    _name_formula(line, "guard", formulas)


def _name_formula(line: Line, column: str, formulas: Cells) -> None:
    line.cells[column] = formulas.get(line[column], line[column])
