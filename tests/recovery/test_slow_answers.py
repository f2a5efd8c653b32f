"""Where thinking costs what is declared nothing is late: an answer is cut off where it hangs, and nothing else is."""

from __future__ import annotations

import asyncio
import time

from homeostat.domain.events.recovery import Attempted, GaveUp
from homeostat.domain.recovery import ActionSet
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.exchange.exchange import Exchange
from tests.agents.scripted import ScriptedAction
from tests.recovery.line import BAD, GOOD
from tests.recovery.rivals import HANGS_S, SAVING, asked, by, doomed, proposer
from tests.recovery.test_exchange import Run


def declared(*answers: ActionSet, delay_s: float, first: ActionSet = BAD) -> object:
    slow = proposer("slow", ScriptedAction(*answers, delay_s=delay_s), attempts=len(answers))
    done = doomed(first, others=(slow,))
    done.desk.hang_s = HANGS_S
    done.desk.wall_s = lambda process_s: HANGS_S  # type: ignore[method-assign]
    return done.run()


def test_all_answers_together_may_take_longer_than_one() -> None:
    """Four answers, each of half the time after which one hangs."""
    done = declared(BAD, BAD, BAD, GOOD, delay_s=0.5 * HANGS_S)
    assert by(done) == [("slow", GOOD.digest)] and asked(done).count("slow") == 4  # type: ignore[arg-type]


def test_what_the_search_has_found_cuts_no_model_short() -> None:
    """Half of the time was kept for the release, of a time that nobody has to keep."""
    done = declared(GOOD, delay_s=0.7 * HANGS_S, first=SAVING)
    assert by(done) == [("slow", GOOD.digest)]  # type: ignore[arg-type]


def test_an_answer_that_hangs_is_cut_off_and_what_was_found_is_released() -> None:
    begun = time.monotonic()
    done = declared(GOOD, delay_s=100.0 * HANGS_S, first=SAVING)
    assert time.monotonic() - begun < 20.0 * HANGS_S
    assert by(done) == [("scripted", SAVING.digest)]  # type: ignore[arg-type]
    assert [e.proposer for e in done.trace.of(GaveUp)] == ["slow"] and len(done.trace.of(Attempted)) == 1  # type: ignore[attr-defined]


def test_who_looks_up_now_and_then_is_not_taken_to_hang() -> None:
    looks: list[float] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            for _ in range(5):
                await asyncio.sleep(0.2)
                looks.append((await desk.since(0.0))[-1].now_s)

        while (seen := await desk.next()) is not None:
            if seen.now_s == 5.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(1.0), busy_s=0.5)
    assert run.lost == [] and looks == [6.0] * 5
    assert Run(recovery, ThinkingClock(0.0), busy_s=0.5).lost, "where the time is measured, it is"
