"""Arms, who proposes in a campaign's run, and ablations, what is left out: values that other processes can be sent."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.roles import AskingProtocol
from homeostat.evaluate.named_model import NamedModel
from homeostat.evaluate.study.plan.constant import constant_proposer
from homeostat.evaluate.study.row import DO_NOTHING, FALLBACK_ONLY, HINDSIGHT, WHOLE
from homeostat.plants.assembly import Language, Propose, in_operation


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


SEARCH, CONSTANT = "search", "constant"
WITHOUT_MODEL = (SEARCH, CONSTANT, DO_NOTHING, FALLBACK_ONLY, HINDSIGHT)
"""Arms that ask no language model."""


@dataclass(frozen=True, slots=True)
class Arm:
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
        return in_operation if self.model is None or self.then_search else lambda bench: (bench.speaking(),)
