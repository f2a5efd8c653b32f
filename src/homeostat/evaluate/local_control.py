"""Local control of a simulated plant: its own recipe, which takes the nominal sequence up where the plant stands."""

from collections.abc import Callable
from dataclasses import dataclass

from homeostat.domain.mode import Side
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.sequence.recognition import Evidence, followed
from homeostat.guard.sequence.sequencer import Sequencer, nominal_commands, what_follows
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import guard_rules, new_sequencer


@dataclass(frozen=True, slots=True)
class Told:
    """What the guard has told the plant's own control last; it stays, should the guard die."""

    state: str
    """State that the plant is in."""
    latched: bool = False
    """Whether a fallback has acted: the recipe stands until a person resets it."""
    carries: bool = False
    """Whether the guard writes something of its own: the recipe waits as long as the guard holds the lease."""


class LocalControl:
    """Runs the nominal sequence of a plant by itself whenever it is in charge."""

    def __init__(self, plant: Plant, guarded: bool, leased: Callable[[], bool]) -> None:
        """``guarded``: a guard is about to take the lease, so that nothing is to be begun before it has.

        ``leased`` says whether a guard holds the lease on the plant.
        """
        self._rules = guard_rules(plant)
        self._sequencer: Sequencer | None = None if guarded and plant.recipe is Side.GUARD else new_sequencer(plant)
        self._guarded, self._leased = guarded, leased
        self._told = Told(plant.description.machine.initial.name)

    @property
    def told(self) -> Told:
        """What the guard has told it last."""
        return self._told

    def tell(self, told: Told) -> None:
        """The guard says how it stands."""
        self._told = told

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """What the plant's own recipe commands after ``snapshot``."""
        if not self._in_charge():
            self._sequencer = None
            return ()
        if self._sequencer is None:
            self._sequencer = self._taken_up(snapshot)
        return () if self._sequencer is None else self._sequencer.sample(snapshot)

    def _in_charge(self) -> bool:
        leased, plants = self._leased(), self._rules.recipe is Side.PLANT
        if leased:
            self._guarded = False
        waits = self._guarded and not plants
        return not (self._told.latched or waits) and (not leased or (plants and not self._told.carries))

    def _taken_up(self, snapshot: Snapshot) -> Sequencer | None:
        """The nominal sequence from where the plant stands; None where nobody can tell, so that nothing is begun."""
        machine, limits = self._rules.machine, self._rules.limits
        state = followed(machine, Evidence(snapshot, self._rules.writables), self._told.state)
        if state is None:
            return None
        sequencer = Sequencer(machine, limits)
        sequencer.restore(state, what_follows(machine, state, nominal_commands(self._rules)), aborting=False)
        return sequencer
