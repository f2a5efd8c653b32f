"""The proposer that asks a language model."""

from homeostat.agents.language.action import LanguageAction
from homeostat.agents.language.planning import LanguagePlanning
from homeostat.agents.language.reprompting import TeachingReprompting
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.language.stepwise import StepAction, StepPlanning, StepReprompting
from homeostat.agents.roles import Proposer

NAME = "language"
"""Who acts where a language model's proposal is released."""
ATTEMPTS = 6
"""Most proposals in one recovery: each costs an answer or two."""
STEP_ATTEMPTS = 12
"""Most proposals for one step: what may follow a step is tried without asking."""


def language_proposer(by: Briefing, attempts: int | None = None) -> Proposer:
    """Planning, action and reprompting with the model of a briefing."""
    asked = LanguagePlanning(by), LanguageAction(by), TeachingReprompting(by)
    return Proposer(NAME, *asked, attempts or ATTEMPTS, remarks=by.said)


def step_proposer(by: Briefing, attempts: int | None = None) -> Proposer:
    """As :func:`language_proposer`, but asking for one step of the machine at a time."""
    asked = StepPlanning(by), StepAction(by), StepReprompting(by)
    return Proposer(NAME, *asked, attempts or STEP_ATTEMPTS, remarks=by.said)
