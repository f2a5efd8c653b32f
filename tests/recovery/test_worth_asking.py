"""Worth asking: a proposer that takes its time is waited for where that costs little, and not where it costs much."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import pytest

from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Compared, GaveUp, NotAsked
from homeostat.domain.plant.prices import Price, PriceKind
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import DOOMED, SOFT, Recovery, ticks, watching
from tests.recovery.line import BAD, GOOD
from tests.recovery.rivals import HANGS_S, SAVING, asked, by, proposer

BURNING = (Price(PriceKind.CRITERION, "ACC-SOFT", 1080.0),)
"""Left alone the line misses its wish by more and more: in 100 s for some 60 EUR."""
ABLAZE = (Price(PriceKind.CRITERION, "ACC-SOFT", 10_800.0),)
"""Ten times as dear."""


def hurried(
    *answers: Any,
    rows: Sequence[Price] = BURNING,
    delay_s: float = 0.0,
    noticed: Sequence[float] = (10.0,),
    **more: Any,
) -> Recovery:
    """A line that is hot, for which SAVING is approved, and a second proposer with ``answers``."""
    second = proposer("second", ScriptedAction(*answers, delay_s=delay_s), attempts=4)
    return Recovery(
        ticks(1, 120, DOOMED), watching(*noticed), ScriptedAction(SAVING), limits=SOFT, rows=tuple(rows),
        others=(second,), **more,
    )  # fmt: skip


def test_waiting_costs_what_leaving_the_line_alone_costs_more_than_the_best_approved() -> None:
    done = hurried(BAD, BAD, GOOD, thinking=3).run()
    (ended,) = done.trace.of(NotAsked)
    lines = {a.kind: a.cost.total for a in done.trace.of(Compared)[0].alternatives}
    more = lines[AlternativeKind.LEAVE] - lines[AlternativeKind.RELEASE]
    assert ended.answer_s > 0.0 and ended.lost == pytest.approx(more * ended.answer_s / 100.0)
    assert ended.gain == pytest.approx(lines[AlternativeKind.RELEASE] - 0.27)


def test_who_answers_slowly_is_asked_once_and_no_more_where_waiting_is_dear() -> None:
    done = hurried(BAD, BAD, GOOD, thinking=3).run()
    assert asked(done).count("second") == 1 and [name for name, _ in by(done)] == ["scripted"]
    (ended,) = done.trace.of(NotAsked)
    assert ended.proposer == "second" and ended.lost > ended.gain > 0.0
    assert "is asked no further: an answer takes" in ended.reason and "EUR at most" in ended.reason
    assert not done.trace.of(GaveUp), "who was not asked has not given up"


def test_who_answers_at_once_is_asked_as_often_as_it_may_be() -> None:
    done = hurried(BAD, BAD, GOOD).run()
    assert [name for name, _ in by(done)] == ["second"] and not done.trace.of(NotAsked)


def test_who_answers_slowly_is_asked_again_where_waiting_costs_nothing() -> None:
    done = hurried(BAD, BAD, GOOD, rows=(), thinking=3).run()
    assert asked(done).count("second") == 3 and [name for name, _ in by(done)] == ["second"]
    assert not done.trace.of(NotAsked)


def test_how_long_it_takes_is_known_the_next_time() -> None:
    done = hurried(BAD, GOOD, thinking=3, noticed=(10.0, 80.0)).run()
    first, again = done.trace.of(NotAsked)
    assert asked(done).count("second") == 1, "not at all at the second look"
    assert again.answer_s == first.answer_s and [name for name, _ in by(done)] == ["scripted", "scripted"]


def test_an_answer_that_is_under_way_is_cut_where_it_can_win_less_than_was_lost() -> None:
    begun = time.monotonic()
    done = hurried(GOOD, rows=ABLAZE, delay_s=60.0).run()
    assert time.monotonic() - begun < 30.0 and [name for name, _ in by(done)] == ["scripted"]
    (ended,) = done.trace.of(NotAsked)
    assert ended.lost == pytest.approx(ended.gain) and 0.0 < ended.answer_s < 2.0


def test_where_thinking_costs_what_is_declared_nothing_but_a_hang_cuts_it() -> None:
    done = hurried(GOOD, rows=ABLAZE, delay_s=0.7 * HANGS_S)
    done.desk.hang_s = HANGS_S
    done.desk.wall_s = lambda process_s: HANGS_S  # type: ignore[method-assign]
    assert [name for name, _ in by(done.run())] == ["second"] and not done.trace.of(NotAsked)


def test_where_nothing_is_approved_whoever_is_slow_is_waited_for() -> None:
    done = hurried(BAD, BAD, GOOD, thinking=3)
    done.action._answers = (BAD,)  # type: ignore[attr-defined]
    assert [name for name, _ in by(done.run())] == ["second"]
