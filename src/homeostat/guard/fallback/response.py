"""Response: what follows on violated limits: events, alarms and, where a fallback does not help, the next one."""

from homeostat.domain.alarm import Priority
from homeostat.domain.events.trips import FallbackIneffective, Tripped
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.effect import EffectWatch
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.fallback.trial import Trial
from homeostat.guard.parts import Parts
from homeostat.guard.watch.violations import Violation


class Response:
    """Knows which violated limits the fallback that acts answers, and whether it helps."""

    def __init__(self, parts: Parts, latch: Latch) -> None:
        """``latch``: the fallback."""
        self._parts, self._latch = parts, latch
        self._violated = self._before = self._answered = self._returned = frozenset[str]()
        self._told = frozenset[tuple[str, bool]]()
        self._unseen = self._asked = frozenset[str]()
        self._kept: dict[str, str] = {}
        self._unanswered: dict[str, str] = {}
        self._effects = EffectWatch(parts.rules.fallbacks, parts.rules.timing)
        self._strategy: str | None = None

    def remember(self, trial: Trial, latched: bool) -> None:
        """Go on after a death: a fallback that is ``latched`` has no more time to help, and answers nothing new."""
        self._before = trial.violated
        if latched:
            self._strategy = trial.acted or None
            self._answered, self._returned = trial.answered - trial.unseen, trial.returned
            self._effects.restore(trial.effects)

    def take(self, violations: tuple[Violation, ...], now_s: float, readings: Snapshot | None, acts: bool) -> None:
        """Journal what is newly violated; ``acts``: whether somebody may write, so that a fallback may follow."""
        names = frozenset(v.limit for v in violations)
        for violation in violations:
            if violation.limit not in self._violated or (violation.seen and violation.limit in self._unseen):
                self._begin(violation, now_s, acts)
        for name in sorted(self._violated - names):
            self._parts.alarms.return_(f"trip:{name}", now_s)
            self._unanswered.pop(name, None)
        for name in sorted(self._before - names):
            text = "it was violated when the guard died, and has come back"
            self._parts.alarms.say(f"trip:{name}", f"{name}: {text}", Priority.CRITICAL, now_s)
        ended, self._before = (self._violated | self._before) - names, frozenset()
        self._answered -= ended  # one that the dead guard had answered and that comes back is answered by the next
        self._violated, self._unseen = names, frozenset(v.limit for v in violations if not v.seen)
        strategy = self._latch.strategy.name if self._latch.strategy else None
        if strategy != self._strategy or not self._latch.standing or self._parts.tenure.lost:
            # what the plant's own control has done in a lapse is put right before anything is said of the strategy
            self._strategy = strategy
            self._returned, self._told = frozenset(), frozenset()
            self._effects.clear()
        if self._latch.reason is None:
            self._unanswered.clear()
        elif self._latch.standing:
            self._returned |= ended
            self._under_fallback(violations, now_s, readings, acts)
        self._tell_unseen(violations, now_s)
        self._end_kept(now_s)

    def _begin(self, violation: Violation, now_s: float, acts: bool) -> None:
        event = Tripped(violation.limit, violation.margin, violation.unit, violation.reason, acts, violation.seen)
        self._parts.note(event, now_s)
        self._parts.alarms.raise_(f"trip:{violation.limit}", violation.reason, Priority.CRITICAL, now_s)
        if violation.jumped and self._latch.reason is None:
            self._latch.fallbacks.rank(())  # whoever ranked them knew nothing of this: the tables' order counts
        if violation.seen and violation.limit not in self._answered:
            self._unanswered[violation.limit] = violation.reason

    def _under_fallback(
        self, violations: tuple[Violation, ...], now_s: float, readings: Snapshot | None, acts: bool
    ) -> None:
        """A fallback stands: another limit, or one that it does not help, has the next strategy act."""
        strategy = self._latch.strategy
        if strategy is not None:
            served = (self._unanswered.keys() & strategy.serves.keys()) - self._returned
            for name in served:
                del self._unanswered[name]
            failed = self._effects.failed(now_s, strategy, violations)
            for event in self._effects.news(strategy) if not self._parts.tenure.lost else ():
                self._parts.note(event, now_s)
            if failed is not None:
                self._ineffective(strategy.name, *failed, now_s, readings, acts)
                if acts:
                    return
        if self._unanswered and acts:
            reason = next(iter(self._unanswered.values()))
            if not self._latch.escalate(self._answer(), reason, now_s, readings, self._violated):
                text = f"no other fallback is left: {reason}"
                self._parts.alarms.raise_("fallbacks", text, Priority.CRITICAL, now_s)

    def _tell_unseen(self, violations: tuple[Violation, ...], now_s: float) -> None:
        """A limit that cannot be judged has no other fallback act: a person must look whether this one helps."""
        alarms, latch = self._parts.alarms, self._latch
        acted = latch.strategy.name if latch.strategy is not None and latch.standing else ""
        asked = {v.limit: v.reason for v in violations if acted and not v.seen}
        for name in sorted(self._asked - asked.keys()):
            alarms.return_(f"unseen:{name}", now_s)
        for name, reason in asked.items():
            text = f"whether {acted!r} helps cannot be seen, a person must look; no other fallback is tried for that"
            alarms.raise_(f"unseen:{name}", f"{text}: {reason}", Priority.CRITICAL, now_s)
        self._asked = frozenset(asked)

    def _answer(self) -> frozenset[str]:
        """The violated limits that nothing answers yet; what acts next is chosen against them."""
        found = frozenset(self._unanswered)
        self._unanswered.clear()
        return found

    def _ineffective(
        self, strategy: str, limit: str, reason: str, now_s: float, readings: Snapshot | None, acts: bool
    ) -> None:
        """``limit`` is not helped: the next strategy acts, or what stands is kept where that might make it worse."""
        calling = frozenset(self._unanswered) | {limit}
        others = self._latch.keeps(calling, readings, self._violated) if acts else ()
        given_up = acts and not others
        if (limit, given_up) not in self._told:
            self._told |= {(limit, given_up)}
            self._parts.note(FallbackIneffective(strategy, limit, reason, given_up), now_s)
        self._parts.alarms.raise_(f"fallback:{strategy}", reason, Priority.CRITICAL, now_s)
        if others:
            named = " and ".join(map(repr, others))
            text = f"{strategy!r} is kept, because {named} may make {limit} worse; a person must act: {reason}"
            self._kept[limit] = strategy
            self._parts.alarms.raise_(f"kept:{limit}", text, Priority.CRITICAL, now_s)
        elif acts:
            self._latch.give_up(self._answer() | {limit}, reason, now_s, readings, self._violated)

    def _end_kept(self, now_s: float) -> None:
        """Nobody need act for a limit that has come back, or under another strategy, or after a reset."""
        acted = self._latch.strategy.name if self._latch.strategy is not None else ""
        for name in [n for n, kept in self._kept.items() if n not in self._violated or kept != acted]:
            del self._kept[name]
            self._parts.alarms.return_(f"kept:{name}", now_s)
