"""From a plan to its jobs: every scenario and seed with every proposer and every ablation that can matter to it."""

import math
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language.named_model import REPLAY, SITUATED, NamedModel, NoSuchModel
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.diagnosis import FaultState
from homeostat.evaluate.beginning import beginning
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.scenario import Scenario, ScenarioError, departing, scenario
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.plan.job import ABLATIONS, CONSTANT, WITHOUT_MODEL, Ablation, Job, StudyArm
from homeostat.evaluate.study.plan.plan import Plan, ProposerPlan, ScenarioPlan, seeds_of
from homeostat.evaluate.study.plan.plants import own_plant, placed, plants_of
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import check_protocol
from homeostat.process.seeds import Stream
from homeostat.process.seeds import generator as draws
from homeostat.record.row import REFERENCE_POLICIES, WHOLE
from homeostat.stl.spelling import near_matches

UNTOUCHED = (CONSTANT, *REFERENCE_POLICIES)
"""Proposers without anything that could be left out."""
LONGEST_NAME = 200
"""Most bytes of a job's name, which is a folder's."""


def jobs_of(plan: Plan, folder: Path, model: NamedModel | None = None) -> tuple[Job, ...]:
    """Every job, in the order of the file: scenario, seed, proposer, ablation.

    Recorded answers and folders of plants are looked for from ``folder`` on; ``model`` says how models are asked.
    Raises StudyError where something is asked for that there is not.
    """
    found: dict[str, Job] = {}
    plan = placed(plan, folder)
    plants = plants_of(plan)
    for proposer in plan.proposers:
        _check_values(proposer, [plants[s.case] for s in plan.scenarios])
    for chosen in plan.scenarios:
        plant = plants[chosen.case]
        _check_ends(chosen, plant)
        for seed in seeds_of(plan.seeds if chosen.seeds is None else chosen.seeds):
            case = _Case(plant, chosen, _drawn(chosen, plant, seed, plan.mismatch))
            for proposer in plan.proposers:
                for job in _side_by_side(plan, case, proposer, folder, model or NamedModel("")):
                    if found.setdefault(job.name, job) is not job:
                        raise StudyError(f"two runs would be called {job.name!r}; choose other names or seeds")
                    if len(job.name.encode()) > LONGEST_NAME:
                        raise StudyError(
                            f"run {job.name!r} has more than {LONGEST_NAME} bytes; give scenario or proposer a 'name'"
                        )
    if not found:
        raise StudyError("there is nothing to run: no proposer takes part in any plant, or has answers for it")
    return tuple(found.values())


def _check_values(plan: ProposerPlan, plants: Sequence[Plant]) -> None:
    """StudyError where ``values`` name what is a setpoint in no plant: it would be left out without a word."""
    known = {r.tag for plant in plants for state in plant.description.machine.states for r in state.open_setpoints}
    for tag in plan.values:
        if tag not in known:
            there = ", ".join(sorted(known))
            raise StudyError(
                f"proposer {plan.label!r}: values: no plant has an open setpoint {tag!r}{near_matches(tag, known)}; "
                f"there are {there}"
            )


def _check_ends(plan: ScenarioPlan, plant: Plant) -> None:
    """StudyError where not everything exists that may be drawn, whether any seed draws it or not."""
    names = plan.fault.split("+") if isinstance(plan.fault, str) else plan.fault
    try:
        for name, severity, onset_s in product(names, _ends(plan.severity), _ends(plan.onset_s)):
            scenario(plant, name, 0, onset_s, severity, plan.end_s, plan.location)
    except ScenarioError as error:
        raise _in_scenario(plan, error) from None


def _ends(given: float | str | tuple[float, float] | None) -> tuple[float | None, ...]:
    if isinstance(given, tuple):
        return given
    return (None if isinstance(given, str) else given,)


def _in_scenario(plan: ScenarioPlan, error: ScenarioError) -> StudyError:
    return StudyError(f"scenario {plan.label!r} of {plan.case!r}: {error}")


class _Case(NamedTuple):
    """One plant with its faults, which every proposer meets."""

    plant: Plant
    chosen: ScenarioPlan
    truth: Scenario


def _side_by_side(plan: Plan, case: _Case, proposer: ProposerPlan, folder: Path, model: NamedModel) -> list[Job]:
    """The jobs of one proposer in one scenario."""
    plant, chosen, truth = case
    if proposer.cases and chosen.case not in proposer.cases:
        return []
    arm = _arm(proposer, case, folder, model)
    if arm is None:
        return []
    own = own_plant(plant)
    kind = _kind(chosen, truth)
    thinking = Thinking() if plan.thinking_measured else Thinking(declared_s=plan.thinking_declared_s)
    return [
        Job(truth, chosen.label, kind, chosen.published, arm, name, thinking, plan.keep, own)
        for name in plan.ablations
        if (name == WHOLE or _matters(ABLATIONS[name], arm))
        # Nobody can be told the name of a fault that nobody knows.
        and not (chosen.unknown and (arm.label_given or ABLATIONS[name].label_given))
    ]


def _kind(chosen: ScenarioPlan, truth: Scenario) -> str:
    if chosen.unknown:
        return "unknown"
    return "disturbed" if truth.disturbances else ("none", "single", "paired")[min(len(truth.faults), 2)]


def _matters(ablation: Ablation, arm: StudyArm) -> bool:
    """Whether leaving it out can make a difference to ``arm``."""
    if arm.who in UNTOUCHED or (ablation.label_given and arm.label_given):
        return False
    return ablation.grounding is GroundingKind.GRAPH or arm.model is not None


def _drawn(plan: ScenarioPlan, plant: Plant, seed: int, mismatch: str) -> Scenario:
    """The ground truth for ``seed``: what is left to chance follows from it and the scenario's name alone."""
    generator = draws(seed, Stream.STUDY_SCENARIO, plan.label)
    names = _faults(plan, generator)
    end_s = plant.end_s if plan.end_s is None else plan.end_s
    states: list[FaultState] = []
    try:
        for name in names:
            severity = _severity(plan, plant, name, generator)
            onset_s = _value(plan.onset_s, generator)
            states += scenario(plant, name, seed, onset_s, severity, end_s, plan.location).faults
        if not names:
            scenario(plant, "none", seed, end_s=end_s)
        if len({s.fault for s in states}) < len(states):
            raise ScenarioError(f"{'+'.join(names)!r} names a fault twice; name each once")
        truth = beginning(plant, Scenario(plant.name, tuple(states), seed, end_s), plan.begins_in, plan.setpoints)
        return departing(plant, truth, plan.disturbances, plan.departing(mismatch))
    except ScenarioError as error:
        raise _in_scenario(plan, error) from None


def _faults(plan: ScenarioPlan, generator: np.random.Generator) -> Sequence[str]:
    if isinstance(plan.fault, str):
        return [] if plan.fault == "none" else plan.fault.split("+")
    return [str(name) for name in generator.choice(plan.fault, size=plan.draw, replace=False)]


def _severity(plan: ScenarioPlan, plant: Plant, name: str, generator: np.random.Generator) -> float | None:
    if plan.severity != "any":
        return _value(plan.severity, generator)
    located = name if plan.location is None else f"{name}_{plan.location}"
    admitted = next((f.severity_range for f in plant.description.faults if f.name == located), None)
    if admitted is None:
        return None  # the scenario itself says that there is no such fault
    return _value((admitted.low, admitted.high), generator)


def _value(given: float | tuple[float, float] | None, generator: np.random.Generator) -> float | None:
    """``given``, or a value between its two ends with few enough digits to be typed again: four, or a narrow span's."""
    if not isinstance(given, tuple):
        return given
    low, high = given
    digits = 4 if high - low >= 0.1 or high == low else 3 - math.floor(math.log10(high - low))
    return min(max(round(float(generator.uniform(low, high)), digits), low), high)


def _arm(plan: ProposerPlan, case: _Case, folder: Path, model: NamedModel) -> StudyArm | None:
    """Who proposes in one run; None where its answers were to be recorded run by run, and those of this one are not."""
    protocol = AskingProtocol(plan.protocol) if _has_steps(case.plant) else AskingProtocol.ROUTE
    arm = StudyArm(plan.who, plan.label, protocol, plan.label_given, plan.then_search, None, dict(plan.values))
    if plan.who in WITHOUT_MODEL:
        return arm
    name = plan.who
    if kind := next((k for k in (REPLAY, SITUATED) if name.startswith(k)), None):
        filled = name.removeprefix(kind)
        truth = case.truth
        for key, value in (("case", truth.case), ("scenario", case.chosen.label), ("seed", str(truth.seed))):
            filled = filled.replace(f"{{{key}}}", value)
        if kind + filled != name and not (folder / filled).exists():
            return None
        name = f"{kind}{(folder / filled).resolve()}"  # other processes may stand in other folders
    asked = NamedModel(name, model.local_only, model.allow_hosts, model.temperature, model.seed)
    try:
        asked.make()
    except (NoSuchModel, OSError) as error:
        raise StudyError(f"proposer {plan.label!r}: {error}") from None
    return StudyArm(plan.who, plan.label, protocol, plan.label_given, plan.then_search, asked)


def _has_steps(plant: Plant) -> bool:
    """Whether ``plant`` can be asked for step by step."""
    try:
        check_protocol(plant, AskingProtocol.PER_STEP)
    except PlantError:
        return False
    return True
