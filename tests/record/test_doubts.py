"""Doubts and what is foreseen, from the event to the operator's line, to the result and back."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultState, Hypothesis, Symptom
from homeostat.domain.events.foresight import Foreseen, Reached
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import Doubted, FaultsEnded, NoActionTaken, ReleasedActions, SymptomsCleared
from homeostat.domain.observation import Trouble
from homeostat.domain.outcome import Outcome
from homeostat.journal import Event
from homeostat.plants.plant import load_plant
from homeostat.record.decode import decode
from homeostat.record.foretold import Foretold, foretold
from homeostat.record.result import Result, read_result
from homeostat.record.story.story import Story
from homeostat.service.thinking.codec import Recorded, from_thinking, to_guard
from tests.record.test_decode import recorded

PLANT = load_plant("cstr").description
COLD = Symptom("S-COLD", 1955.0, -0.6, 0.55, 1.1)
LIKELY = (
    Hypothesis((), 0.6),
    Hypothesis((FaultState("fouling", 0.2, 1900.0),), 0.34),
    Hypothesis((FaultState(SOMETHING_ELSE, 1.0, 1900.0),), 0.06),
)
DOUBTED = Doubted((COLD,), LIKELY, explained=False)


def foreseen(earliest_s: float, limit: str = "LIM-T-HIGH", digest: str = "", from_s: float = 2000.0) -> Foreseen:
    times = (earliest_s, earliest_s + 50.0, earliest_s + 100.0)
    soft = Reached("ACC-SOFT", 3, 0.5, earliest_s - 10.0, earliest_s, earliest_s)
    first = Reached("", 9, 0.7, *times)
    return Foreseen(digest, from_s, 900.0, 12, first=first, reached=(soft, Reached(limit, 9, 0.7, *times)))


CLEAR = Foreseen("", 2000.0, 900.0, 12)


@pytest.mark.parametrize("event", [DOUBTED, Doubted((), LIKELY, True), SymptomsCleared(("S-COLD", "S-HOT"), 2100.0)])
def test_what_was_recorded_is_read_back_also_from_thinking_in_another_process(tmp_path: Path, event: Event) -> None:
    assert decode(recorded(tmp_path / "run", event)) == event
    assert from_thinking(to_guard(Recorded(event, 5.0)), PLANT.machine) == Recorded(event, 5.0)


@pytest.mark.parametrize("priority", list(Priority))
def test_how_urgent_it_is_travels_with_what_a_person_is_called_for(priority: Priority) -> None:
    assert from_thinking(to_guard(said := Trouble("recovery:x", "why", priority)), PLANT.machine) == said


def test_a_message_that_is_older_than_priorities_is_urgent() -> None:
    frame = json.dumps({"message": "Trouble", "fields": {"name": "recovery:x", "cause": "why"}}).encode()
    assert from_thinking(frame, PLANT.machine) == Trouble("recovery:x", "why", Priority.HIGH)


# --- the story ---------------------------------------------------------------------------------------------------


def told(*events: tuple[Event, float]) -> list[str]:
    story = Story(PLANT)
    return [str(line) for event, at_s in events for line in story.tell(event, at_s)]


def test_an_operator_reads_which_symptom_it_is_and_what_it_may_be() -> None:
    (line,) = told((DOUBTED, 1955.0))
    assert line == (
        "   1955 s  may be    60 % nothing is wrong; 34 % fouling 0.2; 6 % something else, "
        "because Temperature below its setpoint (S-COLD, 1.1 times its threshold)"
    )


def test_what_is_measured_and_explains_it_is_told_so() -> None:
    sure = (Hypothesis((), 0.94), Hypothesis((FaultState(SOMETHING_ELSE, 1.0, 1900.0),), 0.06))
    (line,) = told((Doubted((COLD,), sure, explained=True), 1955.0))
    assert "may be    explained without a fault (94 % nothing is wrong; 6 % something else): Temperature" in line


def test_that_it_may_come_back_is_said_after_it_has_ended() -> None:
    ended = FaultsEnded((FaultState("fouling", 0.2, 1900.0),), 2400.0)
    lines = told((ended, 2450.0), (Doubted((), LIKELY[:2], explained=False), 2450.0))
    assert lines[-1].endswith("may be    it may come back: 60 % nothing is wrong; 34 % fouling 0.2")


def test_the_alarm_has_a_line_with_how_urgent_it_is() -> None:
    (line,) = told((AlarmRaised("recovery:unexplained", "nothing explains S-COLD", Priority.LOW), 1985.0))
    assert line.endswith("alarm     recovery:unexplained (low): nothing explains S-COLD")


def test_the_time_to_a_hard_limit_is_told_once_and_again_where_it_is_half_as_long() -> None:
    lines = told(
        (foreseen(300.0), 2000.0), (foreseen(280.0), 2030.0), (foreseen(160.0), 2060.0), (CLEAR, 2090.0),
        (foreseen(140.0), 2120.0), (foreseen(70.0, "LIM-L-HIGH"), 2150.0), (foreseen(10.0, digest="d"), 2160.0),
    )  # fmt: skip
    assert lines == [
        "   2000 s  foreseen  LIM-T-HIGH trips in 300 to 400 s if nothing is done, in 9 of 12 members (70 %)",
        "   2120 s  foreseen  LIM-T-HIGH trips in 140 to 240 s if nothing is done, in 9 of 12 members (70 %)",
        "   2150 s  foreseen  LIM-L-HIGH trips in 70 to 170 s if nothing is done, in 9 of 12 members (70 %)",
    ]


@pytest.mark.parametrize(("probability", "shown"), [(0.003, "less than 1"), (0.997, "more than 99"), (1.0, "100")])
def test_what_trips_in_one_member_is_not_told_with_none_of_the_probability(probability: float, shown: str) -> None:
    event = foreseen(300.0)
    assert event.first is not None
    (line,) = told((replace(event, first=replace(event.first, probability=probability)), 2000.0))
    assert line.endswith(f"in 9 of 12 members ({shown} %)")


def test_after_a_release_the_time_is_told_anew() -> None:
    """What was released for a fault that grows no longer suffices."""
    released = ReleasedActions("search", (), "d", "reduced", 0.1)
    lines = told((foreseen(300.0), 2000.0), (released, 2010.0), (foreseen(290.0), 2900.0))
    assert [line.split()[2] for line in lines] == ["foreseen", "released", "foreseen"]


# --- the result --------------------------------------------------------------------------------------------------


def test_the_result_has_what_was_foreseen_last_before_anything_was_done() -> None:
    every = [(2000.0, foreseen(300.0)), (2060.0, foreseen(160.0, from_s=2060.0)), (2900.0, foreseen(20.0, "LIM-L-LOW"))]
    assert foretold(every, 2070.0, PLANT) == Foretold("LIM-T-HIGH", 2060.0, 2220.0, 2270.0, 2320.0, 0.7)
    assert foretold([(2000.0, CLEAR), (2001.0, foreseen(5.0, digest="d"))], None, PLANT) is None
    last = foretold(every, None, PLANT)
    assert last is not None and last.limit == "LIM-L-LOW"


RESULT = Result(
    "cstr", "none", 1, Outcome.NO_ACTION, "none", None, None, None, 0, (), (), None, (), None, "normal", None, None,
    {}, None, 0.0, 0.0, "run",
)  # fmt: skip


@pytest.mark.parametrize("what", [None, Foretold("LIM-T-HIGH", 2060.0, 2220.0, 2270.0, 2320.0, 0.7)])
def test_the_result_is_read_back(tmp_path: Path, what: Foretold | None) -> None:
    (tmp_path / "result.json").write_text(replace(RESULT, foreseen=what).to_json())
    found = read_result(tmp_path)
    assert found is not None and found.foreseen == what


def test_a_result_that_is_older_has_nothing_foreseen(tmp_path: Path) -> None:
    content = json.loads(RESULT.to_json())
    del content["foreseen"]
    (tmp_path / "result.json").write_text(json.dumps(content))
    found = read_result(tmp_path)
    assert found is not None and found.foreseen is None and not math.isnan(found.wall_s)


def test_symptoms_that_have_cleared_need_no_line() -> None:
    assert told((SymptomsCleared(("S-COLD",), 2100.0), 2160.0)) == []
    assert told((NoActionTaken("normal", 0.1), 2160.0)) != []
