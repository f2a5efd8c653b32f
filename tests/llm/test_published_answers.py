"""The published models' answers as files of calls: complete, in our names, and each said again where it was given.

The records are not part of this project: without them ``test_converted_answers`` claims the same of made ones.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

from benchmarks.mixing_calls import FOLDER
from benchmarks.published_answers.__main__ import converted, main, write
from benchmarks.published_answers.mixing import CASE
from benchmarks.published_answers.reactor import setpoint, target
from benchmarks.published_answers.runs import PublishedRun, lines, model_name
from homeostat.agents.language.answers import MOST_REASONING
from homeostat.llm.calls import Call, read_calls
from homeostat.llm.model import Failure
from homeostat.llm.replay import SUPPLIED, SituatedReplay
from homeostat.plants.plant import load_plant
from tests.llm.asking import ask, question
from tests.llm.published_records import RIGHT, STUCK, campaigns, written

RECORDED = pytest.mark.reference(
    "the recorded answers of others' models (test_converted_answers has made ones)", FOLDER
)
NAMES = ("mixer_planning_calls", "mixer_action_calls", "mixer_jan2026_rows", "cstr_calls")


@pytest.fixture(scope="module")
def runs() -> list[PublishedRun]:
    return converted(FOLDER)


def of(runs: list[PublishedRun], path: str) -> PublishedRun:
    return next(run for run in runs if str(run.path) == f"{path}.jsonl")


def agents(run: PublishedRun) -> Counter[str]:
    return Counter(call.agent for call in run.calls if call.served != SUPPLIED)


def copied(folder: Path, without: str, number: int) -> Path:
    """The records, ``number`` lines at the end of the file ``without`` left out."""
    for name in NAMES:
        text = (FOLDER / f"{name}.jsonl").read_text("utf-8").splitlines(keepends=True)
        kept = text[:-number] if name == without else text
        (folder / f"{name}.jsonl").write_text("".join(kept), "utf-8")
    return folder


@RECORDED
def test_every_recorded_answer_is_in_one_run(runs: list[PublishedRun]) -> None:
    """Rows of January that repeat a plan because only its actuators were asked for again are no further plan."""
    found: Counter[tuple[str, str, str]] = Counter()
    for run in runs:
        for agent, count in agents(run).items():
            found[run.campaign, run.case, agent] += count
    records = {name: lines(FOLDER / f"{name}.jsonl") for name in NAMES}
    rows = [r for r in records["mixer_jan2026_rows"] if not r["duplicate_of_previous_row"]]
    first = {(r["model"], r["fault"], r["run"], r["iteration"], r["planning_time_s"]) for r in rows}
    assert found == {
        ("2026-08", CASE, "planning"): len(records["mixer_planning_calls"]),
        ("2026-08", CASE, "action"): len(records["mixer_action_calls"]),
        ("2026-01", CASE, "planning"): len(first), ("2026-01", CASE, "action"): len(rows),
        ("2026-08", "cstr", "action"): len(records["cstr_calls"]),
    }  # fmt: skip


@RECORDED
def test_a_run_of_a_right_model_asks_each_agent_once_per_state(runs: list[PublishedRun]) -> None:
    run = of(runs, "2026-01/gpt-4.1-mini/mixing_module-pump_failure-3")
    assert run.complete and run.success and agents(run) == {"planning": 7, "action": 7}
    states = [call.prompt.splitlines()[0] for call in run.calls if call.agent == "planning"]
    assert states[3] == "State filling_B203 (" and states[7] == "State emptying_B204 ("
    assert [call.served for call in run.calls[-2:]] == [SUPPLIED, SUPPLIED]
    assert json.loads(run.calls[6].answer or "")["path"] == "bypass_emptying_B201"


@RECORDED
def test_refused_attempts_follow_each_other(runs: list[PublishedRun]) -> None:
    """Six times wrong actuators of one right plan; and a wrong plan, after which both agents are asked again."""
    stuck = of(runs, "2026-01/gpt-4o-mini/mixing_module-pump_degradation-1")
    assert stuck.complete and not stuck.success and agents(stuck) == {"planning": 1, "action": 6}
    again = of(runs, "2026-01/gpt-4o-mini/mixing_module-pump_failure-1")
    assert agents(again) == {"planning": 8, "action": 8}


@RECORDED
def test_answers_have_our_names_and_are_within_what_may_be_said(runs: list[PublishedRun]) -> None:
    machines = {plant: load_plant(plant).description.machine for plant in (CASE, "cstr")}
    for run in runs:
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


@RECORDED
def test_an_answer_is_given_in_its_state_and_for_its_target_only(runs: list[PublishedRun]) -> None:
    """The plan that was wrong in a state is followed there by the right one, and nowhere else by anything."""
    model = SituatedReplay("f", of(runs, "2026-01/gpt-4o-mini/mixing_module-pump_failure-1").calls)
    here, later = (f"State {name} (x) at 70 s." for name in ("filling_B203", "bypass_emptying_B201"))

    def says(agent: str, prompt: str) -> object:
        outcome = ask(model, about=question(agent=agent, prompt=prompt))
        return json.loads(outcome.reply.answer) if outcome.reply else outcome.failure

    plans = [says("planning", prompt) for prompt in (later, here, here, here)]
    paths = [plan["path"] if isinstance(plan, dict) else plan for plan in plans]
    assert paths == ["bypass_emptying_B202", "emptying_B201", "bypass_emptying_B201", Failure.EXHAUSTED]
    right = says("action", f"{here}\n# Commands in state bypass_emptying_B201 (x)")
    assert isinstance(right, dict) and {t for t, v in right["commands"].items() if v} == {
        "VO201.cmd", "VI204.cmd", "P102.cmd"
    }  # fmt: skip
    assert says("action", f"{here}\n# Commands in state filling_B201 (x)") is Failure.EXHAUSTED


@RECORDED
@pytest.mark.parametrize("name", ["mixer_jan2026_rows", "mixer_action_calls", "cstr_calls"])
def test_a_run_of_which_an_answer_is_missing_has_no_file(tmp_path: Path, name: str) -> None:
    folder = copied(tmp_path, name, 1)
    found = [run for run in converted(folder) if not run.complete]
    dropped = name == "cstr_calls"  # its last record is a run with one answer, which is not there at all then
    assert len(found) == (0 if dropped else 1)
    paths = write(converted(folder), tmp_path / "out")
    assert len(paths) == 149 and not any((tmp_path / "out" / run.path).exists() for run in found)


@RECORDED
def test_files_are_written_and_read_as_calls(
    tmp_path: Path, runs: list[PublishedRun], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--records", str(FOLDER), "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "2026-01/gpt-4o-mini/mixing_module-leak: 5 of 10 runs" in told
    assert "2026-08/gpt-4o-mini/cstr-fouling: 10 of 10 runs" in told
    for run in runs:
        assert read_calls(tmp_path / run.path) == run.calls
        assert all(isinstance(call, Call) for call in run.calls)


def test_without_records_it_says_what_to_give(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--records", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "give their folder" in capsys.readouterr().err


def test_a_run_goes_by_the_model_that_answered() -> None:
    assert model_name("gpt-4.1-mini", "gpt-4.1-mini-2025-04-14") == "gpt-4.1-mini"
    assert model_name("gpt-4.1-mini", "gpt-4o-mini-2024-07-18") == "gpt-4o-mini-as-gpt-4.1-mini"


def test_setpoints_are_whole_increments_and_lead_where_they_are_possible() -> None:
    assert [setpoint("F1.sp", 0.0283333333, False), setpoint("T1.sp", 309.95, False)] == [0.0285, 309.9]
    assert setpoint("L1.sp", 10.5, False) == 10.5 and setpoint("F1.sp", 0.0283333333, True) == 0.0283333333
    assert target({"Fin_sp": 0.0283}, {"Fin_sp": 1 / 30}) == "reduced_load"
    assert target({"Fin_sp": 0.03333333333}, {"Fin_sp": 1 / 30}) == "compensated"


def said(run: PublishedRun) -> list[tuple[str, str, bool, dict[str, object]]]:
    """Who said what in which state, reasoning aside."""
    answers = [json.loads(call.answer or "") for call in run.calls]
    return [
        (call.agent, call.prompt, call.served == SUPPLIED, {k: v for k, v in answer.items() if k != "reasoning"})
        for call, answer in zip(run.calls, answers, strict=True)
    ]


@RECORDED
@pytest.mark.parametrize(("model", "made"), [("gpt-4.1-mini", RIGHT), ("gpt-4o-mini", STUCK)])
def test_the_batches_that_are_said_again_elsewhere_are_recorded_ones(
    tmp_path: Path, runs: list[PublishedRun], model: str, made: str
) -> None:
    """``test_converted_answers`` says them on the whole loop: a right one completes the batch, a wrong one does not."""
    recorded = of(runs, f"2026-01/{model}/mixing_module-pump_degradation-1")
    stand_in = of(converted(written(tmp_path, campaigns())), made)
    assert said(recorded) == said(stand_in) and recorded.success == stand_in.success == (made == RIGHT)
