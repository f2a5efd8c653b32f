"""Conditions: how the agents of a run are asked, and what they are told."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.agents.roles import AskingProtocol
from homeostat.journal import Setting


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a study varies besides the scenario."""

    protocol: AskingProtocol = AskingProtocol.ROUTE
    """When proposers are asked, and for how much."""
    label_given: bool = False
    """Whether agents are told the true faults from their onset on, as in studies without detection."""
    reprompting: bool = True
    """Whether a proposer may try again after a refusal."""
    ensemble: bool = True
    """Whether a proposal must hold for every plausible fault and parameter set, or for the most probable one only."""

    @property
    def settings(self) -> tuple[Setting, ...]:
        """As the journal has them."""
        return (
            Setting("protocol", self.protocol.value),
            Setting("label_given", int(self.label_given)),
            Setting("reprompting", int(self.reprompting)),
            Setting("ensemble", int(self.ensemble)),
        )
