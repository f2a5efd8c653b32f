"""Adoption: what was unknown in a run, and a person has found the cause of, as rows of the plant's tables."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.agents.hypotheses import LIKELY
from homeostat.domain.diagnosis import (
    SOMETHING_ELSE,
    EffectKind,
    FaultMode,
    FaultProbability,
    FaultState,
    by_fault_set,
    with_a_twin,
)
from homeostat.domain.events.recovery import Diagnosed
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Range
from homeostat.plants.settings.adopted import why_not
from homeostat.record.run_record import RunRecord

SPREAD: Final = (0.25, 3.0)
"""Of what size a cause may be that was seen once, as multiples of that size [1]."""
_DIGITS: Final = 4
_LOST: Final = 0.95
"""Share of a parameter that may be lost; of one of which nothing is left, equations may make no sense [1]."""
_FROM_ANYWHERE: Final = ("degC", "degF", "1")
"""Units of what may be below 0, or is no amount."""


class AdoptionError(ValueError):
    """A run has nothing that can get a name; one line with the reason and the remedy."""


@dataclass(frozen=True, slots=True)
class Adoption:
    """What a person's name for a cause adds to the tables."""

    mode: FaultMode
    """The generated fault mode that the cause is."""
    fault: Mapping[str, str]
    """Column of ``faults.csv`` -> cell."""
    symptoms: tuple[str, ...]
    """Symptoms that were seen and indicate it from now on."""
    cut: str = ""
    """What of its sizes was cut, and why; empty where nothing was."""

    @property
    def rows(self) -> Mapping[str, tuple[Mapping[str, str], ...]]:
        """Table -> rows that are added to it, column -> cell."""
        indicates = tuple({"symptom": symptom, "fault": self.fault["id"]} for symptom in self.symptoms)
        return {"faults": (self.fault,), "symptom_faults": indicates}


def adoption(record: RunRecord, plant: PlantDescription, name: str, label: str, mode: str | None = None) -> Adoption:
    """What calling the unknown of the run's last diagnosis ``name`` adds to the tables of ``plant``.

    ``label``: in the operator's words, those of the mode where empty; ``mode``: which of several it was, where somebody
    has looked. AdoptionError where the name is taken or no name, or where the run does not say what it was.
    """
    if not (name.isascii() and name.isidentifier()):
        raise AdoptionError(f"name {name!r} must be letters, digits and _, not a digit first; choose another one")
    if name == "none" or name in {each.name for each in plant.fault_modes}:
        raise AdoptionError(f"the plant has a fault {name!r} already; choose another name")
    told = [event for event in record.of_kind(Diagnosed) if event.hypotheses]
    if not told:
        raise AdoptionError("nothing was diagnosed in the run, so that there is nothing unknown to give a name to")
    said = by_fault_set(with_a_twin(told[-1].hypotheses))
    state = _chosen(said, plant, mode) if mode else _only(said, plant)
    found = plant.fault_mode(state.fault)
    if unfit := why_not(found):
        raise AdoptionError(f"{found.name!r} cannot be adopted: {unfit}, so that no twin could try it")
    symptoms = _symptoms(record, told, state, plant)
    if not symptoms:
        raise AdoptionError(f"no symptom was seen of {found.name!r}, and a fault needs one that indicates it")
    sizes, cut = _possible(found, _sizes(state.severity, found.severity_range), plant)
    return Adoption(found, _row(found, state, plant, (name, label), sizes), symptoms, cut)


def _only(said: tuple[FaultProbability, ...], plant: PlantDescription) -> FaultState:
    """The one thing that is likely, where the tables do not have it."""
    likely = [each for each in said if each.probability >= LIKELY]
    unknown = [each for each in likely if _is_unknown(each, plant)]
    names = _told(likely)
    if not unknown:
        raise AdoptionError(f"the last diagnosis has no unknown disturbance of one item ({names}): nothing to adopt")
    if len(likely) > 1:
        items = sorted({plant.fault_mode(f.fault).component for each in likely for f in each.faults})
        modes = " or ".join(f"--mode {each.faults[0].fault}" for each in unknown)
        raise AdoptionError(
            f"the last diagnosis is a set ({names}): a look at {' and '.join(items)} tells them apart; say {modes} "
            "once somebody has looked"
        )
    return unknown[0].faults[0]


def _chosen(said: tuple[FaultProbability, ...], plant: PlantDescription, mode: str) -> FaultState:
    """The state of ``mode`` in what was said."""
    unknown = {each.faults[0].fault: each.faults[0] for each in said if _is_unknown(each, plant)}
    if mode not in unknown:
        has = f"; it has {', '.join(unknown)}" if unknown else ""
        raise AdoptionError(f"the last diagnosis does not have {mode!r} by itself as something unknown{has}")
    return unknown[mode]


def _is_unknown(each: FaultProbability, plant: PlantDescription) -> bool:
    names = [fault.fault for fault in each.faults]
    return len(names) == 1 and names != [SOMETHING_ELSE] and not plant.fault_mode(names[0]).listed


def _told(said: list[FaultProbability]) -> str:
    return ", ".join(f"{100.0 * each.probability:.0f} % {each.name}" for each in said)


def _symptoms(record: RunRecord, told: list[Diagnosed], state: FaultState, plant: PlantDescription) -> tuple[str, ...]:
    """What shows the cause: symptoms that began after it and before anything was released.

    At first other causes may be likelier, and what is seen after a release may be what that did. Where nothing was seen
    before, whatever was whenever the cause was among what was said.
    """
    rules = {rule.name for rule in plant.symptom_rules}
    mine = [each for event in told if _says(event, state.fault) for each in event.symptoms if each.rule in rules]
    every = [each for event in told for each in event.symptoms if each.rule in rules and each.at_s >= state.onset_s]
    until_s = next((each.at_s for each in record.released if each.at_s >= state.onset_s), math.inf)
    before = [each for each in (*every, *mine) if each.at_s <= until_s]
    return tuple(dict.fromkeys(each.rule for each in before or mine))


def _says(event: Diagnosed, mode: str) -> bool:
    return any(fault.fault == mode for each in event.hypotheses for fault in each.faults)


def _row(
    mode: FaultMode, state: FaultState, plant: PlantDescription, named: tuple[str, str], sizes: Range
) -> Mapping[str, str]:
    """The row of ``faults.csv``: as frequent as the plant's other faults, and of sizes on the side that was seen."""
    size = mode.severity_range.clip(state.severity)
    prior = sum(fault.prior for fault in plant.faults) / len(plant.faults) if plant.faults else 1.0
    name, label = named
    return {
        "id": name,
        "label": label or mode.label,
        "component": mode.component,
        "severity_unit": mode.severity_unit,
        "nominal": _written(sizes.clip(float(_written(size)))),
        "low": _written(sizes.low),
        "high": _written(sizes.high),
        "prior": _written(prior),
        "disables": mode.disables or "",
        "description": f"{mode.description}: {mode.label}",
        "mode": mode.name,
    }


def _sizes(size: float, allowed: Range) -> Range:
    """From a quarter of ``size`` to three times as much, on its side of nothing and inside what is ``allowed``."""
    size = allowed.clip(size)
    ends = sorted(allowed.clip(float(_written(size * factor))) for factor in SPREAD)
    return Range(*ends)


def _possible(mode: FaultMode, sizes: Range, plant: PlantDescription) -> tuple[Range, str]:
    """Of ``sizes`` what there can be, and what was cut with the reason: no more is lost of a thing than there is."""
    least, most, why = _there(mode, plant)
    ends = [float(_written(min(max(end, least), most))) for end in (sizes.low, sizes.high)]
    if ends == [sizes.low, sizes.high]:
        return sizes, ""
    far = 0 if abs(ends[0]) > abs(ends[1]) else 1
    if not ends[0] < ends[1]:  # what was seen is itself more than there can be
        ends[1 - far] = float(_written(SPREAD[0] * ends[far]))
    kept, was = Range(*ends), (sizes.low, sizes.high)[far]
    return kept, f"sizes end at {_written(ends[far])} {mode.severity_unit} and not at {_written(was)}: {why}"


def _there(mode: FaultMode, plant: PlantDescription) -> tuple[float, float, str]:
    """Between which severities ``mode`` can be, and why not beyond."""
    effect = mode.effect
    if effect is None or not effect.lasts:
        return -math.inf, math.inf, ""
    if effect.kind is EffectKind.BALANCE:
        why = f"nothing on site brings or takes more than {effect.most:.4g} {mode.severity_unit}"
        return -effect.most, effect.most, why
    p = next((each for each in plant.parameters if each.symbol == effect.quantity), None)
    if effect.kind is not EffectKind.PARAMETER or p is None or not p.value or p.unit in _FROM_ANYWHERE:
        return -math.inf, math.inf, ""
    end, why = (
        -_LOST * p.value / effect.per_unit,
        f"{p.symbol} is {p.value:g} {p.unit}, and no more is lost than there is",
    )
    return (end, math.inf, why) if end < 0.0 else (-math.inf, end, why)


def _written(number: float) -> str:
    return f"{number:.{_DIGITS}g}"
