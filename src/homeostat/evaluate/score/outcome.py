"""What truly happened in a run, in one word; the only place that may say 'recovered'."""

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.domain.outcome import Outcome
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.alternatives import as_usual, avoidable, released_set
from homeostat.evaluate.reference.unsupervised import fault_free
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce, in_force
from homeostat.evaluate.score.scoring import (
    delivers_at_end,
    exposures,
    fed_at_end,
    has_product,
    inside_at_end,
)
from homeostat.plants.plant import Plant
from homeostat.record.run_record import RunRecord


@dataclass(frozen=True, slots=True)
class Facts:
    """What an outcome follows from."""

    avoidable: bool
    """A hard limit was violated after detection that a fallback, or what was released, would have kept."""
    inside_at_end: bool
    """The plant kept its hard limits at the end."""
    fell_back: bool
    """The fallback acted."""
    missed: bool
    """There was a fault that violates a limit, and it was never detected."""
    released: bool
    """Something was released: the guard has begun to write a request, whatever became of it."""
    needless: bool
    """Leaving alone keeps every hard limit and costs no more."""
    produces: bool
    """The batch is complete with its product; a plant that knows no end is fed at the end, and delivers."""


def outcome(facts: Facts) -> Outcome:
    """The first outcome that applies."""
    if facts.avoidable or not facts.inside_at_end:
        return Outcome.LIMIT_VIOLATED
    if facts.fell_back:
        return Outcome.FALLBACK
    if facts.missed:
        return Outcome.NOT_DETECTED
    if not facts.released:
        return Outcome.NO_ACTION
    if facts.needless:
        return Outcome.NEEDLESS_ACTION
    return Outcome.RECOVERED if facts.produces else Outcome.HELD


def facts_of(
    plant: Plant,
    scenario: Scenario,
    record: RunRecord,
    truth: Trajectory,
    detected_s: float | None,
    needless: bool,
) -> Facts:
    """The facts of a run; ``detected_s``: first report from the onset on [s], ``needless``: by what it cost."""
    onset_s, released, force = scenario.onset_s, record.released, limits_of(plant, record, truth)
    return Facts(
        avoidable=detected_s is not None
        and avoidable(
            plant,
            scenario,
            truth,
            force,
            detected_s,
            released_set(plant, released[0], record.attempts) if released else None,
        ),
        inside_at_end=inside_at_end(truth, force, plant.description.timing),
        fell_back=bool(record.fallbacks),
        missed=onset_s is not None
        and detected_s is None
        and any(e.from_detection_s > 0.0 for e in exposures(truth, force, onset_s)),
        released=bool(released),
        needless=needless,
        produces=_produces(plant, scenario, record, truth),
    )


def intervened(plant: Plant, record: RunRecord) -> bool:
    """Whether something was written that the recipe would not have, and no fallback acted."""
    return written(plant, record) and not record.fallbacks


def written(plant: Plant, record: RunRecord) -> bool:
    """Whether something was written that the recipe would not have, by a release or by a fallback."""
    usual = record.stepwise and as_usual(plant, [state for state, _ in record.states])
    return bool(record.fallbacks) or (bool(record.released) and not usual)


def priced_from_s(scenario: Scenario, record: RunRecord, truth: Trajectory) -> float:
    """When production and cost begin to count: at the onset; without one, when the plant left start-up [s]."""
    return record.started_s(truth.start_s) if scenario.onset_s is None else scenario.onset_s


def limits_of(plant: Plant, record: RunRecord, truth: Trajectory) -> LimitsInForce:
    """The limits that held in a run, at each of its moments."""
    return in_force(plant.description, record.states, truth.start_s, record.start_ups)


def completion_s(plant: Plant, states: Sequence[tuple[str, float]]) -> float | None:
    """When the first state was entered that is an end by itself [s]; None where there was none."""
    ends = _ends(plant)
    return next((at_s for state, at_s in states if state in ends), None)


def _ends(plant: Plant) -> set[str]:
    """States in which a batch is complete; none for a plant that knows no batch."""
    machine = plant.description.machine
    return {s.name for s in machine.states if s.recovery_target and machine.is_end(s.name, machine.recovery_event)}


def _produces(plant: Plant, scenario: Scenario, record: RunRecord, truth: Trajectory) -> bool:
    """Whether the batch is complete with its product; a plant that knows no batch is fed at the end, and delivers.

    Of what is delivered, a tag is what is still in the plant: a vessel that is filled, or emptied, is no product.
    """
    healthy, timing = fault_free(plant, scenario).truth, plant.description.timing
    if _ends(plant):
        return completion_s(plant, record.states) is not None and has_product(truth, healthy, plant.delivered)
    leaving = [name for name in plant.delivered if name not in plant.description.tags_by_name] or plant.delivered
    from_s = priced_from_s(scenario, record, truth)
    return fed_at_end(truth, plant.production, timing) and delivers_at_end(truth, healthy, leaving, from_s, timing)
