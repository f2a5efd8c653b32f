"""What a run came to, as ``result.json`` and ``homeostat run --json`` have it: ``schema`` and one key per field."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.diagnosis import FaultProbability, FaultState
from homeostat.domain.outcome import Outcome, outcome_named
from homeostat.domain.recovery import Command
from homeostat.journal.beside.files import RESULT
from homeostat.journal.encode import Json
from homeostat.record.foretold import Foretold
from homeostat.record.probes import ProbeMade

SCHEMA = 2
"""Number of what the keys mean; one that is not there is 1, which knew other outcomes."""


class ResultError(ValueError):
    """A result file is not what was written; the message says so in one line."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """How long the true value was outside one limit."""

    limit: str
    """Name of the limit."""
    from_detection_s: float
    """Seconds outside from detection on [s]."""
    total_s: float
    """Seconds outside in the whole run [s]."""


@dataclass(frozen=True, slots=True)
class StepScores:
    """How many answers were right."""

    plans: int
    """Answers of the planning agent."""
    plans_right: int
    """Those that name the state which follows on the best route."""
    actions: int
    """Answers of the action agent."""
    actions_right: int
    """Those that switch on what the state that was named needs, and nothing else."""
    on_right: int
    """Actuators that were switched on and had to be."""
    on_wrong: int
    """Actuators that were switched on and should not have been."""
    on_missed: int
    """Actuators that had to be switched on and were not."""

    @property
    def precision(self) -> float | None:
        """Share of the actuators switched on that had to be [1]; None where none was."""
        return _share(self.on_right, self.on_right + self.on_wrong)

    @property
    def recall(self) -> float | None:
        """Share of the actuators that had to be switched on and were [1]; None where none had to."""
        return _share(self.on_right, self.on_right + self.on_missed)


@dataclass(frozen=True, slots=True)
class Result:
    """The score of one run and what led to it."""

    case: str
    """Name of the plant."""
    fault: str
    """Injected faults joined by '+'; ``none`` where there was none."""
    seed: int
    """Seed of the run."""
    outcome: Outcome
    """How it ended."""
    actor: str
    """Who acted: ``search``, ``language``, ``fallback`` or ``none``."""
    onset_s: float | None
    """Process time of the first fault [s]."""
    detected_s: float | None
    """Process time of the first report from the onset on [s]."""
    released_s: float | None
    """Process time of the first release [s]."""
    attempts: int
    """Proposals that were judged."""
    hypotheses: tuple[FaultProbability, ...]
    """The last diagnosis before the first release, most probable first."""
    actions: tuple[Command, ...]
    """The last commands that were written."""
    min_margin: float | None
    """Least margin of the first approval, each criterion in its own unit."""
    limit_exposure_s: tuple[Exposure, ...]
    """Seconds outside each limit [s]; those from detection on are null in JSON where nothing was detected."""
    production_loss: float | None
    """Fraction of the fault-free production that was lost from the onset on [1]."""
    state: str
    """State of the machine at the end."""
    complete_s: float | None
    """Process time at which the batch was complete [s]; None where it was not, and for a plant that knows no batch."""
    nominal_s: float | None
    """The same in the fault-free run [s]."""
    totals: dict[str, float]
    """What the plant adds up over a run -> its true value at the end; the unit is the end of the name.
    What is not known at the end is not there."""
    steps: StepScores | None
    """How many single steps a language model got right; None unless it was asked in every state."""
    thinking_s: float
    """Wall-clock seconds of thinking up to the first release [s]."""
    wall_s: float
    """Wall-clock seconds of the whole run [s]."""
    trace: str
    """Path of the run directory."""
    disturbances: tuple[str, ...] = ()
    """What else happened to the true plant."""
    mismatch: str = "none"
    """How the true plant was not the model that its twin has."""
    probes: tuple[ProbeMade, ...] = ()
    """Test moves and waits, in order."""
    cost: Cost | None = None
    """What the run cost from the onset on; None in results that are older than prices, or where it is not known."""
    currency: str = ""
    """What that is in."""
    cost_alone: Cost | None = None
    """What leaving the plant alone would have cost over the same time; None where nothing was released, the fallback
    acted, it is not known, or in results that are older."""
    foreseen: Foretold | None = None
    """When a hard limit would have tripped, as it was foreseen last before anything was done; None where none was to,
    or in results that are older."""

    @property
    def good(self) -> bool:
        """Recovered, or rightly left alone."""
        return self.outcome.good

    def to_json(self) -> str:
        """One strictly valid JSON object, without a newline at the end."""
        return json.dumps(
            {
                "schema": SCHEMA,
                "case": self.case,
                "fault": None if self.disturbances and self.fault == "none" else self.fault,
                "disturbances": self.disturbances,
                "mismatch": self.mismatch,
                "seed": self.seed,
                "outcome": self.outcome.value,
                "actor": self.actor,
                "onset_s": self.onset_s,
                "detected_s": self.detected_s,
                "released_s": self.released_s,
                "attempts": self.attempts,
                "hypotheses": [
                    {
                        "fault": b.name,
                        "probability": b.probability,
                        "severity": _severity(b),
                        "between": b.between,
                        "period_s": {f.fault: f.period_s for f in b.faults if f.period_s} or None,
                    }
                    for b in self.hypotheses
                ],
                "actions": [{"tag": c.tag, "value": c.value, "rate": c.rate} for c in self.actions],
                "min_margin": self.min_margin,
                "limit_exposure_s": {
                    e.limit: {
                        "from_detection": None if self.detected_s is None else e.from_detection_s,
                        "total": e.total_s,
                    }
                    for e in self.limit_exposure_s
                },
                "production_loss": self.production_loss,
                "cost": None if self.cost is None else _cost(self.cost, self.currency),
                "cost_alone": None if self.cost_alone is None else _cost(self.cost_alone, self.currency),
                "foreseen": None if self.foreseen is None else asdict(self.foreseen),
                "state": self.state,
                "complete_s": self.complete_s,
                "nominal_s": self.nominal_s,
                "totals": self.totals,
                "steps": None if self.steps is None else asdict(self.steps),
                "probes": [asdict(probe) for probe in self.probes],
                "thinking_s": self.thinking_s,
                "wall_s": self.wall_s,
                "trace": self.trace,
            },
            allow_nan=False,
            indent=1,
        )


def read_result(run_dir: Path) -> Result | None:
    """The result kept in ``run_dir``; None where the run has none, ResultError where it cannot be read."""
    try:
        text = (run_dir / RESULT).read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    try:
        content: dict[str, Any] = json.loads(text)
        if (schema := content.pop("schema", 1)) not in (1, SCHEMA):
            raise ValueError(f"schema {schema!r} is not 1 or {SCHEMA}")
        exposure: dict[str, Any] = content.pop("limit_exposure_s")
        found = Result(
            **{
                **content,
                "fault": content["fault"] or "none",
                "disturbances": tuple(content.get("disturbances", ())),
                "outcome": outcome_named(content["outcome"], content["actor"] == "fallback"),
                "steps": None if content["steps"] is None else StepScores(**content["steps"]),
                "hypotheses": tuple(_fault_set(item) for item in content["hypotheses"]),
                "actions": tuple(Command(**item) for item in content["actions"]),
                "probes": tuple(map(_probe, content.get("probes", ()))),
                **_read_cost(content.get("cost")),
                "cost_alone": _read_cost(content.get("cost_alone"))["cost"],
                "foreseen": None if (told := content.get("foreseen")) is None else Foretold(**told),
                "limit_exposure_s": tuple(
                    Exposure(name, e["from_detection"] or 0.0, e["total"]) for name, e in exposure.items()
                ),
            }
        )
        found.to_json()  # a number that is not finite, say, cannot be shown again
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError) as error:
        raise ResultError(f"{str(run_dir / RESULT)!r} is not a result: {error!r}; verify the run") from error
    return found


def _severity(fault_set: FaultProbability) -> Json:
    """A number for one fault, an object fault -> severity for several, null for none; in each fault's unit."""
    if len(fault_set.faults) == 1:
        return fault_set.faults[0].severity
    return {f.fault: f.severity for f in fault_set.faults} or None


def _fault_set(item: dict[str, Any]) -> FaultProbability:
    severity = item["severity"]
    if severity is None:
        severity = {}
    elif not isinstance(severity, dict):
        severity = {item["fault"]: severity}
    # The onset that was diagnosed is in the journal, not in the result.
    turns = item.get("period_s") or {}
    faults = tuple(FaultState(name, size, math.nan, turns.get(name, 0.0)) for name, size in severity.items())
    between = item.get("between")
    return FaultProbability(faults, item["probability"], None if between is None else (between[0], between[1]))


def _probe(item: dict[str, Any]) -> ProbeMade:
    return ProbeMade(**{**item, "apart": tuple(item["apart"])})


def _cost(cost: Cost, currency: str) -> dict[str, Json]:
    items: dict[str, Json] = {item.name: item.amount for item in cost.items}
    return {"currency": currency, "total": cost.total, "worth": cost.worth, "items": items}


def _read_cost(found: dict[str, Any] | None) -> dict[str, Any]:
    if found is None:
        return {"cost": None}
    items = tuple(CostItem(name, float(amount)) for name, amount in found["items"].items())
    return {"cost": Cost(items, float(found["worth"])), "currency": str(found["currency"])}


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None
