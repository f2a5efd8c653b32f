"""Diagnosis: features, symptoms, faults, hypotheses (DIN ISO 17359)."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

from homeostat.domain.plant.tag import Range
from homeostat.stl.formula import Expression

SOMETHING_ELSE = "unknown_cause"
"""Name of the fault mode that stands for everything that is not among the others; no twin can carry it."""
AS_LIKELY_AS_NOT = 0.5
"""Probability from which something else is what counts most [1]."""


@dataclass(frozen=True, slots=True)
class Feature:
    """A quantity derived from tags that is near its reference value while the plant is healthy."""

    name: str
    """Identifier."""
    expression: Expression
    """Static feature: the value itself. Balance feature: the net rate into the accumulation, per second."""
    accumulation: Expression | None
    """Balance feature: the stored quantity; the feature is its change over the window minus the integrated rate."""
    window_s: float
    """Balance window [s]; 0 for a static feature."""
    filter_s: float
    """Time constant of the exponential filter [s]."""
    unit: str
    """Unit of the feature."""
    component: str
    """Component it watches."""

    @property
    def tags(self) -> frozenset[str]:
        """Tags that it is worked out from."""
        stored = frozenset[str]() if self.accumulation is None else frozenset(self.accumulation.tags)
        return stored | frozenset(self.expression.tags)


class Direction(StrEnum):
    """On which side of its reference a feature is a symptom."""

    HIGH = "high"
    LOW = "low"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class SymptomRule:
    """When a feature's deviation counts as a symptom."""

    name: str
    """Identifier."""
    feature: str
    """Name of the feature."""
    direction: Direction
    """Which side counts."""
    sigma: float
    """Threshold in reference deviations [1]."""
    threshold: float
    """Least deviation that counts, in the feature's unit."""
    on_delay_s: float
    """How long the deviation must last [s]."""
    faults: tuple[str, ...]
    """Faults that it indicates."""
    description: str
    """In the operator's words."""


@dataclass(frozen=True, slots=True)
class Symptom:
    """One deviation that monitoring saw."""

    rule: str
    """Name of the symptom rule."""
    at_s: float
    """Process time at which it was confirmed [s]."""
    value: float
    """Deviation of the feature from its reference, in the feature's unit."""
    threshold: float
    """What it would have had to stay within, in the same unit."""
    severity: float
    """Size of the deviation as a multiple of the threshold [1]; 1 at the threshold."""


class EffectKind(StrEnum):
    """What of the process model something acts on that the model has no equation of."""

    PARAMETER = "parameter"
    """A parameter differs from what it was."""
    BALANCE = "balance"
    """A state gains or loses what its balance does not know of."""
    POSITION = "position"
    """An actuator does not stand where its command says; the quantity is the model's input that takes the command."""
    STUCK = "stuck"
    """An actuator stands where it stood; the quantity is the parameter that says how long it takes to move."""
    READING = "reading"
    """An instrument shows something else; nothing of the process changes but what follows from readings."""
    FROZEN = "frozen"
    """An instrument shows what it showed last."""
    UNSEEN = "unseen"
    """A mean value of the model does not change: noise, or a controller that computes something else."""


SIZELESS = (EffectKind.STUCK, EffectKind.FROZEN, EffectKind.UNSEEN)
"""What is there or not, without a size."""


@dataclass(frozen=True, slots=True)
class Effect:
    """How the twin carries what its model has no equation of."""

    kind: EffectKind
    """What it acts on."""
    quantity: str
    """Parameter, state or variable of the process model."""
    per_unit: float = 1.0
    """Change of the quantity for each unit of severity, per second for a balance, in the quantity's unit."""
    grows: bool = False
    """Whether it grows from nothing at the onset, and severity is per second."""
    swings: bool = False
    """Whether it goes to and fro about nothing from the onset on, as a sine; severity is its amplitude, with a sign."""
    capacity: Expression | None = None
    """What a balance holds per unit of its state, over tags: severity divided by it is the state's rate; None for 1."""
    most: float = math.inf
    """Largest severity that there can be: nothing on site brings or takes more."""

    @property
    def lasts(self) -> bool:
        """Whether it is as large at any time after the onset as at once."""
        return not self.grows and not self.swings


@dataclass(frozen=True, slots=True)
class FaultMode:
    """One fault mode of a component (FMEA row)."""

    name: str
    """Identifier."""
    label: str
    """In the operator's words."""
    component: str
    """Component that is faulty."""
    disables: str | None
    """Component that can no longer be relied on; None where it only degrades."""
    severity_range: Range
    """Possible severities, in ``severity_unit``."""
    severity_nominal: float
    """Typical severity, in ``severity_unit``."""
    severity_unit: str
    """Unit of the severity."""
    prior: float
    """Relative frequency [1]."""
    description: str
    """What the severity means."""
    effect: Effect | None = None
    """How the twin carries it; None where the process model has its equation."""
    unknown: bool = False
    """Whether it says no cause, but which balance or characteristic is disturbed, and by how much."""
    mode: str | None = None
    """Name of the generated fault mode that a fault of the tables is, which has no equation; None for every other."""

    @property
    def listed(self) -> bool:
        """Whether the tables have it: it has an equation, or is a generated mode that got a name."""
        return self.effect is None or self.mode is not None

    @property
    def sizeless(self) -> bool:
        """Whether it is there or not, and has no size."""
        return self.effect is not None and self.effect.kind in SIZELESS

    @property
    def stands(self) -> bool:
        """Whether an actuator of it stands still."""
        return self.effect is not None and self.effect.kind is EffectKind.STUCK


@dataclass(frozen=True, slots=True)
class FaultState:
    """A fault with its size and onset, as one hypothesis has it."""

    fault: str
    """Name of the fault."""
    severity: float
    """Severity in the fault's unit."""
    onset_s: float
    """Process time from which it acts [s]."""
    period_s: float = 0.0
    """Period of what swings [s]; 0 for everything else."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One explanation of the symptoms: a fault or several at once."""

    faults: tuple[FaultState, ...]
    """What is wrong; empty for 'nothing'."""
    probability: float
    """How probable it is [0, 1]."""
    between: tuple[float, float] | None = None
    """Between what the true size of its one fault lies with 95 %, in that fault's unit; None where it has no size, or
    where there are several. It is wider than what hypotheses of one name span: those are sizes that the twin has."""

    @property
    def name(self) -> str:
        """Names of the faults, joined by '+'; 'none' where nothing is wrong."""
        return "+".join(f.fault for f in self.faults) or "none"

    @property
    def something_else(self) -> bool:
        """Whether it is that something is wrong that is in no other hypothesis."""
        return any(f.fault == SOMETHING_ELSE for f in self.faults)


@dataclass(frozen=True, slots=True)
class Recurrence:
    """Symptoms that have come and gone by themselves, and are no larger now and stand no longer than before."""

    rules: tuple[str, ...]
    """Names of their symptom rules."""
    times: int
    """How often one of them came and went, at most; each did once at least."""
    longest_s: float
    """How long one of them stood, at most [s]."""

    @property
    def text(self) -> str:
        """One sentence for people."""
        went = f"went within {self.longest_s:.0f} s by themselves"
        come = f"{', '.join(self.rules)} came up to {self.times} times and {went}"
        return f"{come}: nothing is done unless they grow larger or stand longer"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What monitoring holds to be wrong at one moment, each hypothesis with its probability."""

    at_s: float
    """Process time [s]."""
    symptoms: tuple[Symptom, ...]
    """What was seen."""
    hypotheses: tuple[Hypothesis, ...]
    """Explanations, most probable first; several of one fault span the uncertainty of its severity."""
    ended: tuple[FaultState, ...] = ()
    """What was wrong before and is over."""
    ended_s: float | None = None
    """Process time from which it is over, at the latest [s]; None where nothing is."""
    news: bool = True
    """Whether it was worked out anew; False where it was only seen that what was said before is not over."""
    doubts: bool = False
    """Whether that nothing is wrong is likelier than not: what else it may be is told, and no cause is acted on."""

    recurs: Recurrence | None = None
    """What has come and gone by itself before, where that is all that is seen now; None where it is not."""

    @property
    def faulty(self) -> bool:
        """Whether anything is probably wrong."""
        return not self.doubts and any(h.faults for h in self.hypotheses)


@dataclass(frozen=True, slots=True)
class FaultProbability:
    """One set of faults that may be there; hypotheses that differ in severity alone are one."""

    faults: tuple[FaultState, ...]
    """The faults as the most probable hypothesis of this set has them; empty for 'nothing is wrong'."""
    probability: float
    """Summed probability of the hypotheses of this set [0, 1]."""
    between: tuple[float, float] | None = None
    """Between what the true size of its one fault lies with 95 %, in that fault's unit; None where none is stated."""

    @property
    def name(self) -> str:
        """Names of the faults, joined by '+'; 'none' where nothing is wrong."""
        return "+".join(f.fault for f in self.faults) or "none"


def by_fault_set(hypotheses: Iterable[Hypothesis]) -> tuple[FaultProbability, ...]:
    """One per set of faults, most probable first; those of equal probability stay in the order given."""
    by_name: dict[str, list[Hypothesis]] = {}
    for hypothesis in hypotheses:
        by_name.setdefault(hypothesis.name, []).append(hypothesis)
    found = []
    for group in by_name.values():
        best = max(group, key=lambda h: h.probability)
        found.append(FaultProbability(best.faults, sum(h.probability for h in group), best.between))
    return tuple(sorted(found, key=lambda each: -each.probability))


def with_a_twin(hypotheses: Iterable[Hypothesis]) -> tuple[Hypothesis, ...]:
    """The hypotheses that a twin can carry, with their probabilities among themselves.

    That something else is wrong is said to people and can be rolled out by nobody: it forbids nothing, and no share of
    it makes another explanation weaker. Where it is as likely as not, all of them stay as they are, and it stands for a
    plant of which nothing is known.
    """
    every = tuple(hypotheses)
    other = sum(h.probability for h in every if h.something_else)
    if not 0.0 < other < AS_LIKELY_AS_NOT:
        return every
    kept = [h for h in every if not h.something_else]
    total = sum(h.probability for h in kept)
    return tuple(replace(h, probability=h.probability / total) for h in kept)
