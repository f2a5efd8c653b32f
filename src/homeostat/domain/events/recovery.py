"""The events of a recovery: what was diagnosed, proposed, judged, and done."""

from dataclasses import dataclass
from typing import ClassVar, Self

from homeostat.domain.advice import Attempt
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.remark import Remark, RemarkKind
from homeostat.domain.verdict import Approve, Finding


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """Monitoring reported a fault."""

    kind: ClassVar[str] = "diagnosed"
    symptoms: tuple[Symptom, ...]
    """What was seen."""
    hypotheses: tuple[Hypothesis, ...]
    """What explains it."""

    @classmethod
    def of(cls, diagnosis: Diagnosis) -> Self:
        """The event of one diagnosis."""
        return cls(diagnosis.symptoms, diagnosis.hypotheses)


@dataclass(frozen=True, slots=True)
class Doubted:
    """That nothing is wrong is likelier than not: what else it may be, told once as long as it stays the same."""

    kind: ClassVar[str] = "doubted"
    symptoms: tuple[Symptom, ...]
    """What was seen; empty where what was wrong is over, and may come back."""
    hypotheses: tuple[Hypothesis, ...]
    """What it may be, nothing among it; no cause is acted on."""
    explained: bool
    """Whether what is measured, and what the model is known to err by, is explanation enough."""


@dataclass(frozen=True, slots=True)
class SymptomsCleared:
    """The symptoms that were noticed have gone, and nothing is held to be wrong."""

    kind: ClassVar[str] = "symptoms-cleared"
    symptoms: tuple[str, ...]
    """Names of their rules."""
    since_s: float
    """Process time from which there is none any more [s]."""


@dataclass(frozen=True, slots=True)
class FaultsEnded:
    """What was wrong is over: readings of the last minutes need no explanation."""

    kind: ClassVar[str] = "faults-ended"
    faults: tuple[FaultState, ...]
    """What was wrong, as it was known last."""
    since_s: float
    """Process time from which it is over, at the latest [s]."""


@dataclass(frozen=True, slots=True)
class FallbackArmed:
    """A validated fallback is ready, before anything is proposed."""

    kind: ClassVar[str] = "fallback-armed"
    strategy: str
    """Name of the strategy."""
    approved: bool
    """Whether the twin finds every protecting criterion satisfied."""
    findings: tuple[Finding, ...]
    """Margins of the protecting criteria."""
    deadline_s: float
    """Thinking time that is left [s]."""


@dataclass(frozen=True, slots=True)
class LaterStep:
    """What is sent once the plant has come so far, as the journal has it."""

    transition: str
    """Name of the transition that it takes."""
    guard: str
    """Formula that must hold on the plant before anything is sent."""
    target: str
    """State that it leads to."""
    commands: tuple[Command, ...]
    """What is sent, in order."""

    @classmethod
    def all_of(cls, actions: ActionSet) -> tuple[Self, ...]:
        """What follows the first commands of ``actions``, in order."""
        return tuple(cls(s.transition.name, str(s.transition.guard), s.target, s.commands) for s in actions.then)


@dataclass(frozen=True, slots=True)
class Attempted:
    """One proposal was tried on the twin and judged."""

    kind: ClassVar[str] = "attempted"
    number: int
    """Number of the attempt, from 1."""
    proposer: str
    """Who proposed."""
    path: tuple[str, ...]
    """States of the proposed path; empty where there was none."""
    commands: tuple[Command, ...]
    """Proposed commands."""
    digest: str
    """Digest of the action set; empty where there was none."""
    approved: bool
    """Whether every check holds."""
    findings: tuple[Finding, ...]
    """Every check with its margin."""
    members: int
    """Members of the rollout; 0 where nothing was rolled out."""
    cost: Cost | None = None
    """What it is expected to cost; None where nothing was rolled out, and in records that are older."""
    polished: bool = False
    """Whether the search bettered the numbers of whoever proposed it."""
    what: AlternativeKind = AlternativeKind.RELEASE
    """Whether it is to last, or a wait, a hold or a test."""
    seconds: float = 0.0
    """How long it lasts before the plant is looked at again [s]; 0 for what is to last."""
    then: tuple[LaterStep, ...] = ()
    """What would follow the commands, in order; empty in records that are older than this field."""

    @classmethod
    def of(cls, proposer: str, attempt: Attempt) -> Self:
        """The event of one attempt."""
        actions, verdict = attempt.actions, attempt.verdict
        states = attempt.path.states if attempt.path else ()
        commands, digest = (actions.commands, actions.digest) if actions else ((), "")
        approved = isinstance(verdict, Approve)
        judged = (
            approved,
            verdict.findings,
            attempt.members,
            attempt.cost,
            attempt.polished,
            attempt.kind,
            attempt.seconds,
            () if actions is None else LaterStep.all_of(actions),
        )
        return cls(attempt.number, proposer, states, commands, digest, *judged)


@dataclass(frozen=True, slots=True)
class Compared:
    """Everything that could be done stood in one list, and one of it was chosen."""

    kind: ClassVar[str] = "compared"
    currency: str
    """What costs are in."""
    alternatives: tuple[Alternative, ...]
    """All of it, the cheapest first."""
    chosen: str
    """Digest of what is to be done; empty where the plant is left alone or a fallback acts."""


@dataclass(frozen=True, slots=True)
class GaveUp:
    """A proposer has nothing more to propose; the next one is asked, or nobody is left."""

    kind: ClassVar[str] = "gave-up"
    proposer: str
    """Who gave up."""
    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class NotAsked:
    """A proposer is asked no further: until its answer is there more is lost than the answer may win."""

    kind: ClassVar[str] = "not-asked"
    proposer: str
    """Who is not asked."""
    answer_s: float
    """How long an answer takes, by its own so far; where one was not waited for any longer, how long it was [s]."""
    lost: float
    """What leaving the plant alone for so long costs more than the best approved."""
    gain: float
    """Most that an answer may win: what the best approved costs more than everything that is proposed pays."""
    currency: str
    """What both are in."""

    @property
    def reason(self) -> str:
        """Both in one sentence."""
        if self.gain <= 0.0:
            return f"{self.proposer} is asked no further: nothing can cost less than what is approved"
        lost = f"an answer takes {self.answer_s:.1f} s, in which {self.lost:.2g} {self.currency} are lost"
        return f"{self.proposer} is asked no further: {lost}, and may win {self.gain:.2g} {self.currency} at most"


@dataclass(frozen=True, slots=True)
class Remarked:
    """A proposer said something besides its proposal; people read it, and nothing is decided by it."""

    kind: ClassVar[str] = "remarked"
    proposer: str
    """Who said it."""
    agent: str
    """Which of its agents: ``planning`` or ``action``."""
    remark: RemarkKind
    """What it is."""
    about: str
    """Component, hypothesis or permissive that it is about, by its name; empty where it is about none."""
    text: str
    """What was said."""

    @classmethod
    def of(cls, proposer: str, remark: Remark) -> Self:
        """The event of one remark."""
        return cls(proposer, remark.agent, remark.kind, remark.about, remark.text)


@dataclass(frozen=True, slots=True)
class ReleaseRefused:
    """The release check refused what had been approved: on fresh readings it does not hold any more."""

    kind: ClassVar[str] = "release-refused"
    proposer: str
    """Who proposed it."""
    digest: str
    """Digest of the action set."""
    findings: tuple[Finding, ...]
    """The checks that are violated."""

    @property
    def reason(self) -> str:
        """The worst of them in one sentence."""
        return min(self.findings, key=lambda f: f.margin).message if self.findings else "no reason was given"


@dataclass(frozen=True, slots=True)
class NoActionTaken:
    """The plant is left as it is: it meets every criterion, acting costs more, or what is seen goes by itself."""

    kind: ClassVar[str] = "no-action"
    state: str
    """State in which the plant was left."""
    min_margin: float
    """Least margin over the criteria, each in its own unit."""
    findings: tuple[Finding, ...] = ()
    """Every check with its margin, had nothing been done; empty in records that are older than this field."""
    members: int = 0
    """Members of the rollout; 0 in records that are older than this field."""
    late: bool = False
    """Whether something better was looked for, and not found in the time that there was."""
    recurs: str = ""
    """What came and went by itself before and is as it was then, for which nothing is done; empty for nothing."""


@dataclass(frozen=True, slots=True)
class Concluded:
    """Recovery thinks no more about what it noticed, and nothing else says so: nothing is done about it now."""

    kind: ClassVar[str] = "concluded"
    reason: str
    """Why, in one sentence."""


@dataclass(frozen=True, slots=True)
class Waited:
    """Nothing is released now, because it costs less to wait for a stated time and to look again."""

    kind: ClassVar[str] = "waited"
    proposer: str
    """Who proposed it."""
    seconds: float
    """How long [s]."""
    follows: str
    """What is expected to follow: the path of a proposal, or the name of a fallback."""
    nuisance: tuple[str, ...] = ()
    """Permissives and guards that refuse what follows now and will not then; empty where there is another reason."""


@dataclass(frozen=True, slots=True)
class ReleasedActions:
    """The guard wrote an approved action set to the plant."""

    kind: ClassVar[str] = "released"
    proposer: str
    """Who proposed it."""
    commands: tuple[Command, ...]
    """What was written."""
    digest: str
    """Digest of the action set."""
    target: str
    """State that it leads to."""
    min_margin: float
    """Least margin of the approval."""
    state: str = ""
    """State that its first commands lead to; empty in records that are older than this field."""
    then: tuple[LaterStep, ...] = ()
    """What follows, in order."""
    certificate: Certificate | None = None
    """Bound of the probability that a hard limit is violated; None in records that are older than this field."""
    for_s: float = 0.0
    """How long it is held before the plant is looked at again [s]; 0 where it is to last."""

    @classmethod
    def of(
        cls,
        proposer: str,
        actions: ActionSet,
        min_margin: float,
        certificate: Certificate | None = None,
        for_s: float = 0.0,
    ) -> Self:
        """The event of one release."""
        told = actions.end, min_margin, actions.target, LaterStep.all_of(actions), certificate, for_s
        return cls(proposer, actions.commands, actions.digest, *told)


@dataclass(frozen=True, slots=True)
class Noticed:
    """Monitoring saw something, a batch deviates from its prediction, or a step is to be asked for: thinking begins."""

    kind: ClassVar[str] = "noticed"
    symptoms: tuple[str, ...]
    """Names of the symptom rules that are active; empty for a scheduled review, and mostly for a step."""


@dataclass(frozen=True, slots=True)
class Probed:
    """A test move, or a wait, is to tell explanations apart that call for different answers."""

    kind: ClassVar[str] = "probed"
    apart: tuple[str, str]
    """Names of the two explanations between which most is at stake, the likelier one first."""
    state: str
    """State that the plant is brought to; empty for a wait."""
    commands: tuple[Command, ...]
    """What is commanded; none for a wait."""
    seconds: float
    """How long it lasts [s]."""
    nats: float
    """Predicted evidence between the two [nats]."""
    value: float
    """Production that knowing more is expected to win, as a fraction of the design rate [1]."""
    cost: float
    """Production that is expected to be lost meanwhile, and what moving costs [1]."""
    proposer: str = "search"
    """Who proposed it."""


@dataclass(frozen=True, slots=True)
class ProbeEnded:
    """What came of a test move or a wait."""

    kind: ClassVar[str] = "probe-ended"
    apart: tuple[str, str]
    """Names of the two explanations that it was to tell apart."""
    likeliest: str
    """Name of what explains the readings best now."""
    probability: float
    """Its probability [0, 1]."""
    told: bool
    """Whether that is enough to act on it alone."""


@dataclass(frozen=True, slots=True)
class Retrieved:
    """The graph answered a question, or documents were found that tell what is in it."""

    kind: ClassVar[str] = "retrieved"
    question: str
    """Name of the query template, or what documents were looked for."""
    form: str
    """SELECT, CONSTRUCT, ASK or DESCRIBE; BM25 where documents were looked for by their words."""
    about: tuple[str, ...]
    """What was asked about."""
    query_sha256: str
    """Hash of the bound query, and name of its file in the run directory; of words, kept with the prompts."""
    answer: str
    """The answer in short: names, yes or no, or the number of triples or documents."""
    answer_sha256: str
    """Hash of the subgraph or the documents' text, and name of its file; empty for answers that are neither."""
