"""What the agents of one language model share, in tests."""

from __future__ import annotations

from homeostat.agents.grounding.context import ContextFinder
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import Simulation
from homeostat.llm.model import LanguageModel
from homeostat.plants.plant import Plant


def briefing(
    model: LanguageModel,
    plant: Plant,
    simulation: Simulation,
    notes: tuple[str, ...] = (),
    shown: ContextFinder | None = None,
) -> Briefing:
    """A briefing on ``case``; ``shown`` finds its context, that of the graph where not given."""
    grounding = Grounding(plant.graph, plant.namespace)
    return Briefing(model, plant.description, plant.prices, grounding, shown or grounding, simulation, notes)
