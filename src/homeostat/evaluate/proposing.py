"""Proposing: who proposes in a run, and how it is asked."""

from dataclasses import dataclass, field

from homeostat.agents.playbook.book import Book
from homeostat.evaluate.conditions import Conditions
from homeostat.journal import Setting
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Language, Propose, in_operation
from homeostat.recovery.bounds import Budget


@dataclass(frozen=True, slots=True)
class Proposing:
    """Who proposes, how it is asked, and what it knows; by default the search alone, as a plant is operated."""

    language: Language | None = None
    """Proposes after the search does, unless ``propose`` makes other proposers; None for no language model."""
    conditions: Conditions = field(default_factory=Conditions)
    """Those of a study."""
    propose: Propose | None = in_operation
    """Makes the proposers; where it is None, nobody acts, not even the fallback."""
    known: Plant | None = None
    """What the agents know of the plant where that is less; None for all of it."""
    budget: Budget = field(default_factory=Budget)
    """How long recovery works."""
    playbook: Book | None = None
    """What was released before; None where nobody is to know."""

    @property
    def settings(self) -> tuple[Setting, ...]:
        """As the journal has it, where it is not what is usual."""
        usual = self.budget.latency_s == Budget().latency_s
        budget = () if usual else (Setting("budget_s", self.budget.latency_s),)
        return budget if self.playbook is None else (*budget, Setting("playbook", self.playbook.sha256))
