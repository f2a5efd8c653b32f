"""Alternatives of one recovery: what was found so far, and which of it costs least."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Self

from homeostat.agents.certificates import Course
from homeostat.agents.roles import Approved
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.events.recovery import Compared
from homeostat.domain.plant.prices import Prices
from homeostat.domain.recovery import ActionSet
from homeostat.recovery.choices import Choice, Testing, Waiting, course
from homeostat.recovery.worth_asking import Worth


class Alternatives:
    """The one list of a recovery."""

    def __init__(
        self,
        given: Sequence[tuple[Alternative, Course | None]],
        prices: Prices,
        well: bool = False,
        first: bool = False,
        pressed: bool = False,
    ) -> None:
        """``given``: what may be done without a proposal, and what it commands; None for what goes on by itself.

        ``prices``: what its costs are by; ``well``: left alone, the plant does what is asked of it; ``first``: the
        first that is approved will do, as where every step is asked for; ``pressed``: something must be done, or the
        fallback acts.
        """
        self._given, self._prices, self.well, self._first = list(given), prices, well, first
        self._pressed = pressed
        self._found: list[tuple[Alternative, Choice]] = []
        self._barred: list[tuple[Alternative, Course]] = []

    @property
    def leave(self) -> Alternative | None:
        """Leaving the plant alone, where that may be done."""
        return next((a for a, _ in self._given if a.kind is AlternativeKind.LEAVE and a.admitted), None)

    @property
    def lacking(self) -> bool:
        """Whether the plant must not be left alone, and nothing that was proposed may be done."""
        return self._pressed and self.best is None

    @property
    def dear(self) -> Approved | None:
        """What would be released although leaving the plant alone costs less, because that may not go on for ever."""
        best, left = self.best, [a for a, _ in self._given if a.kind is AlternativeKind.LEAVE]
        if not self._pressed or not isinstance(best, Approved) or best.for_s or best.beside is not None:
            return None
        return best if left and best.cost.total > left[0].cost.total else None

    @property
    def currency(self) -> str:
        """What costs are in."""
        return self._prices.currency

    @property
    def suffices(self) -> bool:
        """Whether the first that is approved will do, and something is."""
        return self._first and self.best is not None

    def worth(self, test: float = 0.0) -> Worth | None:
        """What one more proposal may win, and what the plant loses meanwhile; None where nothing is approved yet.

        Everything that may be proposed pays for a release at least, less what a test move is worth; ``test``: that of
        the best on offer, as a share of the design production [1]. Costs are spread over the time that they are of.
        What nobody can say of leaving the plant alone counts as nothing lost.
        """
        best = self.best
        if best is None:
            return None
        per_s, whole = self._prices.worth(1.0), best.cost.worth
        left = next((a.cost.total for a, _ in self._given if a.kind is AlternativeKind.LEAVE), math.nan)
        lost = left - best.cost.total
        lost_per_s = lost * per_s / whole if math.isfinite(lost) and whole > 0.0 else 0.0
        return Worth(max(best.cost.total - self._prices.release + test * whole, 0.0), max(lost_per_s, 0.0))

    def anew(self) -> Self:
        """The list without what was proposed, of a plant that has gone on: what was drawn is of where it stood."""
        given = [(replace(a, certificate=None), commanded) for a, commanded in self._given]
        return type(self)(given, self._prices, self.well, self._first, self._pressed)

    @property
    def lasting(self) -> Approved | None:
        """The cheapest approved proposal that is to last; of equals the first."""
        admitted = [found for a, found in self._found if a.admitted and isinstance(found, Approved) and not found.for_s]
        return min(admitted, key=lambda found: found.cost.total, default=None)

    @property
    def best(self) -> Choice | None:
        """The cheapest approved choice that is cheaper than leaving the plant alone; of equals the first."""
        admitted = [(a, found) for a, found in self._found if a.admitted]
        if not admitted:
            return None
        best, found = min(admitted, key=lambda pair: pair[0].cost.total)
        leave = self.leave
        return found if leave is None or best.cost.total < leave.cost.total else None

    @property
    def cheapest(self) -> Alternative | None:
        """The cheapest of all that may be done, leaving the plant alone included; of equals the first."""
        admitted = [a for a, _ in (*self._given, *self._found) if a.admitted]
        return min(admitted, key=lambda a: a.cost.total, default=None)

    def add(self, found: Choice) -> None:
        """A proposal, a wait or a test was approved; a wait that stands in the list already is not tried again."""
        line = _alternative(found)
        if line.kind is not AlternativeKind.WAIT or all(a.digest != line.digest for a, _ in self._found):
            self._found.append((line, found))

    def bar(self, line: Alternative, commanded: Course) -> None:
        """Permissives alone refuse ``line``: it is told, once, where nothing that may be done costs as little."""
        cheapest = self.cheapest
        new = all(a.digest != line.digest for a, _ in (*self._barred, *self._found))
        if new and (cheapest is None or line.cost.total < cheapest.cost.total):
            self._barred.append((line, commanded))

    def refuse(self, found: Choice, reason: str) -> None:
        """The release check or the guard refused what was ``found``, for this ``reason``."""
        self._found = [(replace(a, refused=reason) if other is found else a, other) for a, other in self._found]

    @property
    def refused(self) -> frozenset[str]:
        """Digests of what the release check or the guard refused."""
        return frozenset(a.digest for a, _ in self._found if not a.admitted)

    def uncertified(self, rest: ActionSet) -> list[Course]:
        """What is commanded under each that has no certificate, those given first, what is barred last.

        ``rest`` goes on meanwhile.
        """
        given = [commanded or Course(rest) for a, commanded in self._given if a.certificate is None]
        barred = (commanded for a, commanded in self._barred if a.certificate is None)
        return [*given, *(course(found, rest) for a, found in self._found if a.certificate is None), *barred]

    def certify(self, certificates: Sequence[Certificate | None]) -> None:
        """The certificates of what was :meth:`uncertified`, in the same order."""
        new = iter(certificates)
        self._given = [(_certified(a, new), commanded) for a, commanded in self._given]
        self._found = [(_certified(a, new), found) for a, found in self._found]
        self._barred = [(_certified(a, new), commanded) for a, commanded in self._barred]

    def event(self, chosen: str) -> Compared:
        """The list, the cheapest first; ``chosen`` is the digest of what is done, empty where nothing is."""
        every = sorted((a for a, _ in (*self._given, *self._found, *self._barred)), key=lambda a: a.cost.total)
        return Compared(self.currency, tuple(every), chosen)


def digest_of(found: Choice | None) -> str:
    """What stands for a choice in the event; empty for none."""
    return "" if found is None else _alternative(found).digest


def told(found: Choice) -> str:
    """A choice in words: ``hold normal > holding for 60 s by language``."""
    return _alternative(found).told


def _certified(alternative: Alternative, new: Iterator[Certificate | None]) -> Alternative:
    """The alternative with the next of the ``new`` certificates, unless it has one."""
    return alternative if alternative.certificate is not None else replace(alternative, certificate=next(new))


def _alternative(found: Choice) -> Alternative:
    """The line of one choice in the list."""
    match found:
        case Waiting():
            told = found.follows, found.cost, "", found.proposer, found.digest, False, found.seconds
            return Alternative(AlternativeKind.WAIT, *told)
        case Testing():
            probe = found.admitted.probe
            name = probe.actions.target if probe.path is None else " > ".join(probe.path.states)
            digest = probe.actions.digest
            return Alternative(AlternativeKind.TEST, name, found.cost, "", found.proposer, digest, False, found.seconds)
        case Approved():
            kind = AlternativeKind.HOLD if found.for_s else AlternativeKind.RELEASE
            path, digest = " > ".join(found.path.states), found.actions.digest
            return Alternative(kind, path, found.cost, "", found.proposer, digest, found.polished, found.for_s)
