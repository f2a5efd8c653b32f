"""Reading a source, once per tick: one that raises, blocks or has lost its clock leaves the guard without a sample."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from numbers import Real
from typing import TypeVar

from homeostat.domain.ports import Source
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.texts import said
from homeostat.guard.writing.lane import Call, Lane, NoAnswer
from homeostat.process.batch import ProcessError

ANSWER_S = 0.5
"""Longest that a tick waits for a source that may block, wall-clock [s]."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _Look:
    """What a source has said, and what it raised instead."""

    sample: Snapshot | None = None
    now_s: float | None = None
    troubles: tuple[tuple[str, str], ...] = ()


class Reader:
    """Goes on by one tick whatever the source does; its troubles are told once, and again when they are over."""

    def __init__(
        self,
        source: Source,
        raised: Callable[[str, str], None],
        returned: Callable[[str], None],
        answer_s: float = ANSWER_S,
    ) -> None:
        """``raised`` and ``returned``: an alarm's identifier, and what it is about, when it begins and when it ends.

        ``answer_s``: longest wait for a source that may block, wall-clock [s].
        """
        self._source, self._raised, self._returned = source, raised, returned
        self._lane = None if getattr(source, "never_blocks", False) else Lane("the source", answer_s)
        self._late: Call[_Look] | None = None
        self._wrong: set[str] = set()
        self._told_s, self._now_s = math.nan, 0.0

    @property
    def ended(self) -> bool:
        """Whether there is no further tick; one that does not say so has not ended."""
        if self._late is not None:
            return False
        try:
            ended = bool(self._ask(lambda: self._source.ended))
        except BaseException as broken:  # a link may break in any way
            self._settle("source:end", f"the source does not say whether it has ended: {said(broken)}")
            return False
        self._settle("source:end")
        return ended

    def read(self, tick_s: float) -> tuple[float, Snapshot | None]:
        """Process time [s] and the sample of the next tick, ``tick_s`` later [s]; None where none came.

        A source that does not say what time it is leaves the loop to its own clock. Raises ProcessError where a
        simulated plant leaves the physical world.
        """
        look = self._look()
        wrong = dict(look.troubles)
        for name in ("source", "source:clock"):
            self._settle(name, wrong.get(name, ""))
        stands = "source" in wrong and look.now_s == self._told_s  # it did not go on, so its clock says nothing
        if look.now_s is None or stands:
            self._now_s += tick_s
            return self._now_s, look.sample
        self._told_s = look.now_s
        try:
            self._now_s = look.now_s if math.isfinite(look.now_s) else self._now_s + tick_s
        except TypeError:  # no number at all; the guard says so
            self._now_s += tick_s
        return look.now_s, look.sample

    def _look(self) -> _Look:
        """What the source says now, or what it was asked for before and says too late."""
        if self._lane is None:
            return _looked(self._source)
        try:
            self._lane.wait()  # for an earlier tick's look, or for whether it has ended
            self._late = self._late or self._lane.begin(partial(_looked, self._source))
            look = self._late.result()
        except NoAnswer as late:
            return _Look(troubles=(("source", str(late)),))
        except ProcessError:
            self._late = None
            raise
        except Exception as broken:  # what nobody could say in the thread of the source
            self._late = None
            return _Look(troubles=(("source", f"the source gives no sample: {said(broken)}"),))
        self._late = None
        return look

    def _ask(self, question: Callable[[], T]) -> T:
        return question() if self._lane is None else self._lane.ask(question)

    def _settle(self, name: str, cause: str = "") -> None:
        """Tell that alarm ``name`` begins or ends, where it does."""
        if cause and name not in self._wrong:
            self._wrong.add(name)
            self._raised(name, cause)
        elif not cause and name in self._wrong:
            self._wrong.remove(name)
            self._returned(name)


def _looked(source: Source) -> _Look:
    """Advance ``source`` by one tick, and read its clock."""
    sample, now_s, troubles = None, None, []
    try:
        sample = _own(source.advance())
    except ProcessError:
        raise  # there is no plant any more
    except BaseException as broken:  # whatever a link raises, the guard decides without a sample
        troubles.append(("source", f"the source gives no sample: {said(broken)}"))
    try:
        now_s = source.now_s
    except BaseException as broken:
        troubles.append(("source:clock", f"the source does not say what time it is: {said(broken)}"))
    return _Look(sample, now_s, tuple(troubles))


def _own(sample: Snapshot | None) -> Snapshot | None:
    """``sample`` with values of its own, which are numbers: whoever thinks reads them later, and a link may go on.

    What is no sample at all stays as it is: the guard says so.
    """
    try:
        return None if sample is None else replace(sample, values={t: _number(v) for t, v in sample.values.items()})
    except Exception:
        return sample


def _number(value: object) -> float:
    """``value`` as a float; NaN where it is none, or is too large for one."""
    if type(value) is float:  # nearly always
        return value
    try:
        return float(value) if isinstance(value, Real) else math.nan
    except OverflowError:
        return math.nan
