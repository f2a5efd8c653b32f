"""The fallback: strategies in their order, each checked when it is armed and when it acts, sent until it stands."""

from dataclasses import dataclass, replace

from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.permissives import permissive_findings
from homeostat.guard.requests.verification import command_finding
from homeostat.guard.texts import said


@dataclass(frozen=True, slots=True)
class Chosen:
    """A strategy as it may act now."""

    strategy: FallbackStrategy
    """The strategy."""
    actions: ActionSet
    """Its commands without those for tags that are out of service, and what follows."""


class Fallbacks:
    """Knows which strategy acts next."""

    def __init__(self, rules: GuardRules) -> None:
        """In the order of the tables until somebody ranks them."""
        self._rules = rules
        self._ranked = rules.fallbacks
        self.armed = ""
        """The strategy that whoever ranked them wants first; empty where nobody did."""
        self._taken = frozenset[str]()
        self._first = ""
        self.spent: frozenset[str] = frozenset()
        """Strategies that have stood and not helped; none of them is taken again."""
        self.sent: frozenset[str] = frozenset()
        """Strategies that were sent since the last reset: what they do for a limit is not taken back for another's."""

    @property
    def ranked(self) -> tuple[FallbackStrategy, ...]:
        """The strategies, the one that acts first at the front."""
        return self._ranked

    def arm(self, names: tuple[str, ...], readings: Snapshot | None, in_service: frozenset[str]) -> tuple[str, ...]:
        """Rank the strategies by ``names``, those left out after them; what is wrong with the named ones, by line.

        One that does not pass its checks now is named and keeps its place: it is checked again when it acts.
        """
        known = {s.name for s in self._rules.fallbacks}
        wrong = [f"there is no fallback {name!r}" for name in names if name not in known]
        for strategy in self.rank(names):
            chosen = self.checked(strategy, readings, in_service)
            if isinstance(chosen, str):
                wrong.append(f"{strategy.name}: {chosen}")
        return tuple(wrong)

    def rank(self, names: tuple[str, ...]) -> tuple[FallbackStrategy, ...]:
        """Rank the strategies by ``names``, those left out after them; those that are named, in their order."""
        known = {s.name: s for s in self._rules.fallbacks}
        first = tuple(known[name] for name in dict.fromkeys(names) if name in known)
        self._ranked = (*first, *(s for s in self._rules.fallbacks if s not in first))
        self.armed = first[0].name if first else ""
        return first

    def begin(self, first: str = "", tried: frozenset[str] = frozenset()) -> None:
        """Begin a round in which ``first`` is taken before all others; those that were ``tried`` had their turn."""
        self._first, self._taken = first, tried - {first}

    def repeat(self, name: str) -> None:
        """Strategy ``name`` has its turn in this round once more, before all others."""
        self._first, self._taken = name, self._taken - {name}

    def spend(self, name: str) -> None:
        """Strategy ``name`` has stood and not helped."""
        self.spent |= {name}

    def take(
        self, limits: frozenset[str] = frozenset(), others: frozenset[str] = frozenset()
    ) -> FallbackStrategy | None:
        """The next strategy that has not stood in vain and takes nothing back; None where there is none.

        One that brings more of ``limits`` back is taken before those that bring back less; of equals one that brings
        more of the ``others`` back, then the one that stands before the others in rank.
        """
        left = self.left(limits, others)
        if not left:
            return None
        named = [s for s in left if s.name == self._first]
        strategy = max(named or left, key=lambda s: (len(limits & s.serves.keys()), len(others & s.serves.keys())))
        self._taken |= {strategy.name}
        return strategy

    def left(self, limits: frozenset[str], others: frozenset[str]) -> tuple[FallbackStrategy, ...]:
        """The strategies that may still be taken for ``limits`` while the ``others`` are violated, too."""
        return tuple(s for s in self._untaken if s.name == self._first or not self._takes_back(s, limits, others))

    def withheld(self, limits: frozenset[str], others: frozenset[str]) -> tuple[str, ...]:
        """Names of those that are not taken, because they could make a limit worse for which something was sent."""
        left = self.left(limits, others)
        return tuple(s.name for s in self._untaken if s not in left)

    @property
    def _untaken(self) -> tuple[FallbackStrategy, ...]:
        return tuple(s for s in self._ranked if s.name not in self._taken | self.spent)

    def _takes_back(self, strategy: FallbackStrategy, limits: frozenset[str], others: frozenset[str]) -> bool:
        """Whether ``strategy`` serves nothing that it would be taken for, and may undo what was sent for a limit.

        What it does to a limit that the tables do not say it serves nobody knows here, unless it sets nothing but what
        a strategy that was sent and serves the limit sets as well.
        """
        if strategy.serves.keys() & (limits or others):
            return False
        sent = [s for s in self._rules.fallbacks if s.name in self.sent]
        for name in (limits | others) - strategy.serves.keys():
            serving = [s for s in sent if name in s.serves]
            if serving and not any(_targets(strategy) <= _targets(s) for s in serving):
                return True
        return False

    def checked(
        self, strategy: FallbackStrategy, readings: Snapshot | None, in_service: frozenset[str]
    ) -> Chosen | str:
        """What of ``strategy`` may be written, or the first check that it fails; a broken rule fails it, too.

        A command to a tag that is out of service is left out, unless the table says that the strategy writes it.
        """
        try:
            return self._checked(strategy, readings, in_service)
        except BaseException as error:  # whatever is wrong with one strategy, the next one must get its turn
            return f"it cannot be checked: {said(error)}"

    def _checked(
        self, strategy: FallbackStrategy, readings: Snapshot | None, in_service: frozenset[str]
    ) -> Chosen | str:
        actions = strategy.actions
        parts = ((actions.target, actions.commands), *((s.target, s.commands) for s in actions.then))
        for target, commands in parts:
            state = self._rules.machine.state(target)
            for command in commands:
                admitted = state.setpoint(command.tag)
                found = command_finding(command, admitted, state.name, self._rules, fallback=True)
                if found is not None:
                    return found.message
        kept = tuple(c for c in actions.commands if c.tag in in_service or c.tag in strategy.forced)
        if not kept:
            return "every tag that it writes is out of service"
        if readings is not None:
            for finding in permissive_findings(readings, kept, self._rules.limits):
                if not finding.satisfied and finding.criterion not in strategy.waived:
                    return finding.message
        return Chosen(strategy, replace(actions, commands=kept))


def _targets(strategy: FallbackStrategy) -> frozenset[tuple[str, float | None]]:
    """Every tag that ``strategy`` writes, at once or later, with the target that it sets; None for automatic."""
    parts = (strategy.actions.commands, *(step.commands for step in strategy.actions.then))
    return frozenset((c.tag, c.value) for commands in parts for c in commands)
