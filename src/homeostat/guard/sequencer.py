"""The sequencer: carries out step by step what was released, one look at the plant per sample."""

from __future__ import annotations

from homeostat.domain.behaviour import StateMachine
from homeostat.domain.limits import Limits
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.permissives import permissive_findings, usable
from homeostat.stl.formula import FormulaError


class Sequencer:
    """Knows the state of the machine and the steps that wait for their guards.

    It belongs to the basic control system: it goes on while agents think, and never thinks itself. At the start it has
    the nominal route; later what the gate released.
    """

    def __init__(self, machine: StateMachine, limits: Limits, nominal: tuple[Step, ...] = ()) -> None:
        """``nominal``: what follows from the initial state when nothing is wrong."""
        self._machine, self._limits = machine, limits
        self._waiting = nominal
        self._entered: list[tuple[str, float]] = []
        self._at_s = 0.0
        self._sent: tuple[Command, ...] = ()
        self._seen: Snapshot | None = None
        self._aborting = False
        self.state = machine.initial.name
        """State that the plant is in."""
        self.refused: str | None = None
        """Why the next step is not taken although its guard holds; None where nothing is in its way."""

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """Look at the plant; the commands of the next step if its guard holds and no permissive forbids it."""
        self.refused, self._at_s = None, snapshot.at_s
        self._sent, self._seen = under_way(self._sent, snapshot, self._seen), snapshot
        if not self._waiting:
            return ()
        step, values = self._waiting[0], usable(snapshot)
        try:
            due = step.transition.guard.holds(values)
        except FormulaError:  # a tag without usable reading, a division by zero: what is not known does not hold
            due = False
        if not due:
            return ()
        if not self._aborting:  # what leads to a safe state is always allowed
            found = permissive_findings(snapshot, step.commands, self._limits)
            self.refused = next((f.message for f in found if not f.satisfied), None)
        if self.refused is not None:
            return ()
        self._waiting = self._waiting[1:]
        self._enter(step.target)
        self._sent = step.commands
        return step.commands

    def stop(self) -> None:
        """Take no further step before something is loaded: what is being written is not to be overtaken."""
        self._waiting, self.refused = (), None

    def load(self, actions: ActionSet, aborting: bool = False) -> None:
        """Go on with what was released; no permissive forbids a step of a fallback (``aborting``)."""
        self._waiting, self._sent, self.refused = actions.then, actions.commands, None
        self._aborting = aborting
        if actions.target != self.state:
            self._enter(actions.target)

    def rest(self) -> ActionSet:
        """What is left to do; its immediate commands are those that no snapshot shows yet, or whose ramp goes on."""
        return ActionSet(self._sent, self.state, self._waiting)

    def way(self) -> RecoveryPath | None:
        """The path that is left; None where nothing waits."""
        if not self._waiting:
            return None
        return RecoveryPath(self._machine, tuple(s.transition for s in self._waiting))

    def drain(self) -> tuple[tuple[str, float], ...]:
        """States that were entered since the last call, each with its process time [s]."""
        entered, self._entered = tuple(self._entered), []
        return entered

    def _enter(self, state: str) -> None:
        self.state = state
        self._entered.append((state, self._at_s))


def under_way(sent: tuple[Command, ...], now: Snapshot, before: Snapshot | None) -> tuple[Command, ...]:
    """Those of the commands ``sent`` whose ramp goes on: the reading is nearer than it was before, and not yet there.

    A ramp is not to be taken for its present value by whoever asks what follows if nobody interferes. Where somebody
    else commands the tag meanwhile, it comes no nearer, and what was sent is over.
    """
    if before is None:
        return ()
    return tuple(
        c for c in sent
        if c.rate is not None and c.value is not None
        and 0.0 < abs(c.value - now.values.get(c.tag, c.value)) < abs(c.value - before.values.get(c.tag, c.value))
    )  # fmt: skip


def nominal_route(machine: StateMachine, commands: dict[str, tuple[Command, ...]]) -> tuple[Step, ...]:
    """What follows from the initial state by itself; ``commands`` by state."""
    return what_follows(machine, machine.initial.name, commands)


def what_follows(machine: StateMachine, start: str, commands: dict[str, tuple[Command, ...]]) -> tuple[Step, ...]:
    """What follows from ``start`` by itself, the least risky transition first; ``commands`` by state."""
    steps: list[Step] = []
    here, been = start, {start}
    while True:
        onward = [t for t in machine.transitions if t.source == here and not t.on_decision and t.target not in been]
        if not onward:
            return tuple(steps)
        taken = min(onward, key=lambda t: machine.state(t.target).risk)
        steps.append(Step(taken, commands[taken.target]))
        here = taken.target
        been.add(here)
