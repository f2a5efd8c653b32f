"""The proposer that asks a language model."""

from __future__ import annotations

from collections.abc import Sequence

from homeostat.agents.grounding.context import Excerpts
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.language.action import LanguageAction
from homeostat.agents.language.planning import LanguagePlanning
from homeostat.agents.language.reprompting import TeachingReprompting
from homeostat.agents.language.stepwise import StepAction, StepPlanning, StepReprompting
from homeostat.agents.roles import Proposer, Simulation
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.production import Production
from homeostat.llm.model import LanguageModel

NAME = "language"
"""Who acts where a language model's proposal is released."""
ATTEMPTS = 6
"""Most proposals in one recovery: each costs an answer or two."""
STEP_ATTEMPTS = 12
"""Most proposals for one step: what may follow a step is tried without asking."""


def step_proposer(
    model: LanguageModel, plant: PlantDescription, grounding: Grounding, simulation: Simulation,
    production: Production, notes: Sequence[str] = (), excerpts: Excerpts | None = None,
) -> Proposer:  # fmt: skip
    """As :func:`language_proposer`, but asking for one step of the machine at a time."""
    shown = excerpts or grounding
    return Proposer(
        NAME,
        StepPlanning(model, plant, grounding, notes, shown),
        StepAction(model, plant, shown, production, notes),
        StepReprompting(model, plant, simulation, shown.kind),
        STEP_ATTEMPTS,
    )


def language_proposer(
    model: LanguageModel, plant: PlantDescription, grounding: Grounding, simulation: Simulation,
    production: Production, notes: Sequence[str] = (), excerpts: Excerpts | None = None,
) -> Proposer:  # fmt: skip
    """Planning, action and reprompting with ``model``; ``notes`` are what operators wrote.

    ``excerpts`` finds what the model is shown of the plant; None for parts of the graph.
    """
    shown = excerpts or grounding
    return Proposer(
        NAME,
        LanguagePlanning(model, plant, grounding, notes, shown),
        LanguageAction(model, plant, shown, production, simulation, notes),
        TeachingReprompting(model, plant, simulation, shown.kind),
        ATTEMPTS,
    )
