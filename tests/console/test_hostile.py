"""Whoever wrote names, notes and reasons of a run commands no browser and no card."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.diagnosis import FaultState, Hypothesis, Symptom
from homeostat.domain.events.guard import GuardStarted, QualityChanged, StateEntered
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import Diagnosed, GaveUp, Noticed, Remarked
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.recovery import Command
from homeostat.domain.remark import RemarkKind
from homeostat.journal import Journal, RunStarted
from tests.console.served import Served, served

MARKUP = "<img src=x onerror=\"document.title='taken'\"><script>document.title='taken'</script>"
ODD = "\u202e\u2028 \x1b[31m ]]> --> {{7*7}} ${1} &amp; '\""


def hostile_run(folder: Path) -> Path:
    """A run of a plant that nobody knows, in which every text is somebody's attempt."""
    text = MARKUP + ODD
    with Journal(folder) as journal:
        journal.record(RunStarted(text, (), 1), 0.0)
        journal.record(GuardStarted(text, "0", text, text, False), 1.0)
        journal.record(StateEntered(text), 2.0)
        journal.record(AlarmRaised(text, text, Priority.HIGH), 3.0)
        journal.record(QualityChanged(text, "bad", text), 3.0)
        journal.record(Noticed((text,)), 4.0)
        symptom, fault = Symptom(text, 4.0, 1e308, 1e-308, float("inf")), FaultState(text, float("nan"), 0.0)
        journal.record(Diagnosed((symptom,), (Hypothesis((fault,), 1.0),)), 4.0)
        journal.record(Remarked(text, text, RemarkKind.NOTE, text, text), 5.0)
        journal.record(GaveUp(text, text), 6.0)
        journal.record(FallbackActivated(text, (Command(text, 1.0, None),), text), 7.0)
    return folder


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(hostile_run(tmp_path_factory.mktemp("hostile"))) as server:
        yield server


def test_hostile_texts_stay_data(hostile: Served) -> None:
    told = hostile.ask("/api/run")
    assert told.status == 200 and told.headers["content-type"] == "application/json" and told.body.isascii()
    moment = hostile.ask("/api/moment?at=7")
    card = moment.json["card"]
    assert card["acted"][0]["strategy"] == card["seen"][0]["text"] == MARKUP + ODD
    assert json.loads(moment.body.decode())["overview"]["folded"][0]["cause"] == MARKUP + ODD
    assert MARKUP.encode() not in hostile.ask("/").body


def test_a_line_of_a_stream_cannot_be_forged(hostile: Served) -> None:
    (event,) = hostile.moments("/api/stream?at=7&speed=1", 1)
    assert set(event) == {"id", "data"} and json.loads(event["data"])["at_s"] == 7.0


def test_the_sources_of_the_page_make_no_markup_of_data() -> None:
    folder = Path(__file__).parents[2] / "web" / "src"
    for source in (*folder.glob("*.ts"), *folder.glob("*.tsx")):
        text = source.read_text(encoding="utf-8")
        assert not [w for w in ("innerHTML", "insertAdjacent", "document.write", "eval(", "new Function") if w in text]
