"""What follows from a row of an instrument: its equipment, its tag, how wrong it is, and when it is believed."""

from typing import Final

from homeostat.knowledge.build.derived.draft import Cells, Draft, Line, number, one_digit, written
from homeostat.knowledge.checks.consistency_bounds import NOISE

STALE: Final = 5.0
"""A reading that is older is no reading, in ticks."""
FROZEN: Final = 10.0
"""A noisy reading that stays the same for longer is frozen, in ticks."""
SAMPLES: Final = 3.0
"""An analyser whose samples stay the same for longer is frozen, in samples: noise makes two that are equal next to
impossible, and two in a row may be lost, when the last one stands for them."""
LOST: Final = 2.0
"""How old a sample may be besides, in samples: one may be lost, or be told a dead time of as much late."""
DOUBTED: Final = 5.0
"""For so long a reading may be missing or doubted before somebody acts, in ticks."""
SCALE: Final = 0.01
"""Share of a range that counts as one where a formula mixes units [1]."""


def add_instruments(draft: Draft) -> None:
    """Add equipment, signals, sensors and quality of every instrument."""
    held = draft.column("loops", "pv")
    for line in draft.lines("instruments"):
        low, high = number(line["low"]), number(line["high"])
        if low is None or high is None or not low < high:
            continue
        position = is_position(draft, line) and line["tag"] not in held
        _add(draft, line, variable_of(line), line["scale"] or written(one_digit(SCALE * (high - low))), position)
        if line["noise"]:
            draft.add("quality", line.follows, _quality(draft, line, high - low))


def is_position(draft: Draft, line: Line) -> bool:
    """Whether an instrument shows where an actuator stands."""
    place = draft.find("equipment", line["at"])
    return place is not None and place["kind"] == "Actuator"


def variable_of(line: Line) -> str:
    """The quantity of the process model that an instrument shows."""
    return line["variable"] or plain(line["tag"])


def plain(tag: str) -> str:
    """The quantity of the process model that a tag stands for by its name."""
    return tag.replace(".", "_")


def absolute_noise(line: Line) -> float:
    """Standard deviation of an instrument's noise in the unit of its tag; 0 where it has none, or a relative one."""
    relative = line["noise_unit"] not in ("", line["unit"])
    return 0.0 if relative else number(line["noise"]) or 0.0


def _add(draft: Draft, line: Line, variable: str, scale: str, position: bool) -> None:
    label = line["label"] or f"Transmitter of {line['tag']}"
    equipment = {"id": line["id"], "kind": "Sensor", "part_of": line["at"], "label": label}
    draft.add("equipment", line.follows, equipment)
    own = {column: line[column] for column in ("tag", "unit", "low", "high", "description")}
    role = line["role"] or ("STATUS" if position else "PV")
    place = {"component": line["id"], "relation": "measures", "variable": variable}
    draft.add("signals", line.follows, own | {"role": role, "scale": scale} | place)
    if not line["noise"]:
        return
    errors = {
        "component": line["id"],
        "parameter_bias": line["parameter_bias"] or f"bias_{variable}",
        "parameter_noise": line["parameter_noise"] or f"sd_{variable}",
        "bias_sd": line["bias"],
        "noise_sd": line["noise"],
        "noise_unit": line["noise_unit"] or line["unit"],
    }
    relative = errors["noise_unit"] != line["unit"]
    draft.add("sensors", line.follows, errors | ({"description": "Relative to reading"} if relative else {}))


def _quality(draft: Draft, line: Line, span: float) -> Cells:
    """When a reading is believed; one without noise of its own may stay the same for long."""
    noise, tick_s, every_s = absolute_noise(line), draft.timing.tick_s, number(line["every_s"])
    sampling_s = draft.timing.sampling_s(every_s)
    noisy = NOISE[0] * span <= noise <= NOISE[1] * span
    frozen_s, stale_s = max(FROZEN * tick_s, SAMPLES * sampling_s), STALE * tick_s
    if sampling_s > tick_s:
        stale_s += LOST * sampling_s
    seen = {"noise": line["noise"], "frozen_s": written(frozen_s)} if noisy else {}
    seen |= {"every_s": line["every_s"]} if every_s is not None else {}
    fast = {"fastest": line["fastest"]} if line["fastest"] else {}
    words = f"Follows from the row of {line['id']} in instruments.csv"
    return (
        {
            "tag": line["tag"],
            "stale_s": written(stale_s),
            "grace_s": written(DOUBTED * tick_s),
            "description": words,
        }
        | seen
        | fast
    )
