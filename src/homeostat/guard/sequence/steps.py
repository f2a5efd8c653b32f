"""Steps of the sequence as the guard writes them: one that the plant does not take stays due."""

import math
from dataclasses import replace

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import StepTaken
from homeostat.domain.events.writes import Cause
from homeostat.domain.mode import Mode, Side
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.parts import Parts
from homeostat.guard.requests.permissives import permissive_findings
from homeostat.guard.requests.verification import command_finding
from homeostat.guard.sequence.arrivals import Arrivals
from homeostat.guard.sequence.recognition import followed, step_made
from homeostat.guard.sequence.sequencer import loaded, nominal_commands, what_follows
from homeostat.guard.writing.flight import Failed, Progress, Write


class Steps:
    """Writes what the sequencer has due, whenever nothing else is under way."""

    def __init__(self, parts: Parts, latch: Latch, arrivals: Arrivals) -> None:
        """``latch`` says whose steps they are: those of a fallback are kept from nothing but a person's tags.

        ``arrivals`` knows which steps of the plant's own recipe are on their way.
        """
        self._parts, self._latch, self._arrivals = parts, latch, arrivals
        self.withdrawn = False
        """Whether nobody was to write since this guard began: what was released before that is void."""
        self._step: Step | None = None
        self._owed: Write | None = None
        self._owed_under: str | None = None
        self._again_s = -math.inf

    def owe(self, write: Write) -> None:
        """``write``, a step that counts as taken, is owed to the plant until it holds: it is sent again if need be."""
        self._owed, self._owed_under = write, self._latch.reason

    def drop(self) -> None:
        """Something else was released: what was owed to the plant is void."""
        self._owed = None

    def withdraw(self, why: str, now_s: float) -> None:
        """Nobody writes any more: what was released and waits does not go on when somebody writes again.

        What the guard takes up again then is its own recipe, from where the plant stands. A fallback's steps are
        another matter: they wait for a reset, which ends them.
        """
        owed, self._owed, self.withdrawn = self._owed, None, True
        parts, sequencer = self._parts, self._parts.sequencer
        if self._latch.reason is not None:
            return
        left = sequencer.waiting if sequencer.carries else ()
        state, rules = sequencer.state, parts.rules
        if left:
            nominal = what_follows(rules.machine, state, nominal_commands(rules)) if rules.nominal else ()
            sequencer.restore(state, nominal, aborting=False)
            parts.note(loaded("", ActionSet((), state, nominal), aborting=False), now_s)
            left = () if rules.recipe is Side.GUARD and left == nominal else left
        named = [*([owed.source] if owed is not None else []), *(s.transition.name for s in left)]
        if named:
            text = f"{why}: {', '.join(map(repr, named))} waited to be written, and will not be"
            parts.alarms.say("withdrawn", text, Priority.MEDIUM, now_s)

    def follow(self, write: Write | None, progress: Progress | Failed | None, now_s: float) -> None:
        """Take note of how far ``write``, a step, has come: taken once the plant has got it, due again if it failed."""
        parts, step = self._parts, self._step
        if write is None or write.cause is not Cause.SEQUENCE:
            return
        if step is not None and (parts.writer.accepted or progress is Progress.CONFIRMED):
            self._step = None
            self._taken(step, now_s)
            self.owe(write)
        if isinstance(progress, Failed):
            self._again_s = now_s + parts.settings.again_s
        elif progress is Progress.CONFIRMED:
            self._owed = None

    @property
    def owes(self) -> bool:
        """Whether a step that counts as taken is still owed to the plant."""
        return self._owed is not None

    def plants(self, mode: Mode) -> bool:
        """Whether the plant's own recipe runs: where nobody writes, or where it is to and nothing released is left."""
        if self._latch.reason is not None:
            return False
        left = self.owes or self._parts.sequencer.carries
        return not mode.writes or (self._parts.rules.recipe is Side.PLANT and not left)

    def follow_plant(self, now_s: float, readings: Snapshot | None, mode: Mode) -> None:
        """Stand where the plant stands whose own recipe runs, by its targets and readings."""
        parts, sequencer = self._parts, self._parts.sequencer
        if readings is None or not self.plants(mode) or parts.writer.flying is not None:
            return
        sequencer.look(readings)
        machine, waiting, evidence = parts.rules.machine, sequencer.waiting, parts.evidence(readings)
        made = step_made(machine, evidence, sequencer.state, self._arrivals.look(now_s, readings))
        if made is not None:
            self._arrivals.enter(made.target, now_s)
        elif self._arrivals.begun(readings):
            return  # half of a step may look like another state
        if made is not None and waiting and waiting[0].target == made.target and not sequencer.released:
            self._taken(waiting[0], now_s)
            return
        state = made.target if made is not None else self._elsewhere(readings)
        if state is not None and state != sequencer.state:
            actions = ActionSet((), state, what_follows(machine, state, nominal_commands(parts.rules)))
            sequencer.follow(state, actions.then, now_s, found=made is None)
            parts.note(loaded("", actions, aborting=False), now_s)

    def _elsewhere(self, readings: Snapshot) -> str | None:
        """State in which the plant stands without a step; what it does not admit was moved by a person just now.

        Such a target tells nothing: the state that it seems to have left may be the present one.
        """
        parts, believed = self._parts, self._parts.sequencer.state
        machine, evidence = parts.rules.machine, parts.evidence(readings)
        state = followed(machine, evidence, believed)
        if state is None:
            return None
        changed = parts.service.changed(readings)
        foreign = frozenset(m.tag for m in changed if not evidence.admits(machine.state(state), m.tag, m.now))
        return followed(machine, replace(evidence, out=evidence.out | foreign), believed)

    def go_on(self, now_s: float, readings: Snapshot | None, mode: Mode) -> None:
        """Begin to write the step that is due, where nothing else is under way."""
        parts = self._parts
        if readings is None or parts.writer.flying is not None:
            return
        if self.plants(mode):
            return
        if parts.tenure.lost:
            parts.sequencer.refused = f"the lease is lost: {parts.tenure.lost}"
            return
        stands = self._latch.reason, parts.sequencer.state
        if self._owed is not None and (self._owed_under, self._owed.state) != stands:
            self._owed = None  # a fallback, a reset or a start has come between
        if self._owed is not None:
            self._pay(self._owed, now_s, readings)
            return
        step = parts.sequencer.due(readings)
        if step is None:
            return
        if not mode.writes:
            parts.sequencer.refused = f"in mode {mode.value!r} nobody writes"
            return
        commands = self._latch.allowed(step.commands)
        why = self._objection(commands, step.target)
        if why:
            parts.sequencer.refused = why
        elif not commands:
            self._taken(step, now_s)
        elif now_s >= self._again_s:
            self._begin(Write(Cause.SEQUENCE, step.transition.name, commands, step.target), step, now_s)

    def objection(self, write: Write, readings: Snapshot) -> str:
        """Why ``write`` may not be tried again on ``readings``; empty where it may."""
        why = self._objection(write.commands, write.state)
        if why or self._latch.reason is not None:
            return why
        found = permissive_findings(readings, write.commands, self._parts.rules.limits)
        return next((f.message for f in found if not f.satisfied), "")

    def _objection(self, commands: tuple[Command, ...], target: str) -> str:
        """The first check that ``commands`` fail whatever the plant reads; empty where they pass."""
        rules = self._parts.rules
        state = rules.machine.state(target)
        for command in commands:
            found = command_finding(command, state.setpoint(command.tag), state.name, rules)
            if found is not None:
                return found.message
            if command.tag not in self._parts.service.tags and command.tag not in self._latch.forced:
                return f"{command.tag!r} is out of service"
        return ""

    def _pay(self, owed: Write, now_s: float, readings: Snapshot) -> None:
        """Send again what counts as taken."""
        why = self.objection(owed, readings)
        self._parts.sequencer.refused = why or None
        if not why and now_s >= self._again_s:
            self._begin(owed, None, now_s)

    def _begin(self, write: Write, step: Step | None, now_s: float) -> None:
        """Send ``write``; ``step`` is taken once the plant has got it, None where it counts as taken already."""
        self._step = step
        self._parts.writer.begin(write, now_s)
        self.follow(write, None, now_s)

    def _taken(self, step: Step, now_s: float) -> None:
        self._parts.sequencer.take(step, now_s)
        self._parts.note(StepTaken(step.transition.name, step.target), now_s)
