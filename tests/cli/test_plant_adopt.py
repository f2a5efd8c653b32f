"""``homeostat plant adopt``: an unknown cause gets a name, and is found by it the next time."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.plant import load_plant
from tests.cli.command import Done, homeostat, refused
from tests.cli.conftest import once
from tests.plants.named_causes import FAULTS, SYMPTOMS

IMPELLER = "K_P1 * 1.25 from 1450"
WELL = "T1 reads - 5 from 1450"
LOOKS = ("--mode", "observe", "--thinking-declared", "1")


def observed(disturbance: str, end_s: int) -> tuple[str, ...]:
    return ("run", "cstr", "--disturb", disturbance, "--end", str(end_s), *LOOKS, "--out", "run")


@pytest.fixture(scope="session")
def impeller(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a pump that gives more than it should."""
    return once(tmp_path_factory, "impeller", *observed(IMPELLER, 1520)).cwd / "run"


@pytest.fixture(scope="session")
def well(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a thermometer that reads low."""
    return once(tmp_path_factory, "well", *observed(WELL, 1480)).cwd / "run"


@pytest.fixture(scope="session")
def knowing(tmp_path_factory: pytest.TempPathFactory, impeller: Path, well: Path) -> Path:
    """A reactor that has adopted both, one after the other."""
    where = tmp_path_factory.mktemp("knowing")
    first = adopt(impeller, where, "--name", "larger_impeller", "--label", "Impeller, a size larger", "--into", "first")
    assert first.status == 0, first.err
    # The second run was made without the first row: its rows go to a copy that is as the run's plant was.
    second = adopt(well, where, "--name", "loose_well", "--into", "second")
    assert second.status == 0, second.err
    rows = [(where / "second" / name).read_text().splitlines()[-1] for name in (FAULTS, SYMPTOMS)]
    for name, row in zip((FAULTS, SYMPTOMS), rows, strict=True):
        with (where / "first" / name).open("a") as file:
            file.write(f"{row}\n")
    load_plant(str(where / "first"))  # what follows from its tables is made again before any test, which would be told
    return where / "first"


def adopt(run: Path, where: Path, *options: str) -> Done:
    return homeostat("plant", "adopt", str(run), *options, "--yes", cwd=where)


def copy(where: Path) -> Path:
    return Path(shutil.copytree(INSTALLED / "cstr", where / "copy", ignore=shutil.ignore_patterns("__pycache__")))


@pytest.mark.slow
def test_the_rows_are_shown_and_nothing_is_written(impeller: Path, tmp_path: Path) -> None:
    folder = copy(tmp_path)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    done = homeostat("plant", "adopt", str(impeller), "--name", "larger", "--plant", "./copy", cwd=tmp_path)
    assert done.status == 0 and "say --yes" in done.out
    assert "larger,unknown change of K_P1 (P1),P1,L/s,0.02" in done.out and "S-LEVEL-LOW,larger" in done.out
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.slow
def test_a_copy_has_the_fault_in_its_tables_and_its_graph(impeller: Path, tmp_path: Path) -> None:
    folder = copy(tmp_path)
    done = adopt(impeller, tmp_path, "--name", "larger", "--label", "Impeller, larger", "--plant", "./copy")
    assert done.status == 0 and "has the fault 'larger' now" in done.out
    assert "/copy: checked, " in done.out.splitlines()[-1], "what the check finds is shown"
    plant = load_plant(str(folder))
    fault = plant.description.fault("larger")
    assert (fault.label, fault.component, fault.mode) == ("Impeller, larger", "P1", "unknown_P1_K_P1")
    assert 0.0 < fault.severity_range.low < 0.02 < fault.severity_range.high and plant.remade == ()
    assert "larger" in next(r.faults for r in plant.description.symptom_rules if r.name == "S-LEVEL-LOW")
    shipped = load_plant("cstr").description
    others = tuple(f for f in plant.description.faults if f.name != "larger")
    assert others == shipped.faults and plant.description.generated == shipped.generated
    assert homeostat("graph", "check", "./copy", cwd=tmp_path).status == 0


@pytest.mark.slow
def test_a_table_without_the_column_gets_it(impeller: Path, tmp_path: Path) -> None:
    folder = tmp_path / "bare"
    shutil.copytree(INSTALLED / "cstr", folder, ignore=shutil.ignore_patterns("__pycache__"))
    lines = [line.rpartition(",")[0] for line in (folder / FAULTS).read_text().splitlines()]
    (folder / FAULTS).write_bytes("\r\n".join([*lines, ""]).encode())
    run = homeostat("run", "./bare", "--disturb", IMPELLER, "--end", "1520", *LOOKS, "--out", "run", cwd=tmp_path)
    assert "unknown change of K_P1" in run.out
    done = adopt(tmp_path / "run", tmp_path, "--name", "larger", "--plant", "./bare")
    assert done.status == 0, done.err
    content = (folder / FAULTS).read_bytes()
    assert content.count(b"\r\n") == content.count(b"\n") == len(lines) + 1
    rows = list(csv.DictReader(content.decode().splitlines()))
    assert [row["mode"] for row in rows] == [*[""] * (len(lines) - 1), "unknown_P1_K_P1"]
    assert load_plant(str(folder)).description.fault("larger").mode == "unknown_P1_K_P1"


@pytest.mark.slow
@pytest.mark.parametrize("simulated", [False, pytest.param(True, marks=pytest.mark.wide)])
@pytest.mark.parametrize(
    ("disturbance", "end_s", "seed", "name", "severity"),
    [
        (IMPELLER.replace("1.25", "1.35"), 1520, 5, "larger_impeller", "0.028"),
        pytest.param(WELL.replace("5", "3", 1), 1480, 6, "loose_well", "3", marks=pytest.mark.wide),
    ],
)
def test_the_next_time_it_is_found_by_its_name(
    knowing: Path, tmp_path: Path, disturbance: str, end_s: int, seed: int, name: str, severity: str, simulated: bool
) -> None:
    """Also where the plant simulates what it knows by that name."""
    truth = ("--fault", name, "--severity", severity, "--onset", "1450") if simulated else ("--disturb", disturbance)
    where = ("--seed", str(seed), "--end", str(end_s), *LOOKS, "--out", "again")
    done = homeostat("run", str(knowing), *truth, *where, cwd=tmp_path)
    (line,) = (line for line in done.out.splitlines() if line.startswith("  Detected"))
    assert f"94 % {name} " in line, line


@pytest.mark.wide
def test_other_faults_are_called_what_they_were(knowing: Path, tmp_path: Path) -> None:
    chosen = ("--fault", "cool_stuck_closed", "--onset", "1450", "--end", "1480", *LOOKS)
    said = []
    for plant in ("cstr", str(knowing)):
        done = homeostat("run", plant, *chosen, "--out", Path(plant).name, cwd=tmp_path)
        said += [line for line in done.out.splitlines() if line.startswith("  Detected")]
    assert len(said) == 2 and said[0] == said[1] and "94 % cool_stuck_closed" in said[0]


def test_what_ships_is_not_written(impeller: Path, tmp_path: Path) -> None:
    refused(adopt(impeller, tmp_path, "--name", "larger"), "ships with the package", "--into DIR")
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "file").touch()
    refused(adopt(impeller, tmp_path, "--name", "larger", "--into", "there"), "'there' is there already")


def test_another_configuration_is_refused(impeller: Path, knowing: Path, tmp_path: Path) -> None:
    done = adopt(impeller, tmp_path, "--name", "larger", "--plant", str(knowing))
    refused(done, "configuration", "name its folder with --plant")


@pytest.mark.parametrize(
    ("name", "options", "why"),
    [
        ("leak", (), "choose another name"),
        ("x", ("--mode", "unknown_V2_F3_max"), "does not have"),
        ("x y", (), "letters"),
    ],
)
def test_what_cannot_be_adopted_is_one_line(
    impeller: Path, tmp_path: Path, name: str, options: tuple[str, ...], why: str
) -> None:
    refused(adopt(impeller, tmp_path, "--name", name, *options, "--into", "copy"), why)
    assert not (tmp_path / "copy").exists()


def test_rows_that_make_no_plant_leave_it_as_it_was(impeller: Path, tmp_path: Path) -> None:
    folder = copy(tmp_path)
    before = (folder / FAULTS).read_bytes(), (folder / SYMPTOMS).read_bytes()
    done = adopt(impeller, tmp_path, "--name", "larger", "--label", "two\nlines", "--plant", "./copy")
    refused(done, "[bad-table] faults.csv row 11 ('larger')", "label")
    assert ((folder / FAULTS).read_bytes(), (folder / SYMPTOMS).read_bytes()) == before
    load_plant(str(folder))
    refused(adopt(impeller, tmp_path, "--name", "n" * 121, "--into", "new"), "name")
    assert not (tmp_path / "new").exists()


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    refused(adopt(tmp_path / "no", tmp_path, "--name", "x"), "is not a directory")
