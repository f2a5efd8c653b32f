"""What is waited for: recovery only as long as it thinks, and then what comes next."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.opened import OpenedRun
from homeostat.console.overview import overview
from homeostat.console.situation import situation
from homeostat.console.view import seen
from homeostat.domain.events.guard import RequestAnswered, ThinkingEnded
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import Concluded, NoActionTaken, Noticed, Probed, ReleasedActions
from homeostat.journal import Event
from homeostat.journal.memory import Entry
from homeostat.plants.plant import load_plant

ENDS = (NoActionTaken, Concluded, ReleasedActions)
THINKS = "recovery: it is working on an answer"
NOTICED = Noticed(("T1-HIGH",))


def waited_for(*events: Event, at_s: float = 1.0) -> str:
    """What the line says at ``at_s`` [s] after ``events``, all of them at 0 s."""
    now = situation(Entry(0.0, event) for event in events)
    return overview(now, None, load_plant("cstr").description, at_s).waiting


@pytest.mark.parametrize(
    "ends",
    [
        Concluded("nothing is known that was not known before"),
        NoActionTaken("normal", 0.5),
        RequestAnswered("r1", "search", "d1", "advised"),
        ModeEntered("observe", "ada"),
        ThinkingEnded(7, "killed"),
    ],
    ids=lambda event: type(event).kind,
)
def test_recovery_is_waited_for_until_it_has_answered(ends: Event) -> None:
    assert waited_for(NOTICED) == THINKS
    assert waited_for(NOTICED, ends) == "nothing: the plant is watched"
    assert waited_for(NOTICED, ends, NOTICED) == THINKS, "and again, once it notices something"


def test_where_the_plant_is_only_looked_at_that_is_said_until_it_is_over() -> None:
    look = Probed(("a", "b"), "", (), 30.0, 2.0, 0.1, 0.0)
    assert waited_for(NOTICED, look, at_s=29.0) == "what the plant shows until 30 s, which tells explanations apart"
    assert waited_for(NOTICED, look, at_s=31.0) == "nothing: the plant is watched"
    assert waited_for(NOTICED, look, NOTICED, at_s=29.0) == THINKS


def test_no_thought_of_a_run_goes_on_after_its_end(left_alone_run: Path, recovered: OpenedRun) -> None:
    ends = 0
    for run in (opened(left_alone_run, None), recovered):
        for entry in run.entries:
            now = seen(run, entry.at_s).overview
            assert now is not None
            last = [e.event for e in run.entries if e.at_s <= entry.at_s and isinstance(e.event, (*ENDS, Noticed))]
            if last and isinstance(last[-1], ENDS):
                assert now.waiting != THINKS, entry
                ends += 1
    assert ends > 2
