"""A scaffold is there as a whole or not at all, and every kind is a clean plant that recovers from a fault."""

from __future__ import annotations

import errno
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.checks import DEEP
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.links.clock import DeclaredClock
from homeostat.plants import scaffold
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import BASELINES, SETTINGS
from homeostat.plants.plant import load_plant
from homeostat.plants.scaffold import NAME, SCAFFOLDS, make_plant, scaffold_names
from homeostat.plants.teaching.learning import learned
from tests.cli.command import COMMAND, LIMIT_S, environment, homeostat, refused

FAULT = {"tanks": "H1_stuck_open", "reactor": "V1_stuck_open", "batch": "P1_stuck_closed"}
"""Kind of plant -> a fault that its search recovers from."""
MOST_LINES = 220
MOST_LINES_OF_TANKS = 150


def test_the_command_offers_every_scaffold(tmp_path: Path) -> None:
    assert scaffold_names() == tuple(sorted(FAULT))
    done = homeostat("plant", "new", "boiler", "--like", "kettle", cwd=tmp_path)
    assert done.status == 2 and all(name in done.err for name in FAULT) and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("like", FAULT)
def test_a_scaffold_is_short_and_called_after_its_folder(like: str, tmp_path: Path) -> None:
    done = homeostat("plant", "new", "boiler", "--like", like, cwd=tmp_path)
    folder = tmp_path / "boiler"
    texts = {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in folder.rglob("*.*")}
    assert done.status == 0 and "homeostat plant learn ./boiler" in done.out and f"{len(texts)} files" in done.out
    assert {SETTINGS, "process.py", "engineering/equipment.csv"} < texts.keys()
    assert "urn:homeostat:boiler#system" in texts[SETTINGS] and "\nboiler,System," in texts["engineering/equipment.csv"]
    assert not any("$" in text for text in texts.values())
    most = MOST_LINES_OF_TANKS if like == "tanks" else MOST_LINES
    assert sum(text.count("\n") for text in texts.values()) <= most
    assert re.search("^#.*Change first", texts[SETTINGS], re.MULTILINE) and "In this order: " in texts["process.py"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "like", ["tanks", *(pytest.param(other, marks=pytest.mark.wide) for other in ("batch", "reactor"))]
)
def test_a_scaffold_is_clean(like: str, tmp_path: Path) -> None:
    make_plant(tmp_path / "boiler", like)
    checked = check(str(tmp_path / "boiler"), DEEP)
    # As in most plants one instrument controls and judges, and what stands in its safe state is charged for that.
    usual = {"engineering/loops.csv", "engineering/criteria.csv"}
    assert checked.clean and {each.where.file for each in checked.findings} <= usual and len(checked.outlooks) >= 9


@pytest.mark.wide
@pytest.mark.parametrize("like", FAULT)
def test_a_scaffold_learns_and_recovers_from_a_fault_by_search(like: str, tmp_path: Path) -> None:
    """The page of the first plant does so with the first of them."""
    folder = tmp_path / "boiler"
    make_plant(folder, like)
    (folder / BASELINES).write_bytes(learned(load_plant(str(folder), learned=False)))
    plant = load_plant(str(folder))
    done = run(plant, scenario_of(plant, [Fault(FAULT[like])], seed=1), clock=DeclaredClock(1.0)).result(Path())
    assert done.outcome.value == "recovered" and done.released_s is not None
    assert sum(each.total_s for each in done.limit_exposure_s) == 0.0


@pytest.mark.wide
def test_a_plant_is_made_learned_and_run_as_the_command_says(tmp_path: Path) -> None:
    assert homeostat("plant", "new", "boiler", cwd=tmp_path).status == 0
    assert homeostat("plant", "learn", "boiler", cwd=tmp_path).status == 0
    done = homeostat(
        "run", "boiler", "--fault", "H1_stuck_open", "--end", "2000", "--thinking-declared", "1", cwd=tmp_path
    )
    assert done.status == 0 and "Recovered: " in done.out and "by search" in done.out


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("my-boiler", "a plant cannot be called 'my-boiler', as its folder is: a name has 1 to 40 letters"),
        ("2nd", "a plant cannot be called '2nd'"),
        ("kessel_ü", "a plant cannot be called 'kessel_ü'"),
        ("b" * 41, "a name has 1 to 40 letters"),
        ("cstr", "there is a plant called 'cstr' already"),
        ("B1", "the scaffold calls something 'B1' itself"),
        ("no/boiler", "there is no folder 'no'; make it first"),
    ],
)
def test_a_name_that_cannot_be_is_one_line_and_leaves_nothing(name: str, words: str, tmp_path: Path) -> None:
    refused(homeostat("plant", "new", name, cwd=tmp_path), words)
    assert list(tmp_path.iterdir()) == []


@given(name=st.text(min_size=1, max_size=50).filter(lambda text: "/" not in text and "\0" not in text))
@example(name="..")
@example(name="boiler\n")
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
def test_any_name_is_a_plants_or_refused(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "any" / "where"
    folder.mkdir(parents=True, exist_ok=True)
    if NAME.fullmatch(name) or name == ".":
        return
    with pytest.raises((PlantError, OSError)):
        make_plant(folder / name, "tanks")
    assert list(folder.iterdir()) == [] and list(folder.parent.iterdir()) == [folder]


def test_what_is_there_already_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "boiler").mkdir()
    (tmp_path / "boiler" / "notes.txt").write_text("mine", "utf-8")
    (tmp_path / "kettle").write_text("a file", "utf-8")
    refused(homeostat("plant", "new", "boiler", cwd=tmp_path), "is not empty: it holds 'notes.txt'; name a folder")
    refused(homeostat("plant", "new", "kettle", cwd=tmp_path), "is no folder; name one that is new or empty")
    assert [path.name for path in (tmp_path / "boiler").iterdir()] == ["notes.txt"]
    assert (tmp_path / "kettle").read_text("utf-8") == "a file"


def test_an_empty_folder_is_taken_also_the_one_that_one_stands_in(tmp_path: Path) -> None:
    (tmp_path / "boiler").mkdir()
    assert homeostat("plant", "new", ".", cwd=tmp_path / "boiler").status == 0
    assert homeostat("plant", "show", ".", "--table", "loops", cwd=tmp_path / "boiler").status == 0
    assert {path.name for path in (tmp_path / "boiler").iterdir()} == {SETTINGS, "process.py", "engineering"}


@pytest.mark.parametrize("existed", [False, True], ids=["new folder", "empty folder"])
@pytest.mark.parametrize("files", [0, 3, 14])
def test_nothing_is_left_behind_when_the_disk_is_full(
    existed: bool, files: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, written = tmp_path / "boiler", list[Path]()
    if existed:
        folder.mkdir()

    def full(path: Path, content: bytes) -> None:
        if len(written) == files:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        written.append(path)
        path.write_bytes(content)

    monkeypatch.setattr(scaffold, "write_whole", full)
    refused(homeostat("plant", "new", "boiler", cwd=tmp_path), "No space left on device")
    assert [path.name for path in tmp_path.iterdir()] == ["boiler"] * existed
    assert not existed or list(folder.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="needs limits on file size")
def test_a_file_that_finds_no_room_takes_the_others_with_it(tmp_path: Path) -> None:
    done = subprocess.run(
        ["bash", "-c", 'ulimit -f 1; exec "$@"', "bash", *COMMAND, "plant", "new", "boiler"],
        cwd=tmp_path, env=environment(), capture_output=True, encoding="utf-8", timeout=LIMIT_S,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1) and "File too large" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def locked(self: Path, *given: object, **more: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(self))

    monkeypatch.setattr(Path, "mkdir", locked)
    refused(homeostat("plant", "new", "boiler", cwd=tmp_path), "boiler' cannot be used: Permission denied")


def test_two_that_are_called_alike_cannot_both_be_made(tmp_path: Path) -> None:
    make_plant(tmp_path / "boiler", "tanks")
    before = {path: path.read_bytes() for path in (tmp_path / "boiler").rglob("*.*")}
    with pytest.raises(PlantError, match=r"is not empty: it holds 'case.toml' and 2 more"):
        make_plant(tmp_path / "boiler", "reactor")
    assert {path: path.read_bytes() for path in (tmp_path / "boiler").rglob("*.*")} == before


@pytest.mark.parametrize("path", sorted(SCAFFOLDS.rglob("*.csv")), ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_every_table_of_a_scaffold_ends_with_a_line_end_and_has_rows(path: Path) -> None:
    lines = path.read_bytes().split(b"\n")
    assert lines[-1] == b"" and len(lines) >= 3 and b"\r" not in path.read_bytes()
