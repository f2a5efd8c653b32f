"""Ablations: what a study leaves out, one thing at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.agents.grounding.context import GroundingKind
from homeostat.evaluate.study.row import WHOLE


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
