"""Where states have been that no instrument shows: only the past says it, so the model is followed through it.

A replay begins where the readings say that the plant was. An inhibitor in a digester or a heel of solvent is in no
reading: taken to be where a run begins, it would begin anew in every replay, and what a fault has done to it for hours
would be given to another name. So it is carried on from stretch to stretch, as what is believed to be wrong moves it;
what instruments show is read anew at the beginning of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, final

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel, column
from homeostat.process.types import Vec
from homeostat.twin.carried import Carrier
from homeostat.twin.history import History, Window
from homeostat.twin.replay import replay

ROWS: Final = 20
"""Readings in a stretch of which only the beginning is read; what instruments show has no time to go astray."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where such states were at one moment."""

    at_s: float
    values: Vec
    """In the order of their names, shape (states,)."""


@final
class UnseenStates:
    """Follows them; what it hands out does not change afterwards."""

    def __init__(self, model: ProcessModel, carrier: Carrier, corrected: tuple[str, ...]) -> None:
        """``corrected``: variables whose readings say where a stretch begins."""
        self._model, self._carrier, self._corrected = model, carrier, corrected
        self._columns = [column(model.states, name) for name in model.unseen]
        self._course: tuple[_Place, ...] = ()
        self._known: tuple[FaultState, ...] = ()

    def follow(self, history: History, parameters: Vec) -> None:
        """Go on with the last readings of ``history``, where a stretch of them is complete."""
        if not self._columns:
            return
        now, rows = history.window(1), history.length - 1
        if self._course:
            rows = min(rows, round((now.end_s - self._course[-1].at_s) / now.tick_s))
        if rows >= ROWS:
            stretch = history.window(rows + 1)
            self._show(history, self._walked(stretch, parameters, self._course or (self._first(stretch),)))

    def believe(self, known: Sequence[FaultState], history: History, parameters: Vec) -> None:
        """From now on ``known`` is taken to be wrong, and to have been since it began; nothing where it is empty.

        What is over has moved them as long as it was there.
        """
        before, self._known = self._known, tuple(known)
        if not self._columns or not known or self._known == before:
            return
        whole, since_s = history.whole, min(fault.onset_s for fault in known)
        course = [place for place in self._course if place.at_s >= whole.start_s]
        again = tuple(place for place in course if place.at_s <= since_s) or tuple(course[:1])
        for place in course[len(again) :]:
            stretch = whole.part(whole.row(again[-1].at_s), whole.row(place.at_s) + 1)
            again = self._walked(stretch, parameters, again)
        self._show(history, again)

    def _first(self, stretch: Window) -> _Place:
        taken = self._model.estimate(stretch.beginning)
        return _Place(stretch.start_s, taken[self._columns])

    def _walked(self, stretch: Window, parameters: Vec, course: tuple[_Place, ...]) -> tuple[_Place, ...]:
        """``course`` and where they are at the end of ``stretch``; where the model has no answer, they stay."""
        begun = replace(stretch, unseen=dict(zip(self._model.unseen, course[-1].values.tolist(), strict=True)))
        present = [fault for fault in self._known if fault.onset_s < stretch.end_s]
        carried = self._carrier.carry([tuple(present)], stretch)
        try:
            found = replay(self._model, begun, parameters[None], carried, self._corrected).state[0, self._columns]
        except ProcessError:
            found = course[-1].values
        state = np.where(np.isfinite(found), found, course[-1].values)
        return (*course, _Place(stretch.end_s, state))

    def _show(self, history: History, course: tuple[_Place, ...]) -> None:
        """Keep what is of the time that ``history`` holds, and let its windows begin with it."""
        old = sum(place.at_s <= history.begin_s for place in course[:-1])
        self._course = course[max(old - 1, 0) :]
        if self._course:
            at_s, values = (np.array(each) for each in zip(*((p.at_s, p.values) for p in self._course), strict=True))
            history.tell(self._model.unseen, at_s, values)
