"""The card of an episode: what it says, as values; :mod:`homeostat.console.card.episode` reads them from a record."""

from dataclasses import dataclass

from homeostat.console.card.foresight import Foresight
from homeostat.console.card.standing import Stands
from homeostat.domain.certificate import Certificate


@dataclass(frozen=True, slots=True)
class Seen:
    """A symptom."""

    rule: str
    """Name of its rule."""
    text: str
    """In the operator's words."""
    at_s: float | None
    """When it was confirmed [s]; None where only its name is known."""
    value: float | None
    """Deviation of the feature from its reference, in ``unit``."""
    times: float | None
    """The same as a multiple of the threshold [1]."""
    threshold: float | None
    """What it would have had to stay within, in ``unit``."""
    unit: str
    """Unit of the feature."""
    feature: str
    """Name of the feature, which can be drawn; empty where it is not known."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """What may be wrong."""

    name: str
    """Names of the faults, joined by '+'."""
    text: str
    """In the operator's words."""
    size: str
    """How large it is, and between what that lies with 95 %; empty where it has no size."""
    probability: float
    """How probable it is [0, 1]."""
    component: str
    """Component that is faulty; empty for none."""
    supports: tuple[str, ...]
    """Symptoms that stand and indicate it."""
    lacks: tuple[str, ...]
    """Symptoms that would indicate it and do not stand."""
    others: tuple[str, ...]
    """Symptoms that stand and do not indicate it."""


@dataclass(frozen=True, slots=True)
class Move:
    """One command."""

    tag: str
    """Tag that is commanded."""
    text: str
    """What it is."""
    unit: str
    """Its unit."""
    before: float | None
    """What it was at, None for automatic."""
    known: bool
    """Whether ``before`` is known."""
    after: float | None
    """What it is brought to; None for automatic."""
    rate: float | None
    """Fastest change, in the unit per second; None for a step."""


@dataclass(frozen=True, slots=True)
class LaterMoves:
    """What follows once the plant has come so far."""

    guard: str
    """What must hold before."""
    state: str
    """State that it leads to, in the operator's words."""
    moves: tuple[Move, ...]
    """What is commanded then."""


@dataclass(frozen=True, slots=True)
class PredictedMargin:
    """How near the twin comes to one limit."""

    name: str
    """Name of the limit or criterion."""
    text: str
    """What it protects."""
    formula: str
    """What must hold."""
    margin: float
    """Worst margin over all members, in ``unit``; negative where violated."""
    unit: str
    """Its unit."""
    at_s: float
    """When it is worst, seconds after the proposal was judged [s]."""
    member: int
    """Member of the rollout in which it is worst."""
    scaled: float
    """Margin in what counts as one unit of it [1]; the least comes first."""
    hard: bool
    """Whether violating it is forbidden."""
    term: str = ""
    """The comparison that decides where the formula has several; ``margin`` and ``unit`` are then its own."""
    full: bool = False
    """Whether the ranges of the tags allow no more."""
    near: bool = False
    """Whether it is kept, and nearly not: by less than half of what counts, and of what could be."""
    actual: float | None = None
    """Worst margin of the readings since the release, in ``actual_unit``; None before there is any."""
    actual_unit: str = ""
    """Its unit."""
    actual_term: str = ""
    """The comparison that decides it, as ``term``."""
    actual_at_s: float | None = None
    """When that was, process time [s]."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """What is proposed, and how it was judged."""

    what: str
    """Release, wait, hold or test."""
    digest: str
    """Digest of the action set."""
    proposer: str
    """Who proposed it."""
    at_s: float
    """When it was judged [s]."""
    stands: Stands
    """How far it came, or what ended it."""
    status: str
    """The same in words, with who has ended it and why."""
    since_s: float
    """Since when it stands so [s]."""
    released_s: float | None
    """When it was written [s]; None where it was not."""
    seconds: float
    """How long it lasts [s]; 0 for what is to last."""
    path: tuple[str, ...]
    """States that it leads through, in the operator's words."""
    moves: tuple[Move, ...]
    """What is commanded at once."""
    later: tuple[LaterMoves, ...]
    """What follows."""
    reasons: tuple[str, ...]
    """Why, as its proposer says."""
    approved: bool
    """Whether every check holds."""
    members: int
    """Members of the rollout."""
    margins: tuple[PredictedMargin, ...]
    """Limits and criteria, the nearest one first."""
    checks: int
    """Permissives and other conditions that were judged beside them."""
    certificate: Certificate | None
    """What so many rollouts say: those of the release check once it was made, those of the list before; None where the
    record does not say."""
    foresight: Foresight | None = None
    """What the twin foresees of it, from the release check; None where it has not come so far."""
    beside: Foresight | None = None
    """What it foresaw without it, at that time; None where the record does not say."""


@dataclass(frozen=True, slots=True)
class LetBe:
    """That the plant was left as it is."""

    at_s: float
    """When that was judged [s]."""
    state: str
    """State in which it was left, in the operator's words."""
    margin: float
    """Least margin without action, each in its own unit; negative where acting was not worth its cost."""
    members: int
    """Members of the rollout that was judged; 0 where the record is too old to say."""
    margins: tuple[PredictedMargin, ...]
    """Limits and criteria, the nearest one first; empty where the record is too old to say whose ``margin`` is."""
    checks: int
    """Permissives and other conditions that were judged beside them."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Something that could be done."""

    what: str
    """What it is, in words."""
    kind: str
    """Its kind."""
    by: str
    """Who proposed it; empty for nobody."""
    cost: float
    """What it is expected to cost."""
    items: tuple[tuple[str, float], ...]
    """What most of that is."""
    refused: str
    """Why it may not be done; empty where it may."""
    chosen: bool
    """Whether it was chosen."""
    certificate: Certificate | None
    """How likely it is to violate a hard limit; None where the record does not say."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Something that was proposed and refused."""

    at_s: float
    """When [s]."""
    what: str
    """What it was."""
    why: str
    """Why not."""


@dataclass(frozen=True, slots=True)
class Acted:
    """A fallback that acted."""

    at_s: float
    """When [s]."""
    strategy: str
    """Name of the strategy."""
    reason: str
    """Why."""
    moves: tuple[Move, ...]
    """What was written."""
    stands: bool
    """Whether the plant was read to hold it."""


@dataclass(frozen=True, slots=True)
class Card:
    """Everything that an operator decides by, from one record at one moment."""

    since_s: float
    """When the episode began [s]."""
    over_s: float | None
    """When it ended [s]; None while it lasts."""
    headline: str
    """What is wrong, in one line."""
    probability: float | None
    """How probable that is [0, 1]; None where nothing was diagnosed."""
    diagnosed_s: float | None
    """When the diagnosis is from [s]; None where there is none."""
    seen: tuple[Seen, ...]
    """Symptoms."""
    explanations: tuple[Explanation, ...]
    """What may be wrong, the most probable first."""
    apart: str
    """What somebody would look at to tell them apart; empty where that is clear or nobody can."""
    alone: str
    """What follows if nothing is done; empty where the record does not say."""
    foresight: Foresight | None
    """The same as the twin foresaw it last, in bands and times; None where the record does not say."""
    proposal: Proposal | None
    """What is proposed, or in force; None where nothing is."""
    fallen: Proposal | None
    """What fell last, be it refused, void or overtaken, where nothing stands since but what was released before."""
    released_s: float | None
    """When something was released last in the episode [s]; None where nothing was."""
    let_be: LetBe | None
    """That nothing need be done, where that was judged last; None else."""
    currency: str
    """What costs are in."""
    compared_s: float | None
    """When they were compared [s]."""
    choices: tuple[Choice, ...]
    """What could be done, the cheapest first."""
    refused: tuple[Refusal, ...]
    """What was refused in this episode, the latest first."""
    acted: tuple[Acted, ...]
    """Fallbacks that acted, the latest first."""
    notes: tuple[str, ...]
    """What proposers said for people to read."""
