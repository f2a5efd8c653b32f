"""The sequencer: which step of what was released is due, one look at the plant per tick (ISA-88)."""

from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.writes import StepLoaded
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.permissives import permissive_findings, usable


class Sequencer:
    """Knows the state of the machine and the steps that wait for their guards; what is due is written by the guard.

    It never thinks: at the start it has the nominal route, later what was released. A step is taken when the plant has
    got its commands, and stays due until then.
    """

    def __init__(self, machine: StateMachine, limits: Limits, nominal: tuple[Step, ...] = ()) -> None:
        """``nominal``: what follows from the initial state when nothing is wrong."""
        self._machine, self._limits = machine, limits
        self._waiting = nominal
        self._entered: list[tuple[str, float]] = []
        self._made: list[tuple[str, float]] = []
        self._sent: tuple[Command, ...] = ()
        self._seen: Snapshot | None = None
        self._aborting = False
        self.released = False
        """Whether what waits was released or belongs to a fallback, and is not the nominal sequence."""
        self.state = machine.initial.name
        """State that the plant is in."""
        self.refused: str | None = None
        """Why the next step is not taken although its guard holds; None where nothing is in its way."""

    def due(self, snapshot: Snapshot) -> Step | None:
        """Look at the plant; the next step if its guard holds and no permissive forbids it."""
        self.look(snapshot)
        if not self._waiting:
            return None
        step, values = self._waiting[0], usable(snapshot)
        if not step.transition.guard.holds(values):
            return None
        if not self._aborting:  # what leads to a safe state is always allowed
            found = permissive_findings(snapshot, step.commands, self._limits)
            self.refused = next((f.message for f in found if not f.satisfied), None)
        return step if self.refused is None else None

    def look(self, snapshot: Snapshot) -> None:
        """Look at the plant: what was sent and is not there yet is under way."""
        self.refused = None
        self._sent, self._seen = under_way(self._sent, snapshot, self._seen), snapshot

    def take(self, step: Step, at_s: float) -> None:
        """The plant has got the commands of ``step``, which was due, at process time ``at_s`` [s]."""
        if not self._waiting or self._waiting[0] != step:
            raise ValueError(f"step {step.transition.name!r} is not the one that waits")
        self._waiting = self._waiting[1:]
        self._sent = step.commands
        self._enter(step.target, at_s)

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """What is commanded after ``snapshot`` where every command arrives at once: a recipe inside a plant."""
        step = self.due(snapshot)
        if step is None:
            return ()
        self.take(step, snapshot.at_s)
        return step.commands

    def stop(self) -> None:
        """Take no further step before something is loaded: what is being written is not to be overtaken."""
        self._waiting, self.refused = (), None

    def load(self, actions: ActionSet, at_s: float, aborting: bool = False, found: bool = False) -> None:
        """Go on with what was written at ``at_s`` [s]; no permissive forbids a step of a fallback (``aborting``).

        ``found``: the state was found by reading the plant, and nothing that leads to it was written.
        """
        self._waiting, self._sent, self.refused = actions.then, actions.commands, None
        self._aborting, self.released = aborting, True
        if actions.target != self.state:
            self._enter(actions.target, at_s, found)

    def follow(self, state: str, waiting: tuple[Step, ...], at_s: float, found: bool) -> None:
        """The plant stands in ``state`` by itself at ``at_s`` [s]; ``waiting`` is nominal.

        ``found``: no transition that leads there was seen.
        """
        self._waiting, self._sent, self.refused = waiting, (), None
        self._aborting = self.released = False
        self._enter(state, at_s, found)

    def restore(self, state: str, waiting: tuple[Step, ...], aborting: bool, released: bool = False) -> None:
        """Stand where a journal says that the sequence stood."""
        self._machine.state(state)
        self.state, self._waiting, self._aborting, self.released = state, waiting, aborting, released

    @property
    def carries(self) -> bool:
        """Whether a step waits that was released or belongs to a fallback."""
        return self.released and bool(self._waiting)

    @property
    def entered(self) -> str | None:
        """State that was entered last since the last :meth:`drain`; None where none was."""
        return self._entered[-1][0] if self._entered else None

    @property
    def waiting(self) -> tuple[Step, ...]:
        """The steps that are left."""
        return self._waiting

    def rest(self) -> ActionSet:
        """What is left to do; its immediate commands are those that no snapshot shows yet, or whose ramp goes on."""
        return ActionSet(self._sent, self.state, self._waiting)

    def way(self) -> RecoveryPath | None:
        """The path that is left; None where nothing waits, or nothing that a proposer could take."""
        try:
            return RecoveryPath(self._machine, tuple(s.transition for s in self._waiting))
        except ValueError:  # nothing waits, or steps of a fallback, which need not make a path of a proposer
            return None

    def drain(self) -> tuple[tuple[str, float], ...]:
        """States that were entered since the last call, each with its process time [s]."""
        entered, self._entered = tuple(self._entered), []
        return entered

    def made(self) -> tuple[tuple[str, float], ...]:
        """Those of them, since the last call, that a step, a request or a start has led to."""
        made, self._made = tuple(self._made), []
        return made

    def _enter(self, state: str, at_s: float, found: bool = False) -> None:
        self.state = state
        self._entered.append((state, at_s))
        if not found:
            self._made.append((state, at_s))


def nominal_commands(rules: GuardRules) -> dict[str, tuple[Command, ...]]:
    """State -> what it is commanded by design, at the rates of the tables."""
    return {
        s.name: tuple(
            Command(r.tag, r.design, None if r.design is None else rules.tags[r.tag].rate_limit) for r in s.setpoints
        )
        for s in rules.machine.states
    }


def under_way(sent: tuple[Command, ...], now: Snapshot, before: Snapshot | None) -> tuple[Command, ...]:
    """Those of the commands ``sent`` whose ramp goes on: the reading is nearer than it was before, and not yet there.

    A ramp is not to be taken for its present value by whoever asks what follows if nobody interferes. Where somebody
    else commands the tag meanwhile, it comes no nearer, and what was sent is over.
    """
    if before is None:
        return ()
    return tuple(
        c
        for c in sent
        if c.rate is not None
        and c.value is not None
        and 0.0 < abs(c.value - now.values.get(c.tag, c.value)) < abs(c.value - before.values.get(c.tag, c.value))
    )


def nominal_route(machine: StateMachine, commands: dict[str, tuple[Command, ...]]) -> tuple[Step, ...]:
    """What follows from the initial state by itself; ``commands`` by state."""
    return what_follows(machine, machine.initial.name, commands)


def what_follows(machine: StateMachine, start: str, commands: dict[str, tuple[Command, ...]]) -> tuple[Step, ...]:
    """What follows from ``start`` by itself, the least risky transition first; ``commands`` by state."""
    steps: list[Step] = []
    here, been = start, {start}
    for _ in machine.states:  # none is entered twice
        onward = [t for t in machine.transitions if t.source == here and not t.on_decision and t.target not in been]
        if not onward:
            break
        taken = min(onward, key=lambda t: machine.state(t.target).risk)
        steps.append(Step(taken, commands[taken.target]))
        here = taken.target
        been.add(here)
    return tuple(steps)


def loaded(source: str, actions: ActionSet, aborting: bool) -> SequenceLoaded:
    """The event of a sequencer that goes on with ``actions``."""
    steps = tuple(StepLoaded(s.transition.name, s.commands) for s in actions.then)
    return SequenceLoaded(source, actions.target, steps, aborting)
