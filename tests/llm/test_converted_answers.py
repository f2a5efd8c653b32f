"""Records in the form of the published ones become files of calls, and are said again where they were given.

``test_published_answers`` claims the same of the published records themselves, which are not part of this project.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

from benchmarks.published_answers.__main__ import converted, main, write
from benchmarks.published_answers.measure import replayed
from benchmarks.published_answers.mixing import CASE
from benchmarks.published_answers.runs import PublishedRun
from homeostat.agents.language.answers import MOST_REASONING
from homeostat.llm.calls import read_calls
from homeostat.llm.model import Failure
from homeostat.llm.replay import SUPPLIED, SituatedReplay
from homeostat.plants.plant import load_plant
from tests.llm.asking import ask, question
from tests.llm.published_records import (
    ACTS,
    COOLED,
    CORRECTED,
    PLANS,
    REACTOR,
    RIGHT,
    ROWS,
    STUCK,
    campaigns,
    written,
)


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("records"), campaigns())


@pytest.fixture(scope="module")
def runs(records: Path) -> dict[str, PublishedRun]:
    return {str(run.path.with_suffix("")): run for run in converted(records)}


def agents(run: PublishedRun) -> Counter[str]:
    return Counter(call.agent for call in run.calls if call.served != SUPPLIED)


def test_every_answer_is_in_one_run(runs: dict[str, PublishedRun]) -> None:
    assert set(runs) == {RIGHT, CORRECTED, STUCK, COOLED}
    found = sum((agents(run) for run in runs.values()), Counter[str]())
    made = campaigns()
    plans_of_rows = 8 + 1  # rows of the stuck run repeat its plan: only its actuators were asked for again
    assert found == {
        "planning": len(made[PLANS]) + plans_of_rows,
        "action": len(made[ACTS]) + len(made[ROWS]) + len(made[REACTOR]),
    }


def test_a_run_of_a_right_model_asks_each_agent_once_per_state(runs: dict[str, PublishedRun]) -> None:
    run = runs[RIGHT]
    assert run.complete and run.success and agents(run) == {"planning": 7, "action": 7}
    states = [call.prompt.splitlines()[0] for call in run.calls if call.agent == "planning"]
    assert states[3] == "State filling_B203 (" and states[7] == "State emptying_B204 ("
    assert [call.served for call in run.calls[-2:]] == [SUPPLIED, SUPPLIED]
    assert json.loads(run.calls[6].answer or "")["path"] == "bypass_emptying_B201"


def test_refused_attempts_follow_each_other(runs: dict[str, PublishedRun]) -> None:
    stuck, corrected = runs[STUCK], runs[CORRECTED]
    assert stuck.complete and not stuck.success and agents(stuck) == {"planning": 1, "action": 6}
    assert corrected.success and agents(corrected) == {"planning": 8, "action": 8}


def test_answers_have_our_names_and_are_within_what_may_be_said(runs: dict[str, PublishedRun]) -> None:
    machines = {plant: load_plant(plant).description.machine for plant in (CASE, "cstr")}
    for run in runs.values():
        states = {s.name for s in machines[run.case].states}
        tags = {r.tag for s in machines[run.case].states for r in s.setpoints}
        for call in run.calls:
            said = json.loads(call.answer or "")
            assert len(said["reasoning"]) <= MOST_REASONING
            if call.agent == "planning":
                assert set(said["path"].split(" > ")) <= states
            else:
                assert said["commands"].keys() <= tags
                assert call.prompt.splitlines()[1].removeprefix("# Commands in state ").removesuffix(" (") in states


def test_an_answer_is_given_in_its_state_and_for_its_target_only(runs: dict[str, PublishedRun]) -> None:
    """The plan that was wrong in a state is followed there by the right one, and nowhere else by anything."""
    model = SituatedReplay("f", runs[CORRECTED].calls)
    here, later = (f"State {name} (x) at 70 s." for name in ("filling_B203", "bypass_emptying_B201"))

    def says(agent: str, prompt: str) -> object:
        outcome = ask(model, about=question(agent=agent, prompt=prompt))
        return json.loads(outcome.reply.answer) if outcome.reply else outcome.failure

    plans = [says("planning", prompt) for prompt in (later, here, here, here)]
    paths = [plan["path"] if isinstance(plan, dict) else plan for plan in plans]
    assert paths == ["bypass_emptying_B202", "emptying_B201", "bypass_emptying_B201", Failure.EXHAUSTED]
    right = says("action", f"{here}\n# Commands in state bypass_emptying_B201 (x)")
    assert isinstance(right, dict)
    assert {tag for tag, value in right["commands"].items() if value} == {"VO201.cmd", "VI204.cmd", "P102.cmd"}
    assert says("action", f"{here}\n# Commands in state filling_B201 (x)") is Failure.EXHAUSTED


def test_setpoints_lead_to_the_state_in_which_they_are_possible(runs: dict[str, PublishedRun]) -> None:
    """Less feed needs the state in which the feed is free; the feed as it was, the one in which it is fixed."""
    said = [json.loads(call.answer or "") for call in runs[COOLED].calls]
    assert [s["path"] for s in said[::2]] == ["normal > reduced_load", "normal > compensated"]
    assert said[1]["commands"] == {"T1.sp": 310.0, "L1.sp": 10.0, "F1.sp": 0.0285, "V2.man": None}
    assert said[3]["commands"] == {"T1.sp": 310.0, "L1.sp": 10.0, "V2.man": None}


@pytest.mark.parametrize(("name", "torn"), [(ACTS, RIGHT), (ROWS, STUCK), (REACTOR, COOLED)])
def test_a_run_of_which_an_answer_is_missing_has_no_file(tmp_path: Path, name: str, torn: str) -> None:
    made = campaigns()
    found = converted(written(tmp_path, {**made, name: made[name][:-1]}))
    assert [str(run.path.with_suffix("")) for run in found if not run.complete] == [torn]
    paths = write(found, tmp_path / "out")
    assert len(paths) == 3 and not (tmp_path / "out" / f"{torn}.jsonl").exists()


def test_files_are_written_and_read_as_calls(
    tmp_path: Path, records: Path, runs: dict[str, PublishedRun], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--records", str(records), "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "2026-01/gpt-4o-mini/mixing_module-pump_failure: 1 of 10 runs" in told
    assert "2026-08/gpt-4o-mini/cstr-cool_stuck_closed: 1 of 10 runs" in told
    for run in runs.values():
        assert read_calls(tmp_path / run.path) == run.calls


@pytest.mark.slow
@pytest.mark.parametrize(("name", "success"), [(RIGHT, True), (STUCK, False)])
def test_a_right_model_completes_the_batch_alone_and_a_wrong_one_does_not(
    runs: dict[str, PublishedRun], name: str, success: bool
) -> None:
    found = replayed(runs[name])
    assert (found.success, found.run.success) == (success, success)
    if success:
        assert found.said == found.recorded == 14 and not found.why
    else:
        assert found.actor != "language" and "idle > filling_B201: " in found.why
