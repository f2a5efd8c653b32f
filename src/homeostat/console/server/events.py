"""Answers on what happened: alarms, journal, verification, and files to take away."""

from __future__ import annotations

import csv
import io
import threading
from collections.abc import AsyncIterator, Iterable, Iterator
from typing import final

from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from homeostat.console.events.alarms import MOST, AlarmList, alarm_list, as_csv, cell
from homeostat.console.events.lines import Verified, journal_page, verified
from homeostat.console.opened import OpenedRun
from homeostat.console.readings import Readings
from homeostat.console.reports.reports import Busy, Last, NotReported, Reports
from homeostat.console.server.asked import csv_answer, json_answer, measured, number, span
from homeostat.console.server.desk import body
from homeostat.console.server.lanes import Gone, Lanes
from homeostat.journal.beside.files import JOURNAL

_WORDS = 200
_ROWS = 2000


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    last: Last
    at_s: float = Field(ge=0.0, le=999_999_999.0, allow_inf_nan=False)


@final
class Events:
    """What happened in one run."""

    def __init__(self, run: OpenedRun, lanes: Lanes) -> None:
        """Nothing was asked yet; answers are made in ``lanes``."""
        self._run, self._lanes = run, lanes
        self._verifying = threading.Lock()
        self._verified: tuple[int, Verified] | None = None
        self._reports = Reports(run)

    def routes(self) -> list[Route]:
        """What is answered here."""
        answers = {"alarms": self.alarms, "alarms.csv": self.alarms_csv, "journal": self.journal,
                   "verified": self.verified, "readings.csv": self.readings_csv}  # fmt: skip
        found = [Route(f"/api/{name}", answer, methods=["GET"]) for name, answer in answers.items()]
        return [*found, Route("/api/report", self.report, methods=["POST"])]

    async def alarms(self, request: Request) -> Response:
        """Alarms in their states at one moment."""
        return json_answer(await self._lanes.make(request, self._alarms, number(request, "at", self._run.last_s)))

    async def alarms_csv(self, request: Request) -> Response:
        """All of them as a file."""
        found = await self._lanes.make(request, self._alarms, number(request, "at", self._run.last_s), None)
        every = sorted((*found.standing, *found.shelved, *found.past), key=lambda alarm: alarm.raised_s)
        return csv_answer(as_csv(every), "alarms.csv")

    async def journal(self, request: Request) -> Response:
        """Lines of the journal."""
        asked = request.query_params
        before = number(request, "before", 0.0)
        kinds = frozenset(kind[:_WORDS] for kind in asked.getlist("kind"))
        what = kinds, asked.get("words", "")[:_WORDS], int(before) if before >= 1.0 else None
        return json_answer(await self._lanes.make(request, journal_page, self._run.run_dir, *what))

    async def verified(self, request: Request) -> Response:
        """What the verification of the journal says; it is made again where the journal has grown."""
        return json_answer(await self._lanes.make(request, self._verify))

    async def readings_csv(self, request: Request) -> Response:
        """Every reading of some tags in a span as a file."""
        readings, tags = measured(request, self._run)
        from_s, to_s, _ = span(request, self._run)
        part = readings.between(from_s, to_s)

        async def pieces() -> AsyncIterator[str]:  # each is made once the one before was taken
            yield _csv([("time_s", *(cell(tag) for tag in tags))])
            for begin in range(part.start, part.stop, _ROWS):
                rows = _rows(readings, tags, slice(begin, min(begin + _ROWS, part.stop)))
                try:
                    yield await self._lanes.make(request, _csv, rows)
                except Gone:
                    return

        return csv_answer(pieces(), "readings.csv")

    async def report(self, request: Request) -> Response:
        """A report of the last hours or days, which costs more than what is asked for without the page."""
        asked = await body(request, _Asked)
        try:
            return json_answer(await run_in_threadpool(self._reports.make, asked.last, asked.at_s))
        except NotReported as error:
            return json_answer({"error": str(error)}, 429 if isinstance(error, Busy) else 400)

    def _alarms(self, at_s: float, most: int | None = MOST) -> AlarmList:
        return alarm_list(self._run.until(at_s), at_s, most)

    def _verify(self) -> Verified:
        with self._verifying:  # one at a time: it reads everything
            size = (self._run.run_dir / JOURNAL).stat().st_size
            if self._verified is None or self._verified[0] != size:
                self._verified = size, verified(self._run.run_dir)
            return self._verified[1]


def _csv(rows: Iterable[Iterable[object]]) -> str:
    out = io.StringIO()
    csv.writer(out).writerows(rows)
    return out.getvalue()


def _rows(readings: Readings, tags: tuple[str, ...], part: slice) -> Iterator[list[object]]:
    """Time and readings of each moment; nothing where there is none."""
    columns = [readings.signals[tag][part].tolist() for tag in tags]
    for at_s, *row in zip(readings.times_s[part].tolist(), *columns, strict=True):
        yield [at_s, *("" if value != value else value for value in row)]
