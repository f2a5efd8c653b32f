"""What `import homeostat` gives: few names, loaded when they are asked for, enough for a whole run."""

from __future__ import annotations

import pydoc
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import homeostat as hs
from homeostat.cli.main import main
from homeostat.domain.mode import Mode
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import ScenarioError, scenario
from homeostat.evaluate.study.error import StudyError
from homeostat.journal.verify.verify import verify
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.error import PlantError
from homeostat.record.events import EVENTS
from homeostat.record.result import read_result
from homeostat.stl.formula import FormulaError

QUICK = Path(__file__).parents[1] / "campaigns" / "quick.toml"


@pytest.fixture(scope="module")
def run() -> hs.Run:
    fault = hs.Fault("pump_degrade", severity=0.5, onset_s=2000.0)
    return hs.run(hs.load_plant("cstr"), fault=fault, seed=1, end_s=2300.0, thinking=hs.declared(1.0))


def test_it_has_few_names_and_every_one_is_there() -> None:
    assert 10 <= len(hs.__all__) <= 15
    for name in hs.__all__:
        assert getattr(hs, name).__doc__, name
        assert f"\n    {name} " in (hs.__doc__ or ""), "the page that help() shows names it"
    with pytest.raises(AttributeError, match="has no name 'Plan'; it has Fault, "):
        _ = hs.Plan
    assert "load_plant   " in pydoc.plain(pydoc.render_doc(hs))


def test_importing_it_loads_no_library() -> None:
    code = "import homeostat, sys; print([m for m in ('numpy', 'numba', 'pydantic', 'lark') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_a_run_says_what_it_came_to(run: hs.Run) -> None:
    assert run.outcome is hs.Outcome.RECOVERED and run.good and run.actor == "search"
    assert run.detected_s is not None and run.released_s is not None
    assert 2000.0 < run.detected_s < run.released_s < 2300.0
    (fault,) = run.record.faults
    assert (fault.fault, fault.severity, fault.onset_s) == ("pump_degrade", 0.5, 2000.0)
    (started,), (finished,) = run.events(hs.events.RunStarted), run.events(hs.events.RunFinished)
    assert started.faults == ("pump_degrade",) and finished.outcome == "recovered"
    assert run.events(hs.events.ReleasedActions)[0].proposer == "search"
    assert all(hasattr(hs.events, event.__name__) for event in EVENTS)


def test_what_is_saved_verifies_and_is_told_again(
    run: hs.Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = run.save(tmp_path / "kept")
    assert verify(folder).complete
    result = read_result(folder)
    assert result is not None and result.outcome is run.outcome and result.detected_s == run.detected_s
    assert {"figure.png", "trajectory.parquet", "queries"} <= {path.name for path in folder.iterdir()}
    assert main(["replay", str(folder)]) == 0
    assert "Recovered: the plant produces inside its hard limits." in capsys.readouterr().out
    with pytest.raises(ValueError, match="is not empty; choose another directory"):
        run.save(folder)


def test_the_figure_is_a_picture(run: hs.Run, tmp_path: Path) -> None:
    assert run.figure(tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_faults_are_given_by_name_or_together() -> None:
    plant = hs.load_plant("cstr")
    both = [hs.Fault("pump_degrade", onset_s=2.0), hs.Fault("cool_stuck_closed", severity=0.3, onset_s=1.0)]
    run = hs.run(plant, both, end_s=3.0, thinking=hs.declared(0.0))
    assert run.scenario.fault == "pump_degrade+cool_stuck_closed" and run.scenario.onset_s == 1.0
    assert hs.run(plant, "pump_degrade", end_s=2001.0, seed=2, thinking=hs.declared(0.0)).scenario.onset_s == 2000.0
    with pytest.raises(ScenarioError, match="names a fault twice"):
        hs.run(plant, [both[0], both[0]], end_s=3.0)
    with pytest.raises(ScenarioError, match=r"severity 3 .* must lie in"):
        hs.run(plant, hs.Fault("pump_degrade", severity=3.0, onset_s=1.0), end_s=3.0)


def test_a_supervisor_for_a_plant_of_ones_own_is_one_call() -> None:
    plant = hs.load_plant("cstr")
    for mode, writes in ((Mode.CLOSED_LOOP, True), (Mode.OBSERVE, False)):
        link = SimulatedLink(open_process(plant, scenario(plant, "none", 1, end_s=400.0)))
        supervisor = hs.Supervisor(plant, link, mode, clock=DeclaredClock(1.0))
        supervisor.run()
        assert link.now_s == 400.0 and bool(link.wire_log) is writes


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"fault": None}, "fault None is none"),
        ({"fault": ["pump_degrade", 3]}, "is none; give a name"),
        ({"fault": hs.Fault(3)}, "fault 3 must be a name, as the plant's tables have it"),  # type: ignore[arg-type]
        ({"seed": 1.5}, "seed 1.5 must be a whole number"),
        ({"end_s": "2600"}, "end_s '2600' must be a number"),
        ({"fault": hs.Fault("leak", severity="big")}, "severity 'big' must be a number"),  # type: ignore[arg-type]
        ({"thinking": 1.0}, "thinking 1.0 says not how long it takes; give homeostat.declared"),
    ],
)
def test_what_no_run_can_be_made_of_is_one_line(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(message)) as refused:
        hs.run("cstr", **wrong)
    assert "\n" not in str(refused.value)


def test_a_plant_and_faults_may_be_given_by_name() -> None:
    run = hs.run("cstr", ["leak", "fouling"], end_s=2001.0, thinking=hs.declared(0.0))
    assert run.scenario.fault == "leak+fouling"


def test_a_supervisor_refuses_what_it_could_only_wait_for() -> None:
    plant = hs.load_plant("cstr")
    link = SimulatedLink(open_process(plant, scenario(plant, "none", 1, end_s=3.0)))
    with pytest.raises(TypeError, match="link's source None has no 'now_s'"):
        hs.Supervisor(plant, SimpleNamespace(source=None, take=1, beat=1, give_back=1))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="has no 'source'"):
        hs.Supervisor(plant, object())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="is not a valid Mode"):
        hs.Supervisor(plant, link, "closed loop")  # type: ignore[arg-type]
    for pace in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="pace"):
            hs.Supervisor(plant, link).run(pace)


@pytest.mark.parametrize("cost", [-1.0, float("nan")])
def test_a_time_that_thinking_cannot_take_is_refused_at_once(cost: float) -> None:
    with pytest.raises(ValueError, match="must be finite"):
        hs.declared(cost)


def test_a_study_is_read_from_its_file() -> None:
    study = hs.Study(QUICK)
    assert study.title and len({job.name for job in study.jobs}) == len(study.jobs) > 1


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("nothing.toml", "'nothing.toml' cannot be used: No such file or directory; give the file of a study"),
        (Path("."), "'.' cannot be used: Is a directory"),
        ("a\0b", "'a\\x00b'"),
    ],
)
def test_a_study_that_is_not_there_is_refused_in_one_line(file: Path | str, message: str) -> None:
    with pytest.raises(StudyError, match=re.escape(message)) as refused:
        hs.Study(file)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hs.Study(3), "file 3 must be a path, as 'campaigns/quick.toml'"),  # type: ignore[arg-type]
        (lambda: hs.load_plant(3), "plant 3 must be a text: "),  # type: ignore[arg-type]
        (lambda: hs.run(None), "plant None must be a text: "),  # type: ignore[arg-type]
        (lambda: hs.declared("1"), "process_s '1' must be a number of seconds, as 1.0"),  # type: ignore[arg-type]
    ],
)
def test_what_is_of_another_type_is_refused_in_one_line(call: Callable[[], object], message: str) -> None:
    with pytest.raises(TypeError, match=re.escape(message)) as refused:
        call()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("wrong", [3, None, b"T1 <= 313", ["T1 <= 313"]])
def test_a_formula_that_is_no_text_is_refused_in_one_line(wrong: Any) -> None:
    with pytest.raises(FormulaError, match=rf"formula {re.escape(repr(wrong))} must be a text, as 'T1 <= 313'"):
        hs.formula(wrong)


@pytest.mark.parametrize("wrong", ["Attempted", 3, None])
def test_events_of_what_is_no_type_are_refused_in_one_line(run: hs.Run, wrong: Any) -> None:
    with pytest.raises(TypeError, match=rf"kind {wrong!r} must be a type of events, as homeostat.events.Diagnosed"):
        run.events(wrong)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("my_reactor", ("unknown plant 'my_reactor'", "installed: cstr", "a folder is named by its path")),
        ("own", ("own/case.toml: 'title' is missing",)),
        ("ctsr", ("unknown plant 'ctsr'; did you mean 'cstr'?", "installed: cstr, mixing_module, tennessee_eastman")),
        ("./nowhere", ("unknown plant './nowhere': there is no folder '", "/nowhere'; correct the path", "installed:")),
        ("./empty", ("unknown plant './empty': the folder '", "/empty' has no case.toml; give the folder of a plant")),
        ("./own/case.toml", ("'./own/case.toml'", "is a file; give the folder that it is in")),
        ("./odd", ("unknown plant './odd': case.toml in the folder '", "/odd' is no file; give the folder of a plant")),
        ("./" + "x" * 5000, ("unknown plant './xxx", "xxx... cannot be used: File name too long; correct the path")),
        ("x" * 5000, ("unknown plant 'xxx", "xxx...", "tennessee_eastman; a folder is named by its path")),
    ],
)
def test_a_plant_that_is_not_there_is_refused_with_the_remedy(
    name: str, words: Sequence[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("own", "empty"):
        (tmp_path / folder).mkdir()
    (tmp_path / "own/case.toml").write_text("")
    (tmp_path / "odd/case.toml").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PlantError) as refused:
        hs.load_plant(name)
    assert "\n" not in str(refused.value)
    for word in words:
        assert word in str(refused.value)
    assert main(["run", name]) == 2
    assert capsys.readouterr().err == f"homeostat: {refused.value}\n"


def test_a_formula_has_a_margin() -> None:
    assert hs.formula("T1 <= 313").margins({"T1": np.array([310.5, 315.0])}, dt_s=1.0).tolist() == [[2.5, -2.0]]
