"""What a guard knows of a plant: rules from tables and settings, for which nothing of the plant's code is loaded."""

from dataclasses import replace
from typing import Protocol

from homeostat.agents.search.candidates import design_commands
from homeostat.domain.mode import Side
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import Command, FallbackStrategy, Step
from homeostat.guard.sequence.sequencer import nominal_route, what_follows

ISSUER = "release-check"
"""Name in which the release check seals requests."""


class Guarded(Protocol):
    """A plant as far as a guard knows it; with its process model, or without."""

    @property
    def name(self) -> str:
        """Name of the folder."""
        ...

    @property
    def description(self) -> PlantDescription:
        """What the graph says."""
        ...

    @property
    def recipe(self) -> Side:
        """Who runs the nominal sequence in modes that write."""
        ...

    @property
    def configuration(self) -> str:
        """Digest of everything that configures the plant."""
        ...


def rules_of(plant: Guarded) -> GuardRules:
    """What the guard knows of ``plant``, whose nominal sequence is the recipe by design."""
    d = plant.description
    return GuardRules(
        plant=plant.name,
        tags=d.tags_by_name,
        machine=d.machine,
        limits=d.limits,
        trips=d.trips,
        qualities=d.qualities,
        writables=d.writables,
        fallbacks=fallback_strategies(d),
        nominal=by_design(d),
        start_up=d.start_up,
        recipe=plant.recipe,
        configuration=plant.configuration,
        timing=d.timing,
    )


def by_design(plant: PlantDescription) -> tuple[Step, ...]:
    """What follows from the initial state by itself: the recipe by design."""
    return nominal_route(plant.machine, _commands(plant))


def fallback_strategies(plant: PlantDescription) -> tuple[FallbackStrategy, ...]:
    """The fallback strategies of ``plant``, each with the steps that follow from its state by themselves."""
    commands = _commands(plant)
    return tuple(
        replace(s, actions=replace(s.actions, then=what_follows(plant.machine, s.actions.target, commands)))
        for s in plant.fallback_strategies
    )


def _commands(plant: PlantDescription) -> dict[str, tuple[Command, ...]]:
    """State -> what it is commanded by design."""
    return {state.name: design_commands(state, plant.tags_by_name) for state in plant.machine.states}
