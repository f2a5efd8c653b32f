"""A job: one run of a study, with who proposes, what is left out and everything else that it depends on."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Final

import homeostat
from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language.named_model import NamedModel
from homeostat.agents.roles import AskingProtocol
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.plan.constant import constant_proposer
from homeostat.plants.wired.assembly import Language, Propose, in_operation, model_alone
from homeostat.record.row import DO_NOTHING, FALLBACK_ONLY, HINDSIGHT, SEARCH, WHOLE


@dataclass(frozen=True, slots=True)
class Ablation:
    """One thing that is left out."""

    grounding: GroundingKind = GroundingKind.GRAPH
    """What language models are shown of the plant; to any other proposer it makes no difference."""
    label_given: bool = False
    """The true faults are told: nothing is diagnosed."""
    reprompting: bool = True
    """A proposer may try again after a refusal."""
    ensemble: bool = True
    """A proposal must hold for every plausible fault and parameter set."""


ABLATIONS: Final[Mapping[str, Ablation]] = {
    WHOLE: Ablation(),
    "no-graph": Ablation(grounding=GroundingKind.NONE),
    "documents": Ablation(grounding=GroundingKind.DOCUMENTS),
    "no-reprompting": Ablation(reprompting=False),
    "no-ensemble": Ablation(ensemble=False),
    "label-given": Ablation(label_given=True),
}
"""Name in files and tables -> what it leaves out."""


CONSTANT = "constant"
WITHOUT_MODEL = (SEARCH, CONSTANT, DO_NOTHING, FALLBACK_ONLY, HINDSIGHT)
"""Arms that ask no language model."""


@dataclass(frozen=True, slots=True)
class StudyArm:
    """Who proposes, and how it is asked."""

    who: str
    """One of :data:`WITHOUT_MODEL`, or the name of a model."""
    label: str
    """Name in tables."""
    protocol: AskingProtocol
    """When it is asked, and for how much."""
    label_given: bool
    """Whether it is told the true faults."""
    then_search: bool
    """Whether the search follows a language model."""
    model: NamedModel | None = None
    """The language model; None for :data:`WITHOUT_MODEL`."""
    values: Mapping[str, float] = field(default_factory=dict)
    """What ``constant`` commands: tag -> value."""

    @property
    def recorded_digest(self) -> str:
        """Digest of the recorded answers that are replayed; empty where none are."""
        path = self.model.recorded if self.model else None
        return hashlib.sha256(path.read_bytes()).hexdigest() if path else ""

    def language(self, grounding: GroundingKind) -> Language | None:
        """The language model of one run, made anew; None where there is none."""
        return None if self.model is None else Language(self.model.make(), grounding=grounding)

    @property
    def propose(self) -> Propose | None:
        """What makes the proposers of a run; None where nobody acts."""
        if self.who == DO_NOTHING:
            return None
        if self.who == FALLBACK_ONLY:
            return lambda bench: ()
        if self.who == CONSTANT:
            return lambda bench: (constant_proposer(bench, self.values),)
        return in_operation if self.model is None or self.then_search else model_alone


@dataclass(frozen=True, slots=True)
class OwnPlant:
    """A plant in a folder of its own: nothing in the package says what it is."""

    folder: str
    """Absolute path; it counts for nothing."""
    configuration: str
    """Digest of what it held when the study was read."""


PARTS = (".py", ".csv", ".lark", ".md", ".rq", ".toml", ".ttl")
"""Files of the package that what is computed depends on."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run."""

    scenario: Scenario
    """Its ground truth."""
    label: str
    """Name of the scenario in the file."""
    kind: str
    """``none``, ``single``, ``paired`` or ``unknown``."""
    published: str
    """Row of the published tables; empty for none."""
    arm: StudyArm
    """Who proposes, and how it is asked."""
    ablation: str
    """What is left out."""
    thinking: Thinking
    """How much process time thinking takes."""
    keep: str
    """Which runs are kept: ``failures``, ``all`` or ``none``."""
    own: OwnPlant | None = None
    """Where the plant is; None for an installed one."""

    @property
    def name(self) -> str:
        """Unique in its study, and good for a folder's name."""
        parts = (self.scenario.case, self.label, str(self.scenario.seed), self.arm.label, self.ablation)
        return "~".join("".join(c if c.isalnum() or c in "._-+" else "-" for c in part) for part in parts)

    @property
    def fingerprint(self) -> str:
        """Digest of everything that the row depends on, the installed package included.

        Not of what is kept, nor of the folders that recorded answers and the plant are in: their content counts.
        """
        arm = self.arm
        if arm.model is not None and arm.model.recorded is not None:
            arm = replace(arm, model=replace(arm.model, name=arm.who))
        own = self.own and replace(self.own, folder="")
        job = asdict(replace(self, keep="", arm=arm, own=own))
        content = {**job, "code": code_digest(), "recorded": self.arm.recorded_digest}
        return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:32]


@cache
def code_digest() -> str:
    """Digest of the installed package: rows of two versions of it are no pair."""
    digest, root = hashlib.sha256(), Path(homeostat.__file__).parent
    for path in sorted(p for p in root.rglob("*") if p.suffix in PARTS):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
