"""Runs of a plant in a folder of its own: resumed and replayed with that plant, wherever its name is known as well."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from homeostat.cli.commands.orders import _plant as shown_to_who_decides
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.recorded.run import run_started
from homeostat.evaluate.scenario import scenario
from homeostat.journal import RunStarted, Setting, read_events
from homeostat.knowledge.build.build import GRAPH, build
from homeostat.plants.plant import load_plant
from homeostat.record.directory import RunDirectory
from tests.cli.command import Done, homeostat, refused
from tests.plants.copies import Copy

RUN = ("--fault", "cool_stuck_closed", "--onset", "400", "--end", "420", "--thinking-declared", "1", "--out", "run")
OWN = "Cooling valve of our own stuck towards closed"


def made(where: Path, name: str) -> Done:
    """A run in ``where`` of a plant in the folder ``name`` there, which has words of its own."""
    plant = Copy.of("cstr", where)
    plant.replace("engineering/faults.csv", "Cooling valve stuck towards closed", OWN)
    if name != "cstr":
        plant.folder.rename(where / name)
    return homeostat("run", f"./{name}", *RUN, cwd=where)


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Done:
    return made(tmp_path_factory.mktemp("own"), "mycstr")


@pytest.fixture
def copy(own: Done, tmp_path: Path) -> Path:
    """A copy of the run, beside which there is no plant."""
    shutil.copytree(own.cwd / "run", tmp_path / "run")
    return tmp_path


def killed(run: Path, lines: int) -> None:
    """Leave what is there of a run that dies after so many lines."""
    for name in ("manifest.json", "result.json"):
        (run / name).unlink()
    journal = run / "events.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:lines]))


def renamed(folder: Path, old: str, new: str) -> None:
    """Change a word of the plant in ``folder``: it is configured differently."""
    faults = folder / "engineering/faults.csv"
    text = faults.read_text(encoding="utf-8")
    assert old in text
    faults.write_text(text.replace(old, new), encoding="utf-8")


def test_it_is_replayed_with_the_plant_in_its_folder(own: Done, copy: Path) -> None:
    again = homeostat("replay", "run", cwd=own.cwd)
    assert (again.status, again.out, again.err) == (0, own.out, "") and OWN in again.out
    elsewhere = homeostat("replay", "run", cwd=copy)
    assert (elsewhere.status, elsewhere.out, elsewhere.err) == (0, own.out, "")


def test_a_folder_with_the_name_of_an_installed_plant_is_not_taken_for_it(tmp_path: Path) -> None:
    first = made(tmp_path, "cstr")
    again = homeostat("replay", "run", cwd=tmp_path)
    assert (again.status, again.out, again.err) == (0, first.out, "") and OWN in again.out
    killed(tmp_path / "run", 5)
    done = homeostat("resume", "run", cwd=tmp_path)
    assert done.status == first.status and OWN in done.out


def test_killed_it_goes_on_with_the_plant_in_its_folder(own: Done, copy: Path) -> None:
    killed(copy / "run", 5)
    done = homeostat("resume", "run", "--json", cwd=copy)
    first = json.loads((own.cwd / "run/result.json").read_text())
    again = json.loads(done.out)
    assert done.status == own.status
    for name in ("case", "fault", "outcome", "detected_s", "state"):
        assert again[name] == first[name], name


def test_a_plant_that_has_moved_is_named(copy: Path, own: Done) -> None:
    moved = copy / "moved"
    (own.cwd / "mycstr").rename(moved)
    try:
        killed_run = copy / "killed"
        shutil.copytree(copy / "run", killed_run)
        killed(killed_run, 5)
        refused(homeostat("resume", "killed", cwd=copy), "'mycstr'", str(own.cwd / "mycstr"), "--case")
        bare = homeostat("replay", "run", cwd=copy)
        assert bare.status == 0 and bare.err.count("\n") == 1 and "--case" in bare.err
        assert len(bare.out.splitlines()) == len(own.out.splitlines()), "it is told, with the names of the record"
        assert OWN not in bare.out and "cool_stuck_closed" in bare.out
        for given in ("moved", "./moved", str(moved)):
            told = homeostat("replay", "run", "--case", given, cwd=copy)
            assert (told.status, told.out, told.err) == (0, own.out, "")
        done = homeostat("resume", "killed", "--case", "moved", cwd=copy)
        assert done.status == own.status and OWN in done.out
    finally:
        moved.rename(own.cwd / "mycstr")


def test_a_plant_that_has_changed_is_refused_by_both_configurations(own: Done, copy: Path) -> None:
    changed = copy / "changed"
    shutil.copytree(own.cwd / "mycstr", changed)
    renamed(changed, OWN, "Another valve")
    load_plant(str(changed))  # what follows from the tables is made again, and said, once
    first = json.loads((copy / "run/events.jsonl").read_text().splitlines()[0])
    digest = next(s["value"] for s in first["configuration"] if s["name"] == "configuration")
    refused(homeostat("replay", "run", "--case", "changed", cwd=copy), str(changed), digest[:12], "--case")
    killed(copy / "run", 5)
    refused(homeostat("resume", "run", "--case", "changed", cwd=copy), str(changed), digest[:12], "--case")
    refused(homeostat("resume", "run", "--case", "cstr", cwd=copy), "/cstr'", "'mycstr'", digest[:12], "--case")


def test_a_journal_that_nobody_vouches_for_has_no_code_loaded(own: Done, copy: Path) -> None:
    (own.cwd / "mycstr/process.py").rename(own.cwd / "mycstr/kept")
    evil = own.cwd / "mycstr/process.py"
    try:
        evil.write_text("raise SystemExit('code of a stranger')\n")
        killed(copy / "run", 1)  # before anything was signed
        told = homeostat("replay", "run", cwd=copy)
        assert told.status == 1 and "nobody vouches" in told.err and "stranger" not in told.err
    finally:
        evil.unlink()
        (own.cwd / "mycstr/kept").rename(evil)


def strangers(where: Path, case: str) -> Path:
    """A plant with code that says that it is run, in ``where``, and a run of ``case`` whose journal nobody signed."""
    plant = Copy.of("cstr", where)
    plant.replace("case.toml", "homeostat.plants.cstr.process:REACTOR", "process:REACTOR")
    (plant.folder / "process.py").write_text(f"open({str(where / 'ran')!r}, 'w').close()\n")
    started = RunStarted(case, (), 1, (Setting("end_s", 10.0),))
    with RunDirectory(where / "run") as directory:
        directory.record(started, 0.0)
    journal = where / "run/events.jsonl"
    journal.write_bytes(journal.read_bytes().splitlines(keepends=True)[0])  # before anything was signed
    return where / "run"


@pytest.mark.parametrize("case", ["{here}/cstr", "./cstr", "cstr", "mine"])
def test_a_stranger_who_calls_a_plant_by_a_path_has_no_code_loaded(tmp_path: Path, case: str) -> None:
    """Nor has a folder that is called as an installed plant, or as none, where somebody stands."""
    run = strangers(tmp_path, case.format(here=tmp_path))
    (tmp_path / "cstr").rename(tmp_path / ("mine" if case == "mine" else "cstr"))
    told = homeostat("replay", str(run), cwd=tmp_path)
    assert told.status == 1 and "Traceback" not in told.err and not (tmp_path / "ran").exists(), told.err
    assert ("nobody vouches" in told.err) == (case != "cstr")
    assert f"{case.format(here=tmp_path)}, no fault, seed 1" in told.out


def test_who_decides_is_shown_the_plant_of_the_run(tmp_path: Path) -> None:
    """And not the installed one of the same name: its words and units may be others."""
    plant = Copy.of("cstr", tmp_path)
    plant.replace("engineering/limits.csv", "Highest reactor temperature", "Highest temperature of our own")
    (plant.folder / GRAPH).write_bytes(build(plant.folder))
    own = plant.load()
    started = run_started(own, scenario(own, "none", 1), Thinking(), "search", (), None)
    with RunDirectory(tmp_path / "run") as directory:
        directory.record(started, 0.0)
    shown = shown_to_who_decides(tuple(read_events(tmp_path / "run")), tmp_path / "run")
    assert shown is not None and "Highest temperature of our own" in {
        limit.description for limit in shown.limits.limits
    }
    assert shown_to_who_decides((), tmp_path / "run") is None
