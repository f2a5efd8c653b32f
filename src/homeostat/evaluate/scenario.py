"""A scenario: which plant, which faults are truly there, which seed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import Self

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.disturbance import Disturbance, DisturbanceError
from homeostat.links.truth.disturbed import Disturbed, Targets
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.truth import NONE, find_mismatch, true_model
from homeostat.process.batch import tick_of

LONGEST = 86_400
"""Longest run, in ticks: each of them is kept in memory."""
_NOTHING = 1e-9
"""Share of a disturbance that is none: a sine at its zeros."""
LARGEST_SEED = 2**32 - 1
"""Largest seed; every draw comes from a child of it (:mod:`homeostat.process.seeds`)."""


class ScenarioError(ValueError):
    """A scenario asks for something that the plant does not have; the message says what to do."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """The ground truth of one run; no agent, twin or guard sees it."""

    case: str
    """Name of the plant."""
    faults: tuple[FaultState, ...]
    """Injected faults; empty for a fault-free run."""
    seed: int
    """Seed of the plant's parameters, its disturbances and the twin's draws."""
    end_s: float
    """Process time at which the run ends [s]."""
    disturbances: tuple[Disturbance, ...] = ()
    """What else happens to the true plant, which no table knows."""
    mismatch: str = NONE
    """How the true plant is not the model that its twin has: one of the plant's mismatches, or 'none'."""

    repaired_s: float | None = None
    """Process time at which every fault ends, because somebody repaired it [s]; None where it stays."""
    begins_in: str = ""
    """State of the machine that it begins in; empty for that by design (:mod:`homeostat.evaluate.beginning`)."""
    setpoints: tuple[tuple[str, float], ...] = ()
    """What an operator has set by then: tag and value, in its unit; the rest is by design."""

    @property
    def fault(self) -> str:
        """Names of the faults joined by '+'; 'none' for a fault-free run."""
        return "+".join(f.fault for f in self.faults) or "none"

    @property
    def onset_s(self) -> float | None:
        """Process time of the first fault or disturbance [s]; None where there is neither."""
        begun = [*(f.onset_s for f in self.faults), *(d.from_s for d in self.disturbances)]
        return min(begun, default=None)

    @property
    def undisturbed(self) -> Self:
        """The same true plant, to which nothing happens."""
        return replace(self, faults=(), disturbances=(), repaired_s=None)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault that is truly there in a run; what is left out is as the plant's tables and settings have it."""

    name: str
    """Name of the fault, as the tables have it."""
    severity: float | None = None
    """How severe, in the fault's unit; the nominal severity where None."""
    onset_s: float | None = None
    """Process time from which it acts [s]; the plant's usual onset where None."""


def scenario_of(plant: Plant, faults: Sequence[Fault], seed: int, end_s: float | None = None) -> Scenario:
    """The scenario of ``faults``; raises as :func:`scenario`."""
    if not faults:
        return scenario(plant, "none", seed, end_s=end_s)
    each = [scenario(plant, f.name, seed, f.onset_s, f.severity, end_s) for f in faults]
    states = tuple(state for one in each for state in one.faults)
    if len({state.fault for state in states}) != len(states):
        raise ScenarioError(f"{'+'.join(state.fault for state in states)!r} names a fault twice; name each once")
    return replace(each[0], faults=states)


def scenario(
    plant: Plant,
    fault: str,
    seed: int,
    onset_s: float | None = None,
    severity: float | None = None,
    end_s: float | None = None,
    location: str | None = None,
) -> Scenario:
    """The scenario of ``fault``: a fault's name, several joined by '+', or 'none'.

    They act from ``onset_s`` on, and the run ends at ``end_s`` [s of process time]; the plant's defaults where None. Of
    a single fault, ``severity`` is in its unit, the nominal one where None; ``location`` says where it is, for faults
    that are named ``fault_location``. ScenarioError where the plant has no such thing, or one is out of range.
    """
    if not isinstance(fault, str):
        raise ScenarioError(f"fault {fault!r} must be a name, as the plant's tables have it")
    _check_numbers({"end_s": end_s, "onset_s": onset_s, "severity": severity}, seed)
    end = plant.end_s if end_s is None else end_s
    onset = plant.onset_s if onset_s is None else onset_s
    names = [] if fault == "none" else fault.split("+")
    if location is not None:
        names = [_located(plant, names, location)]
    if not 0 <= seed <= LARGEST_SEED:
        raise ScenarioError(f"seed {seed} must lie in 0 to {LARGEST_SEED}")
    tick_s = plant.description.timing.tick_s
    if not tick_s <= end <= LONGEST * tick_s:
        raise ScenarioError(f"end of the run {end:g} s must lie in {tick_s:g} s to {LONGEST * tick_s:g} s")
    if onset_s is not None and not names:
        raise ScenarioError(f"onset {onset_s:g} s needs a fault; name one, or leave the onset out")
    if names and not 0.0 <= onset < end:
        remedy = "choose an earlier onset, or a later end" if onset >= end else "choose an onset from 0 s on"
        raise ScenarioError(f"onset {onset:g} s must lie in the run, 0 s to {end:g} s; {remedy}")
    if severity is not None and len(names) != 1:
        raise ScenarioError(f"severity {severity:g} needs exactly one fault, and {_named(names)}")
    states = []
    for name in names:
        try:
            mode = plant.description.fault(name)
        except ValueError as unknown:
            raise ScenarioError(str(unknown)) from None
        size = mode.severity_nominal if severity is None else severity
        if not mode.severity_range.contains(size):
            unit = "" if mode.severity_unit == "1" else f" {mode.severity_unit}"
            allowed = f"{mode.severity_range.low:g} to {mode.severity_range.high:g}{unit}"
            raise ScenarioError(f"severity {size:g} of {name!r} must lie in {allowed} ({mode.description})")
        states.append(FaultState(name, size, onset))
    if len(set(names)) != len(names):
        raise ScenarioError(f"{fault!r} names a fault twice; name each once")
    return Scenario(plant.name, tuple(states), seed, end)


def departing(plant: Plant, chosen: Scenario, disturbances: Sequence[str] = (), mismatch: str = NONE) -> Scenario:
    """``chosen`` on a true plant that differs from its model by ``mismatch``, and to which ``disturbances`` happen.

    ScenarioError where the plant has no such mismatch, or cannot be disturbed like that.
    """
    if isinstance(disturbances, str) or not isinstance(disturbances, Sequence):
        raise ScenarioError(f"disturbances {disturbances!r} must be a list of texts")
    if not isinstance(mismatch, str):
        raise ScenarioError(f"mismatch {mismatch!r} must be a name, or 'none'")
    truth = true_model(plant.model)
    if truth is None and (disturbances or mismatch != NONE):
        raise ScenarioError(
            f"plant {plant.name!r} has a model of its own and no true plant beside it, so that it cannot depart from "
            "it; write true/plant.py"
        )
    try:
        parsed = tuple(Disturbance.parse(text) for text in disturbances)
        if truth is not None:
            Disturbed(Targets(plant.model, truth.departures, plant.description), parsed, tick_of(plant.model.kernel))
        named = find_mismatch(plant.model, mismatch)
    except (DisturbanceError, PlantError) as error:
        raise ScenarioError(str(error)) from None
    for disturbance in parsed:
        if disturbance.from_s >= chosen.end_s:
            raise ScenarioError(
                f"disturbance '{disturbance}' must begin in the run, 0 s to {chosen.end_s:g} s; "
                "choose an earlier begin, or a later end"
            )
        last_s = math.ceil(min(disturbance.to_s, chosen.end_s))
        if all(abs(disturbance.share(float(at_s))) < _NOTHING for at_s in range(math.ceil(disturbance.from_s), last_s)):
            raise ScenarioError(
                f"disturbance '{disturbance}' acts at no whole second of the run, 0 s to {chosen.end_s:g} s; "
                "choose another begin, end or period"
            )
    return replace(chosen, disturbances=parsed, mismatch=NONE if named is None else named.name)


def repaired(chosen: Scenario, repair_s: float | None) -> Scenario:
    """``chosen``, whose faults end at ``repair_s`` [s]; ScenarioError where none has begun before."""
    if repair_s is None:
        return chosen
    _check_numbers({"repair_s": repair_s}, chosen.seed)
    if not chosen.faults:
        raise ScenarioError(f"repair at {repair_s:g} s needs a fault; name one, or leave the repair out")
    last_s = max(f.onset_s for f in chosen.faults)
    if not last_s < repair_s < chosen.end_s:
        raise ScenarioError(
            f"repair at {repair_s:g} s must come after the onset at {last_s:g} s and before the end of the run at "
            f"{chosen.end_s:g} s; choose another time, or a later end"
        )
    return replace(chosen, repaired_s=repair_s)


def _check_numbers(given: Mapping[str, object], seed: object) -> None:
    """Refuse what a caller from Python may give and the command line cannot: texts, and seeds that are not whole."""
    for name, number in given.items():
        if number is not None and (isinstance(number, bool) or not isinstance(number, Real)):
            raise ScenarioError(f"{name} {number!r} must be a number")
    if isinstance(seed, bool) or not isinstance(seed, Integral):
        raise ScenarioError(f"seed {seed!r} must be a whole number")


def _named(names: Sequence[str]) -> str:
    """What is named in place of one fault, and the remedy."""
    if not names:
        return "none is named; name it"
    return f"{len(names)} are named, {'+'.join(names)}; name one of them"


def _located(plant: Plant, names: Sequence[str], location: str) -> str:
    """The fault that is called ``name_location``."""
    if len(names) != 1:
        raise ScenarioError(f"location {location!r} needs exactly one fault, and {_named(names)}")
    name = f"{names[0]}_{location}"
    places = [
        f.name.removeprefix(names[0] + "_") for f in plant.description.faults if f.name.startswith(names[0] + "_")
    ]
    if location not in places:
        has = f"it can be at {', '.join(places)}" if places else "it has only one place; leave the location out"
        raise ScenarioError(f"fault {names[0]!r} has no location {location!r}; {has}")
    return name
