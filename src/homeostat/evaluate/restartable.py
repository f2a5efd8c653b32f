"""A simulated plant with its own control that can begin again, as it is served to whoever attaches to it."""

import math
from collections.abc import Callable
from dataclasses import replace

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.reference.unsupervised import true_plant
from homeostat.evaluate.scenario import Scenario
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.links.truth.process import TrueProcess
from homeostat.plants.plant import Plant


class RestartablePlant:
    """Makes the same plant anew as often as it is to begin."""

    def __init__(self, plant: Plant, scenario: Scenario, heartbeat_s: float) -> None:
        """It is as ``scenario`` says, and has no end; it sheds after ``heartbeat_s`` without a heartbeat [s]."""
        self._plant, self._configuration = plant, LinkConfiguration(heartbeat_s=heartbeat_s, recipe_by=plant.recipe)
        self._truth = replace(true_plant(plant, scenario), end_s=math.inf)
        self.holds: Callable[[], bool] = lambda: False
        """Whether its own recipe waits, because somebody outside says so."""

    def begin(self) -> tuple[SimulatedLink, TrueProcess]:
        """The plant at its start, from outside and as it is."""
        initial = self._plant.description.machine.initial.name
        process = TrueProcess(self._plant.model, self._plant.description, self._truth, record=False)
        local = LocalControl(self._plant, False, lambda: link.leased)

        def recipe(snapshot: Snapshot) -> tuple[Command, ...]:
            local.tell(Told(initial, latched=self.holds()))
            return local.sample(snapshot)

        link = SimulatedLink(process, self._configuration, recipe)
        return link, process
