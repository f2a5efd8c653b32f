"""What came of it: rollouts, findings, verdicts, outcomes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, TypeAlias

from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Trajectory
from homeostat.stl.deciding import Deciding

REPEATED: Final = "CHK-REPEATED"
"""Name of the refusal of a proposal that was judged before."""

NOT_YET: Final = "CHK-NOT-YET"
"""Name of the refusal of whatever is checked while no draws could show anything."""
CIRCUMSTANCES: Final = frozenset((
    NOT_YET, "CHK-AGE", "CHK-BUSY", "CHK-CONFIGURATION", "CHK-EXPIRY", "CHK-JOURNAL", "CHK-LATCHED", "CHK-LEASE",
    "CHK-OVERTAKEN", "CHK-READING", "CHK-SEAL", "CHK-USED", "CHK-WITHDRAWN",
))  # fmt: skip
"""Names of refusals that would meet any other proposal as well: they say nothing of a path or of its commands."""


class RolloutResult(StrEnum):
    """How a rollout ended."""

    COMPLETED = "The twin ran to the end of the horizon."
    BROKE_DOWN = "The twin left the physical world; see `note` for the member and the time."


@dataclass(frozen=True, slots=True)
class StepBand:
    """When the members of a rollout take one later step."""

    earliest_s: float
    """Process time of the first member; infinite where none takes it [s]."""
    latest_s: float
    """Process time of the last member; infinite where one does not take it [s]."""


@dataclass(frozen=True, slots=True)
class Rollout:
    """What the twin says an action set would do."""

    digest: str
    """Digest of the action set that was tried."""
    trajectory: Trajectory
    """True process values of every member from the snapshot on; setpoints and commands included."""
    hypotheses: tuple[Hypothesis, ...]
    """The hypotheses that the members follow."""
    weights: tuple[float, ...]
    """Probability of each member, shape (members,)."""
    result: RolloutResult
    """How it ended."""
    note: str = ""
    """Detail of the result."""
    steps_left: tuple[int, ...] = ()
    """Steps that each member had not taken at the end; empty where there were no later steps."""
    bands: tuple[StepBand, ...] = ()
    """When each later step is taken, in order; empty where there were none."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """One way in which the plant does not do what was predicted."""

    transition: str
    """Name of the transition that is too late, too early or forbidden."""
    earliest_s: float
    """Earliest process time at which a member of the prediction took it [s]."""
    latest_s: float
    """Latest one; infinite where a member never took it [s]."""
    reason: str
    """One sentence."""


@dataclass(frozen=True, slots=True)
class Violating:
    """How many of the members that were rolled out violate a criterion."""

    members: int
    """Those that violate it, or leave it undecided."""
    of: int
    """All that this finding is about; a check before a release may have drawn more before."""
    share: float
    """Share of the members' weight that violates it [1]."""

    def __str__(self) -> str:
        return f"{self.members} of {self.of} members"


@dataclass(frozen=True, slots=True)
class Finding:
    """One criterion judged on one rollout."""

    criterion: str
    """Name of the criterion or limit."""
    owner: Owner
    """Which agent can cure it."""
    margin: float
    """Signed distance to the limit in ``unit``, worst member; negative means violated."""
    unit: str
    """Unit of the margin; 1 where the formula mixes units."""
    at_s: float
    """Seconds after the snapshot at which it is worst [s]."""
    member: int
    """Member in which it is worst."""
    message: str
    """One sentence with the thing, the value and the limit."""
    deciding: Deciding | None = None
    """The comparison that decides where there are several, or the unit is 1, with its own margin; None elsewhere."""
    violating: Violating | None = None
    """Who violates it; None where nobody does, where no members were looked at, and in records that are older."""

    @property
    def satisfied(self) -> bool:
        """Whether the criterion holds in every member."""
        return self.margin >= 0.0

    def relative(self, scales: Mapping[str, float]) -> float:
        """The margin in scales of its unit [1]; ``scales``: unit -> what counts as one unit of margin in it."""
        return self.margin / scales.get(self.unit, 1.0)


@dataclass(frozen=True, slots=True)
class Approve:
    """Every criterion holds in every member."""

    digest: str
    """Digest of the action set that is approved; the guard releases no other."""
    findings: tuple[Finding, ...]
    """The margins."""
    certificate: Certificate | None = None
    """Bound of the probability that a hard limit is violated; None where none was asked for."""

    @property
    def min_margin(self) -> float:
        """Least margin over the criteria, each in its own unit."""
        return min((f.margin for f in self.findings), default=float("inf"))


@dataclass(frozen=True, slots=True)
class Revise:
    """At least one criterion is violated."""

    findings: tuple[Finding, ...]
    """All findings; the violated ones have negative margins."""

    @property
    def violated(self) -> tuple[Finding, ...]:
        """The findings that must be cured."""
        return tuple(f for f in self.findings if not f.satisfied)


Verdict: TypeAlias = Approve | Revise


@dataclass(frozen=True, slots=True)
class Released:
    """An approved action set was written to the plant."""

    actions: ActionSet
    """What was written."""
    at_s: float
    """Process time of the release [s]."""


@dataclass(frozen=True, slots=True)
class NoActionNeeded:
    """The plant meets every criterion without any action."""

    at_s: float
    """Process time of the judgement [s]."""
    min_margin: float
    """Least margin over the criteria without action."""
    late: bool = False
    """Whether something better was looked for, and not found in the time that there was."""


@dataclass(frozen=True, slots=True)
class FallbackNeeded:
    """The fallback acted because no proposal was released."""

    reason: str
    """Why, in one sentence."""
    at_s: float
    """Process time of the fallback [s]."""


Resolution: TypeAlias = Released | NoActionNeeded | FallbackNeeded


def momentary(violated: Sequence[Finding]) -> bool:
    """Whether nothing but circumstances refused that may be over at the next moment: the same may pass then."""
    return circumstantial(violated) and all(f.criterion != NOT_YET for f in violated)


def circumstantial(violated: Sequence[Finding]) -> bool:
    """Whether nothing but circumstances refused, so that neither another path nor other commands would have passed."""
    return bool(violated) and all(f.criterion in CIRCUMSTANCES for f in violated)
