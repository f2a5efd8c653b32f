"""``homeostat plant try`` and ``plant learn``: what an engineer sees of a plant before anything supervises it."""

from __future__ import annotations

import shutil
from pathlib import Path

from homeostat.plants.files.folder import BASELINES, INSTALLED
from tests.cli.command import homeostat

PNG = b"\x89PNG\r\n\x1a\n"


def copy(name: str, where: Path) -> Path:
    return Path(shutil.copytree(INSTALLED / name, where / name, ignore=shutil.ignore_patterns("__pycache__")))


def test_a_plant_without_reference_values_is_tried(tmp_path: Path) -> None:
    (copy("mixing_module", tmp_path) / BASELINES).unlink()
    done = homeostat("plant", "try", "./mixing_module", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    assert "Draining B204 (emptying_B204)" in done.out and "every limit is kept" in done.out
    assert (tmp_path / "mixing_module-none-1.png").read_bytes().startswith(PNG)


def test_a_fault_that_nobody_answers_shows_what_it_violates(tmp_path: Path) -> None:
    done = homeostat("plant", "try", "cstr", "--fault", "cool_stuck_closed", "--out", "x.png", cwd=tmp_path)
    assert done.status == 1 and "LIM-T-HIGH violated: 'T1 <= 313'" in done.out
    assert "Normal operation (normal)" in done.out and (tmp_path / "x.png").read_bytes().startswith(PNG)


def test_the_picture_goes_into_a_folder_that_is_there(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for out, written in ((".", "."), ("..", ".."), ("sub", "sub")):
        done = homeostat(
            "plant", "try", "cstr", "--end", "2", "--out", out, cwd=tmp_path / "sub" if out == ".." else tmp_path
        )
        assert done.err == "" and "cstr-none-1.png: the run as a picture" in done.out
        picture = tmp_path / ("." if written == ".." else written) / "cstr-none-1.png"
        assert picture.read_bytes().startswith(PNG)
        picture.unlink()
    done = homeostat("plant", "try", "cstr", "--end", "2", "--out", "gone/x.png", cwd=tmp_path)
    assert done.status == 2 and done.out == "" and "gone" in done.err


def test_neither_picture_nor_signature_replaces_a_file_of_the_plant(tmp_path: Path) -> None:
    folder = copy("cstr", tmp_path)
    process, limits = folder / "process.py", folder / "engineering" / "limits.csv"
    before = process.read_bytes(), limits.read_bytes()
    done = homeostat("plant", "try", "./cstr", "--end", "20", "--out", "cstr/process.py", cwd=tmp_path)
    assert done.status == 2 and "'cstr/process.py' is a file of the plant 'cstr' and is not replaced" in done.err
    assert homeostat("plant", "keygen", "key", cwd=tmp_path).status == 0
    told = ("plant", "sign", "./cstr", "--key", "key", "--person", "E", "--reason", "r", "--out")
    done = homeostat(*told, "cstr/engineering/limits.csv", cwd=tmp_path)
    assert done.status == 2 and "limits.csv' is a file of the plant 'cstr'" in done.err
    assert before == (process.read_bytes(), limits.read_bytes())
    assert homeostat(*told, "cstr/plant.sig", cwd=tmp_path).status == 0


def test_a_plant_that_never_starts_is_not_well(tmp_path: Path) -> None:
    done = homeostat("plant", "try", "cstr", "--end", "100", "--out", "seen", cwd=tmp_path)
    assert (tmp_path / "seen.png").read_bytes().startswith(PNG)
    assert done.status == 1 and "never holds in 100 s" in done.out and "violated" not in done.out


def test_a_start_up_that_outlasts_its_time_is_not_ready(tmp_path: Path) -> None:
    assert homeostat("plant", "new", "./tanks", cwd=tmp_path).status == 0
    states = tmp_path / "tanks" / "engineering" / "states.csv"
    text = states.read_text("utf-8")
    assert "starting,1800," in text
    states.write_text(text.replace("starting,1800,", "starting,200,"), "utf-8")
    done = homeostat("plant", "try", "./tanks", cwd=tmp_path)
    (line,) = [line for line in done.out.splitlines() if line.startswith("not ready: ")]
    assert done.status == 1 and "longer than start_up_s = 200 s (states.csv)" in line and "look at the guard" in line


def test_what_is_learned_is_what_ships(tmp_path: Path) -> None:
    folder = copy("mixing_module", tmp_path)
    (folder / BASELINES).unlink()
    done = homeostat("plant", "learn", "./mixing_module", cwd=tmp_path)
    assert done.status == 0 and "40 of 40 fault-free runs" in done.err
    assert f"{folder / BASELINES}: " in done.out and "learned from 40 fault-free runs" in done.out
    assert (folder / BASELINES).read_bytes() == (INSTALLED / "mixing_module" / BASELINES).read_bytes()


def test_a_sick_plant_is_refused_in_one_line_and_keeps_its_values(tmp_path: Path) -> None:
    folder = copy("cstr", tmp_path)
    limits = folder / "engineering" / "limits.csv"
    limits.write_text(limits.read_text("utf-8").replace("T1 <= 313", "T1 <= 309.5"), "utf-8")
    before = (folder / BASELINES).read_bytes()
    done = homeostat("plant", "learn", "./cstr", cwd=tmp_path)
    (line,) = (line for line in done.err.splitlines() if "not well" in line)
    assert done.status == 2 and done.out == "" and "(LIM-T-HIGH) does not hold for" in line
    assert (folder / BASELINES).read_bytes() == before
