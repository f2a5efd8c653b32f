"""A lapse: the lease is lost or the guard is dead, the plant's own control takes over, and the guard comes back."""

from collections.abc import Mapping

from homeostat.domain.alarm import Priority
from homeostat.domain.events.writes import Cause
from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.parts import Parts
from homeostat.guard.restart.memory import LOCAL
from homeostat.guard.sequence.recognition import admits_all, recognise
from homeostat.guard.sequence.sequencer import loaded
from homeostat.guard.sequence.service import Moved
from homeostat.guard.writing.flight import same, shown


class Lapse:
    """Knows what the plant's own control has moved while nobody held the lease, and where that leaves the guard.

    A lapse begins when the lease is lost, or with a restart, and ends with the first reading after the lease was taken
    again. A tag that has come to what the tables let local control do (`local`) is the plant's doing; every other one
    was moved by a person.
    """

    def __init__(self, parts: Parts, latch: Latch) -> None:
        """No lapse yet."""
        self._parts, self._latch = parts, latch
        self._lost = self._dead = False
        self._moved: dict[str, Moved] = {}

    def restart(self) -> None:
        """Nobody has held the lease since the journal ended."""
        self._dead = True

    def follow(self, now_s: float, wanted: bool) -> bool:
        """Give up what was on a wire that is lost, and take the lease again where it is ``wanted``.

        Whether the lease is lost. A fallback is not given up: it is sent again as soon as there is a wire.
        """
        tenure, writer = self._parts.tenure, self._parts.writer
        self._lost = bool(tenure.lost)
        if not self._lost:  # it was given back meanwhile
            self._moved.clear()
        flying = writer.flying
        if self._lost and flying is not None and flying.cause is not Cause.FALLBACK:
            writer.overtake(now_s, "the lease was lost")
            if flying.cause is Cause.PERSON:
                text = f"what {flying.source} ordered was given up: {tenure.lost}"
                self._parts.alarms.say("write:person", text, Priority.HIGH, now_s)
        if wanted and tenure.retake(now_s):
            writer.repeat(now_s)
        return self._lost

    def excuses(self, moved: Moved) -> bool:
        """Whether it was the plant's own control that has ``moved`` a target; after a shed it goes on by its recipe."""
        if not local(self._parts.rules, moved.tag, moved.now):
            return False
        if not (self._lost or self._dead):
            return self._latch.shed
        first = self._moved.get(moved.tag, moved)
        self._moved[moved.tag] = Moved(moved.tag, first.before, moved.now)
        return True

    def settle(self, now_s: float, readings: Snapshot) -> Mapping[str, Moved]:
        """End the lapse where the plant was read since the lease is held again; what a latched fallback puts right.

        Whatever the plant's own control has moved is an alarm. A fallback that stands is put right. Otherwise the
        sequence goes on where the plant's targets say that it stands; where no state on its way fits them, it stops:
        what was to follow was meant for another plant, and recovery or a person must act. Limits trip throughout.
        """
        tenure = self._parts.tenure
        again = self._lost and tenure.held and readings.at_s > tenure.taken_s
        if not readings.accepted or not (again or self._dead):
            return {}
        moved = {tag: m for tag, m in self._moved.items() if self._stays(m)}
        self._dead, self._moved = False, {}
        if again:
            tenure.settle(now_s)
        if not moved:
            return {}
        right = self._latch.standing and tenure.held
        if self._latch.reason is None:
            text = self._fall_in(moved, now_s, readings)
        elif self._latch.standing:
            text = "the fallback is put right" if right else "the fallback stands no more, and nobody writes"
        else:
            text = "the fallback is being sent"
        named = ", ".join(f"{m.tag} from {shown(m.before)} to {shown(m.now)}" for m in moved.values())
        self._parts.alarms.say("local", f"the plant's own control moved {named}; {text}", Priority.HIGH, now_s)
        return moved if right else {}

    def _stays(self, moved: Moved) -> bool:
        """Whether the tag is still where the plant's own control has brought it, and that is elsewhere than before."""
        tolerance = self._parts.rules.writables[moved.tag].tolerance
        now = self._parts.service.target(moved.tag)
        return same(moved.now, now, tolerance) and not same(moved.before, now, tolerance)

    def _fall_in(self, moved: Mapping[str, Moved], now_s: float, readings: Snapshot) -> str:
        """Have the sequence stand where the plant stands; a sentence for a person."""
        rules, sequencer = self._parts.rules, self._parts.sequencer
        if rules.recipe is Side.PLANT and not sequencer.carries:
            return f"its own recipe goes on, followed in state {sequencer.state!r}"
        evidence, left = self._parts.evidence(readings), sequencer.state
        if admits_all(rules.machine.state(left), evidence):
            return f"the sequence goes on in state {left!r}"
        found = recognise(rules.machine, evidence, left, rules.start_up.states)
        later = self._later(moved, readings)
        state, steps = later[0] if later else (found.state, ())
        actions = ActionSet((), state, steps)
        sequencer.load(actions, now_s, found=True)
        self._parts.note(loaded(LOCAL, actions, aborting=False), now_s)
        if later:
            further = ", ".join(repr(name) for name, _ in later[1:])
            return f"the sequence goes on from state {state!r}" + (f", and {further} would fit, too" if further else "")
        told = f"; {found}" if found.candidates else ""
        return f"state {left!r} does not admit that, so the sequence has stopped{told}; recovery or a person must act"

    def _later(self, moved: Mapping[str, Moved], readings: Snapshot) -> tuple[tuple[str, tuple[Step, ...]], ...]:
        """Where the sequence may stand behind its present state, the nearest first, and the steps behind each.

        The state admits the targets in service, and the plant's recipe has led there: its steps up to there command
        every target that was ``moved``.
        """
        rules, evidence, waiting = self._parts.rules, self._parts.evidence(readings), self._parts.sequencer.waiting
        led: dict[str, float | None] = {}
        found: list[tuple[str, tuple[Step, ...]]] = []
        for n, step in enumerate(waiting, 1):
            led.update({c.tag: c.value for c in step.commands})
            by_recipe = all(
                tag in led and same(led[tag], m.now, rules.writables[tag].tolerance) for tag, m in moved.items()
            )
            if by_recipe and admits_all(rules.machine.state(step.target), evidence):
                found.append((step.target, waiting[n:]))
        return tuple(found)


def local(rules: GuardRules, tag: str, target: float | None) -> bool:
    """Whether the plant's own control may have brought ``tag`` to ``target`` while nobody held the lease.

    By the tables it takes back to automatic what has an automatic mode, and goes on with its own recipe, the nominal
    sequence; every other target stays as it was.
    """
    rule = rules.writables[tag]
    if target is None:
        return rule.automatic
    recipe = (c.value for step in rules.nominal for c in step.commands if c.tag == tag)
    return any(same(value, target, rule.tolerance) for value in recipe)
