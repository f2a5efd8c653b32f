"""A study of a plant in a folder of one's own: named by its path, run here and in other processes, gone on with."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import homeostat as hs
from homeostat.evaluate.study.engine import measured
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.ledger import DATASET, read_dataset
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.evaluate.study.study import PROVENANCE
from homeostat.journal import read_events
from homeostat.record.row import Row
from tests.cli.campaigns import prints
from tests.cli.command import Done, homeostat, homeostat_process, refused
from tests.plants.copies import Copy

STUDY = """
title = "Of our own"
keep = "all"
proposers = [{ who = "do-nothing", cases = ["../my_reactor"] }, "fallback-only"]

[[scenarios]]
case = "../my_reactor"
fault = "cool_stuck_closed"
onset_s = 10.0
end_s = 30.0

[[scenarios]]
case = "mixing_module"
end_s = 30.0
"""
"""Three jobs: two of the plant in the folder, one of an installed plant."""
OLD, NEW = "Cooling valve stuck towards closed", "Cooling valve of ours stuck towards closed"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a plant and, in another folder, a study of it."""
    home = tmp_path / "home"
    home.mkdir()
    Copy.of("cstr", home).folder.rename(home / "my_reactor")
    (home / "studies").mkdir()
    (home / "studies/own.toml").write_text(STUDY)
    return home


def carried_out(place: Path, *options: str) -> Done:
    """The study, asked for from a folder that is neither the plant's nor the study's."""
    done = homeostat("campaign", str(place / "studies/own.toml"), "--workers", "1", "--out", "out", *options, cwd=place)
    assert done.status == 0, done.err
    return done


def rows(place: Path) -> list[Row]:
    return read_dataset(place / "out" / DATASET)


def copied(rows: Sequence[Row]) -> list[tuple[str, str, str, float]]:
    return [(row.case, row.proposer, row.outcome, row.least_margin) for row in rows]


@pytest.mark.slow
def test_it_is_run_recorded_and_gone_on_with(place: Path, tmp_path: Path) -> None:
    carried_out(place)
    made = rows(place)
    assert [(row.case, row.proposer) for row in made] == [
        ("my_reactor", "do-nothing"), ("my_reactor", "fallback-only"), ("mixing_module", "fallback-only"),
    ]  # fmt: skip
    plant = hs.load_plant(str(place / "my_reactor"))
    content = json.loads((place / "out" / PROVENANCE).read_text())
    where = {"folder": str(place / "my_reactor"), "configuration": plant.configuration}
    assert content["own_plants"] == {"my_reactor": where}
    started = next(iter(read_events(place / "out" / made[0].trace)))
    stated = {setting["name"]: setting["value"] for setting in started.fields["configuration"]}
    assert stated["plant folder"] == str(place / "my_reactor")
    told = homeostat("replay", made[0].trace, cwd=place / "out")
    assert told.status == 0 and told.err == ""

    before = prints(place / "out")
    carried_out(place)
    assert prints(place / "out") == before, "nothing was to be done"
    moved = tmp_path / "moved"
    place.rename(moved)
    carried_out(moved)
    assert prints(moved / "out") == before, "the same plant elsewhere is the same plant"
    Copy(moved / "my_reactor").replace("engineering/faults.csv", OLD, NEW)
    carried_out(moved)
    again = prints(moved / "out")
    assert again[:3] == before and len(again) == 5, "only the plant that was changed is run again"


@pytest.mark.wide
def test_two_processes_and_one_give_the_same_rows(place: Path) -> None:
    carried_out(place)
    command = ("campaign", "studies/own.toml", "--workers", "2", "--out", "two")
    done = homeostat_process(*command, cwd=place)
    assert done.status == 0, done.err
    assert copied(read_dataset(place / "two" / DATASET)) == copied(rows(place))


def test_what_is_to_be_run_is_listed_and_one_of_it_run(place: Path) -> None:
    listed = carried_out(place, "--list").out.split()
    assert [name.split("~")[0] for name in listed] == ["my_reactor", "my_reactor", "mixing_module"]
    again = carried_out(place, "--only", listed[0])
    assert again.out.startswith(f"{listed[0]}: ")


@pytest.mark.parametrize("absolute", [True, False])
def test_an_installed_plant_may_be_named_by_its_folder(place: Path, absolute: bool) -> None:
    folder = Path(hs.__file__).parent / "plants/cstr"
    if not absolute:
        (place / "linked").symlink_to(folder)
    text = f'title = "x"\n[[scenarios]]\ncase = "{folder if absolute else "./linked"}"\n[[scenarios]]\ncase = "cstr"\n'
    text += 'name = "again"\n'
    (place / "x.toml").write_text(text)
    assert [(job.scenario.case, job.own) for job in hs.Study(place / "x.toml").jobs] == [("cstr", None)] * 2


BAD = {
    "no folder": ("./nowhere", ("there is no folder", "/nowhere'", "correct the path", "installed: cstr")),
    "an absolute path": ("/no/such/plant", ("'/no/such/plant'", "there is no folder")),
    "no plant's folder": ("./empty", ("/empty'", "has no case.toml")),
    "a file": ("./own.toml", ("own.toml' is a file", "give the folder")),
    "a folder without a stroke": ("my_reactor", ("unknown plant 'my_reactor'", "installed: cstr", "by its path")),
    "no path at all": ("./a\\u0000b", ("unknown plant",)),
}


@pytest.mark.parametrize(("case", "words"), BAD.values(), ids=BAD)
def test_what_is_no_plant_is_refused_in_one_line(place: Path, case: str, words: tuple[str, ...]) -> None:
    (place / "studies/empty").mkdir()
    (place / "studies/own.toml").write_text(f'title = "Bad"\n[[scenarios]]\ncase = "{case}"\n')
    refused(homeostat("campaign", "studies/own.toml", cwd=place), *words)
    (place / "studies/own.toml").write_text(STUDY.replace('cases = ["../my_reactor"]', f'cases = ["{case}"]'))
    refused(homeostat("campaign", "studies/own.toml", "--list", cwd=place), *words)
    assert sorted(path.name for path in place.iterdir()) == ["my_reactor", "studies"]
    with pytest.raises(StudyError):
        hs.Study(place / "studies/own.toml")


def test_a_plant_that_cannot_be_used_is_refused_with_its_folder(place: Path) -> None:
    Copy(place / "my_reactor").replace("engineering/limits.csv", "T1 <= 313", "T11 <= 313")
    refused(homeostat("campaign", "studies/own.toml", cwd=place), str(place / "my_reactor"), "T11")


def test_two_plants_of_one_name_are_refused(place: Path) -> None:
    (place / "other").mkdir()
    Copy.of("cstr", place / "other")
    text = 'title = "x"\n[[scenarios]]\ncase = "cstr"\n[[scenarios]]\ncase = "./other/cstr"\nname = "y"\n'
    (place / "x.toml").write_text(text)
    refused(homeostat("campaign", "x.toml", cwd=place), "two plants are called 'cstr'", "/other/cstr'", "rename")


def test_a_plant_that_was_changed_is_seen_at_the_next_study_and_refused_in_the_old_one(place: Path) -> None:
    first = hs.Study(place / "studies/own.toml")
    Copy(place / "my_reactor").replace("engineering/faults.csv", OLD, NEW)
    second = hs.Study(place / "studies/own.toml")
    assert first.jobs[0].fingerprint != second.jobs[0].fingerprint
    assert [job.fingerprint for job in first.jobs[2:]] == [job.fingerprint for job in second.jobs[2:]]
    done = measured(first.jobs[0], KeptRuns(None))
    assert done.row is None and "was changed since the study began; start the study again" in done.failure
    (place / "my_reactor").rename(place / "gone")
    done = measured(replace(second.jobs[0]), KeptRuns(None))
    assert done.row is None and "there is no folder" in done.failure and "\n" not in done.failure
