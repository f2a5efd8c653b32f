"""What the outcome of a run follows from: its record, its true values, and alternatives where it depends on them."""

from __future__ import annotations

from collections.abc import Sequence

from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.alternatives import as_usual, avoidable, needless, released_set
from homeostat.evaluate.reference.unsupervised import Unattended
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce, in_force
from homeostat.evaluate.score.outcome import Facts
from homeostat.evaluate.score.scoring import exposures, fed_at_end, has_product, inside_at_end
from homeostat.plants.plant import Case
from homeostat.record.run_record import RunRecord


def facts_of(
    case: Case, scenario: Scenario, record: RunRecord, truth: Trajectory, healthy: Unattended, detected_s: float | None
) -> Facts:
    """The facts of a run; ``healthy``: the fault-free one, ``detected_s``: first report from the onset on [s]."""
    force, onset_s = limits_of(case, record, truth), scenario.onset_s
    started_s = truth.start_s if record.started_s is None else record.started_s
    released = record.released
    usual = record.stepwise and as_usual(case, [state for state, _ in record.states])
    written = bool(released) and not record.fallbacks and not usual
    return Facts(
        avoidable=detected_s is not None
        and avoidable(
            case,
            scenario,
            truth,
            force,
            detected_s,
            released_set(case, released[0], record.attempts) if released else None,
        ),
        inside_at_end=inside_at_end(truth, force),
        fell_back=bool(record.fallbacks),
        missed=onset_s is not None
        and detected_s is None
        and any(e.from_detection_s > 0.0 for e in exposures(truth, force, onset_s)),
        released=bool(released),
        needless=written and needless(case, scenario, truth, started_s if onset_s is None else onset_s),
        produces=_produces(case, record, truth, healthy),
    )


def limits_of(case: Case, record: RunRecord, truth: Trajectory) -> LimitsInForce:
    """The limits that held in a run, at each of its moments."""
    return in_force(case.description, record.states, truth.start_s, record.start_ups)


def completion_s(case: Case, states: Sequence[tuple[str, float]]) -> float | None:
    """When the first state was entered that is an end by itself [s]; None where there was none."""
    ends = _ends(case)
    return next((at_s for state, at_s in states if state in ends), None)


def _ends(case: Case) -> set[str]:
    """States in which a batch is complete; none for a plant that knows no batch."""
    machine = case.description.machine
    return {s.name for s in machine.states if s.recovery_target and machine.is_end(s.name, machine.recovery_event)}


def _produces(case: Case, record: RunRecord, truth: Trajectory, healthy: Unattended) -> bool:
    """Whether the batch is complete with its product; a plant that knows no batch is fed at the end."""
    if not _ends(case):
        return fed_at_end(truth, case.production)
    return completion_s(case, record.states) is not None and has_product(truth, healthy.truth, case.delivered)
