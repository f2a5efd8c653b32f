"""A row: everything that is kept of one run of a study, as one line of the dataset."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from homeostat.domain.outcome import FORMER, outcome_named

SEARCH = "search"
"""The proposer that is always there, and asks no model."""
HINDSIGHT = "hindsight"
"""Proposer of the rows that say what was possible: an exhaustive search on the true plant."""
DO_NOTHING = "do-nothing"
"""Proposer of the rows in which nobody acts, not even the fallback."""
FALLBACK_ONLY = "fallback-only"
"""Proposer of the rows in which nobody proposes, so that only the fallback may act."""
REFERENCE_POLICIES = (HINDSIGHT, DO_NOTHING, FALLBACK_ONLY)
"""Proposers of the rows that others are measured by."""
WHOLE = "none"
"""Ablation of the rows in which nothing is left out."""
AGENTS = ("planning", "action", "reprompting")
"""Agents that may ask a language model."""
WALL = "wall_"
"""Beginning of the names of columns that depend on the machine; all others follow from the file alone."""


@dataclass(frozen=True, slots=True)
class Row:
    """One run. Rows of equal ``plant``, ``scenario`` and ``seed`` are the same plant with the same faults: a pair."""

    job: str
    """Name of the job, unique in the study."""
    case: str
    """Name of the plant."""
    scenario: str
    """Name of the scenario in the file."""
    kind: str
    """``none``, ``single``, ``paired``, ``unknown`` (a fault that the plant's tables do not have) or ``disturbed``."""
    published: str
    """Row of the published tables that the scenario stands for; empty for none."""
    proposer: str
    """Who proposes: ``search``, a language model's name, ``constant``, or one of the names above."""
    ablation: str
    """What is left out."""
    seed: int
    """Seed of plant, noise and draws."""
    fault: str
    """Injected faults joined by '+'; ``none`` where there was none."""
    severity: tuple[float, ...]
    """Severity of each, in its unit."""
    onset_s: tuple[float, ...]
    """Process time from which each acts [s]."""
    disturbances: str
    """What else happened to the true plant, joined by '; '; empty for nothing."""
    mismatch: str
    """How the true plant was not its twin's model; ``none`` where it was."""
    batch: bool
    """Whether the plant makes batches: its scores are completion and delay instead of production alone."""

    outcome: str
    """An :class:`homeostat.evaluate.score.outcome.Outcome`; ``possible`` or ``impossible`` for hindsight."""
    success: bool
    """The plant ended inside its hard limits, a batch complete, and no fallback acted."""
    actor: str
    """Who acted: ``search``, ``language``, ``constant``, ``fallback`` or ``none``."""
    state: str
    """State of the machine at the end."""
    reason: str
    """Why the fallback acted; empty where it did not."""
    detection_s: float | None
    """From the first onset to the first report [s]; None where there was none."""
    false_alarm: bool
    """Whether something was reported before any onset."""
    released_s: float | None
    """From the first onset, or the start without a fault, to the first release [s]; None where there was none."""
    releases: int
    """Action sets that were released."""
    fallbacks: int
    """Times that the fallback acted."""
    attempts: int
    """Proposals that were judged."""
    refused: int
    """Those that were refused."""
    decisions: int
    """Stretches of thinking."""
    acted: bool
    """Whether a proposal was released or the fallback acted."""

    exposure_s: float
    """True time outside any hard limit; the longest of any one limit [s]."""
    exposure_detected_s: float | None
    """The same from detection on [s]; None where nothing was detected."""
    least_margin: float
    """Least true margin to any hard limit since start-up, each in scales of its unit; negative: violated [1]."""
    least_margin_limit: str
    """Name of that limit."""
    missed: str | None
    """Soft criteria and envelopes that did not hold at the end, joined by '+', as a product off its grade; empty for
    none, None in rows of versions that did not look."""
    approved_margin: float | None
    """Least margin of the first approval, each criterion in its own unit; None where nothing was approved."""
    production_loss: float | None
    """Fraction of the fault-free production that was lost from the onset on [1]; None where none was to be made."""
    complete_s: float | None
    """Process time at which the batch was complete [s]; None where it was not, and where there is no batch."""
    nominal_s: float | None
    """The same in the fault-free run [s]."""
    totals: Mapping[str, float]
    """What the plant reports of what it adds up over a run; a name ends with its unit, and is a column of its own."""

    believed: str
    """Most probable faults before the first release, joined by '+'; ``none``; empty where nothing was diagnosed."""
    believed_p: float | None
    """Their probability [1]."""
    true_p: float | None
    """Probability given to the faults that were truly there [1]; None where nothing was diagnosed."""
    brier: float | None
    """Sum over fault sets of (probability - truth) squared, 0 to 2 [1]; None where nothing was diagnosed."""

    plans: int | None
    """Next states that were named, where every step is asked for; None elsewhere."""
    plans_right: int | None
    """Those that follow on the best route by hindsight."""
    actions: int | None
    """Sets of actuators that were named."""
    actions_right: int | None
    """Those that switch on what the named state needs and nothing else."""
    on_right: int | None
    """Actuators that were switched on and had to be."""
    on_wrong: int | None
    """Actuators that were switched on and should not have been."""
    on_missed: int | None
    """Actuators that had to be switched on and were not."""

    planning_calls: int
    """Questions of the planning agent to a language model."""
    planning_in: int
    """Tokens that they had."""
    planning_out: int
    """Tokens of the answers."""
    action_calls: int
    """Questions of the action agent."""
    action_in: int
    """Tokens that they had."""
    action_out: int
    """Tokens of the answers."""
    reprompting_calls: int
    """Questions of the reprompting agent."""
    reprompting_in: int
    """Tokens that they had."""
    reprompting_out: int
    """Tokens of the answers."""
    tokens_by: str
    """Who counted: ``server``, or ``estimate`` where none did; empty where nothing was asked."""
    cost_usd: float | None
    """Price by the provider's list [USD]; None where it is not known."""
    failures: int
    """Questions that got no answer."""

    wall_decision_s: float | None
    """Thinking from the notice that led to the first action until that action [s]; None where nobody acted."""
    wall_thinking_s: float
    """All thinking [s]."""
    wall_call_s: float | None
    """Mean time of a language model's answer [s]; None where none was asked."""
    wall_s: float
    """Wall-clock time of the run [s]."""
    trace: str
    """Folder of the run, relative to the study's; empty where it was not kept."""

    def __post_init__(self) -> None:
        """ValueError where a total has the name of another column."""
        if taken := RESERVED & self.totals.keys():
            raise ValueError(f"the plant {self.case!r} reports a total {min(taken)!r}, which is another column")

    @property
    def pair(self) -> tuple[str, str, int]:
        """What rows have in common that are the same plant with the same faults."""
        return self.case, self.scenario, self.seed

    @property
    def delay_s(self) -> float | None:
        """How much later than fault-free the batch was complete [s]; None where it was not, or there is none."""
        return None if self.complete_s is None or self.nominal_s is None else self.complete_s - self.nominal_s


TOTALS = "totals"
"""The field whose entries are columns."""
OWN = frozenset(field.name for field in fields(Row)) - {TOTALS}
"""The columns that every row has."""
FINGERPRINT = "fingerprint"
"""What a row in the ledger is found by, beside its columns."""
YOUNGER = {"disturbances": "", "mismatch": "none", "missed": None}
"""Columns that older rows lack -> what they would have there."""
RESERVED = OWN | {TOTALS, FINGERPRINT}
"""What no total of a plant may be called: it would be taken for something else wherever rows are kept."""


def columns_of(row: Row) -> dict[str, Any]:
    """What is kept of ``row``, column by column."""
    columns: dict[str, Any] = {}
    for name, value in asdict(row).items():
        columns |= value if name == TOTALS else {name: value}
    return columns


def row_from(kept: Mapping[str, Any]) -> Row:
    """The row that was ``kept``, also by an older version; TypeError, KeyError or ValueError where that is no row."""
    outcome = kept["outcome"]
    if outcome == FORMER:
        outcome = outcome_named(FORMER, kept["fallbacks"] > 0).value
    sequences = {name: tuple(kept[name]) for name in ("severity", "onset_s")}
    totals = {name: value for name, value in kept.items() if name not in OWN and value is not None}
    if odd := [name for name, value in totals.items() if not isinstance(value, float)]:
        raise TypeError(f"{odd[0]!r} is no column of a row")
    own = {name: kept[name] for name in OWN - YOUNGER.keys()} | {n: kept.get(n, v) for n, v in YOUNGER.items()}
    return Row(**{**own, **sequences, "outcome": outcome, TOTALS: totals})
