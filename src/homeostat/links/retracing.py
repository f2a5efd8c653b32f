"""Retracing: a simulated plant is led again through what was done to it before its process died."""

from typing import final

from homeostat.domain.ports import Wire
from homeostat.domain.recovery import Command
from homeostat.links.simulated import SimulatedLink


@final
class Retracing:
    """Does to a simulated plant what a journal says was done; nobody decides anything here."""

    def __init__(self, link: SimulatedLink) -> None:
        """``link``: over a plant that has just been made, with the recipe that it had."""
        self.link = link
        """The plant."""
        self._wire: Wire | None = None

    def lease(self) -> None:
        """The lease was taken; nothing where it is held."""
        self._wire = self._wire or self.link.take()

    def give_back(self) -> None:
        """The lease was given back; nothing where nobody held it."""
        if self._wire is not None:
            self.link.give_back()
            self._wire = None

    def write(self, commands: tuple[Command, ...]) -> None:
        """``commands`` arrived on the wire."""
        self._wire = self._wire or self.link.take()
        self._wire.send(commands)
