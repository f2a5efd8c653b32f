"""What a row of a parameter leaves open: its component, and unit and words of the standard ones."""

from collections.abc import Iterator

from homeostat.knowledge.build.derived.draft import Cells, Draft, Line, number
from homeostat.knowledge.build.derived.loops import system_of


def fill_parameters(draft: Draft) -> None:
    """Fill the rows of parameters; what follows from loops must be there already."""
    system, standard = system_of(draft), dict(_standard(draft))
    for line in draft.lines("parameters"):
        parts = line["symbol"].split("_")
        ends = ("_".join(parts[first:]) for first in range(1, len(parts)))
        own = {"sd": "0", "spread": "absolute"}
        own["component"] = next((end for end in ends if draft.find("equipment", end)), system)
        draft.fill("parameters", line, own | standard.get(line["symbol"], {}))


def time_constant(draft: Draft, actuator: str) -> float:
    """Time constant of an actuator [s]; 0 where none is stated."""
    line = draft.find("parameters", f"tau_{actuator}")
    return 0.0 if line is None else number(line["value"]) or 0.0


def _standard(draft: Draft) -> Iterator[tuple[str, Cells]]:
    """Symbol -> what is known of a parameter that every actuator, and of two that every loop has."""
    for line in draft.lines("equipment"):
        if line["kind"] == "Actuator":
            yield f"tau_{line['id']}", {"unit": "s", "description": f"Time constant of {line['id']}"}
    for line in draft.lines("loops"):
        yield from _gains(line, draft.find("signals", line["pv"]))


def _gains(line: Line, held: Line | None) -> Iterator[tuple[str, Cells]]:
    above, _, below = (held["unit"] if held is not None else "1").partition("/")
    each = "1" if above == "1" and not below else f"{below or 1}/{above}"
    each_s = f"1/{above}" if below == "s" else "1/s" if each == "1" else f"{below or 1}/({above} s)"
    own = {"component": line["controller"]}
    yield line["gain"], own | {"unit": each, "description": f"Proportional gain of {line['id']}"}
    yield line["reset"], own | {"unit": each_s, "description": f"Integral gain of {line['id']}"}
