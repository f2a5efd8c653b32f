"""What commands on a folder do with its generated files: older ones are made again, altered ones are refused."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from homeostat.knowledge.build.build import GRAPH, build
from homeostat.knowledge.build.provenance import is_sealed
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import load_plant
from homeostat.plants.scaffold import make_plant
from homeostat.plants.teaching.learning import learned
from tests.cli.command import COMMAND, LIMIT_S, environment, homeostat, refused

LIMITS = "engineering/limits.csv"
LITERAL = 'SELECT ?text { ?limit ?says ?text FILTER(isLiteral(?text) && STRSTARTS(STR(?text), "L1 <= 1")) }'
NEEDING_GRAPH = {
    "run": ("run", "./boiler", "--end", "20", "--out", "run"),
    "prompt": ("prompt", "./boiler"),
    "try": ("plant", "try", "./boiler", "--end", "1000", "--out", "x.png"),
    "doc": ("plant", "doc", "./boiler"),
    "verify": ("plant", "verify", "./boiler", "--key", "0" * 64),
    "query": ("graph", "query", "./boiler", "-e", LITERAL),
    "export": ("graph", "export", "./boiler", "--format", "nt", "--out", "x.nt"),
}
"""Commands that take a folder and read its graph, but for those that look for what is wrong with it."""
NEEDING_BASELINES = ("run", "prompt", "verify")


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The heated tank, with a graph and reference values of runs that are as short as they can be."""
    folder = tmp_path_factory.mktemp("template") / "boiler"
    make_plant(folder, "tanks")
    settings = folder / "case.toml"
    text = (
        settings.read_text("utf-8")
        .replace("end_s = 4000.0", "end_s = 1000.0")
        .replace("onset_s = 1500.0", "onset_s = 990.0")
    )
    settings.write_text(text, "utf-8")
    (folder / BASELINES).write_bytes(learned(load_plant(str(folder), learned=False)))
    return folder


@pytest.fixture
def boiler(template: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(template, tmp_path / "boiler"))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")


def age(boiler: Path) -> None:
    """Another limit than when the graph was built."""
    edit(boiler / LIMITS, "L1 <= 180", "L1 <= 170")


def state(boiler: Path) -> dict[str, bytes]:
    return {path.relative_to(boiler).as_posix(): path.read_bytes() for path in boiler.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", NEEDING_GRAPH)
@pytest.mark.parametrize(
    "missing", [pytest.param(False, id="older", marks=pytest.mark.wide), pytest.param(True, id="missing")]
)
def test_a_graph_is_made_again_where_a_command_needs_it(name: str, missing: bool, boiler: Path) -> None:
    age(boiler)
    if missing:
        (boiler / GRAPH).unlink()
    done = homeostat(*NEEDING_GRAPH[name], cwd=boiler.parent)
    assert done.status in (0, 1) and f"made again boiler/{GRAPH}: " in done.err, done
    if name not in ("doc", "verify"):  # those only look
        assert (boiler / GRAPH).read_bytes() == build(boiler)


@pytest.mark.parametrize("name", ["query", "export"])
def test_a_question_is_answered_by_what_the_tables_say_now(name: str, boiler: Path) -> None:
    age(boiler)
    done = homeostat(*NEEDING_GRAPH[name], cwd=boiler.parent)
    said = done.out if name == "query" else (boiler.parent / "x.nt").read_text("utf-8")
    assert "L1 <= 170" in said and "L1 <= 180" not in said


@pytest.mark.parametrize("name", NEEDING_GRAPH)
def test_a_folder_that_cannot_be_written_is_used_as_its_tables_are(name: str, boiler: Path) -> None:
    age(boiler)
    (boiler / f".{GRAPH}.{os.getpid()}.partial").mkdir()  # stands where the new graph is to be written first
    before = state(boiler)
    done = homeostat(*NEEDING_GRAPH[name], cwd=boiler.parent)
    assert done.status in (0, 1) and "it is not kept" in done.err and state(boiler) == before, done


@pytest.mark.parametrize("name", NEEDING_GRAPH)
@pytest.mark.parametrize("aged", [False, True], ids=["fresh", "older"])
def test_an_altered_graph_is_refused_by_every_command_that_needs_it(name: str, aged: bool, boiler: Path) -> None:
    edit(boiler / GRAPH, '"L1 <= 180"', '"L1 <= 190"')
    if aged:
        age(boiler)
    before = state(boiler)
    refused(homeostat(*NEEDING_GRAPH[name], cwd=boiler.parent), "[altered]", GRAPH, "change the tables instead")
    assert state(boiler) == before


@pytest.mark.parametrize("name", NEEDING_BASELINES)
def test_altered_reference_values_are_refused_by_every_command_that_needs_them(name: str, boiler: Path) -> None:
    edit(boiler / BASELINES, "F-LIC1,", "F-LIC1,0")
    before = state(boiler)
    done = homeostat(*NEEDING_GRAPH[name], cwd=boiler.parent)
    assert done.status == 2 and "[altered]" in done.err and BASELINES in done.err and done.out == ""
    assert state(boiler) == before


@pytest.mark.slow
def test_what_only_looks_for_mistakes_says_both_and_leaves_the_folder(boiler: Path) -> None:
    age(boiler)
    before = state(boiler)
    checked = homeostat("graph", "check", "./boiler", cwd=boiler.parent)
    assert checked.status == 1 and "[stale-graph]" in checked.out and state(boiler) == before
    noted = homeostat("plant", "check", "./boiler", cwd=boiler.parent)
    assert noted.status == 0 and "is older than the tables" in noted.out and state(boiler) == before
    assert noted.err.count("made again") == 1, (
        "by the command, and not once more by the process that it has the code run in"
    )
    edit(boiler / GRAPH, '"L1 <= 180"', '"L1 <= 190"')
    refused(homeostat("graph", "check", "./boiler", cwd=boiler.parent), "[altered]")
    found = homeostat("plant", "check", "./boiler", cwd=boiler.parent)
    assert found.status == 1 and "plant.ttl: error: " in found.out


def test_what_needs_tables_alone_shows_them_whatever_the_graph_is(boiler: Path) -> None:
    age(boiler)
    edit(boiler / GRAPH, '"L1 <= 180"', '"L1 <= 190"')
    done = homeostat("plant", "show", "./boiler", "--table", "limits", cwd=boiler.parent)
    assert done.status == 0 and "L1 <= 170" in done.out


def older_values(boiler: Path) -> None:
    """Another noise than when the plant was learned from."""
    edit(boiler / "engineering" / "instruments.csv", "LT1,L1,L,-10,220,B1,0.2,", "LT1,L1,L,-10,220,B1,0.3,")


@pytest.mark.slow
def test_two_commands_at_the_same_time_both_find_a_whole_plant(boiler: Path) -> None:
    older_values(boiler)
    both = [
        subprocess.Popen(
            [*COMMAND, "run", "./boiler", "--end", "20", "--out", f"run{k}"], cwd=boiler.parent, env=environment(),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for k in range(2)
    ]  # fmt: skip
    said = [process.communicate(timeout=LIMIT_S) for process in both]
    assert [process.returncode for process in both] == [0, 0], said
    assert all("Traceback" not in err for _, err in said)
    plant = load_plant(str(boiler))
    assert plant.remade == () and (boiler / GRAPH).read_bytes() == build(boiler)
    assert baseline_sources(plant) in (boiler / BASELINES).read_text("utf-8")
    assert not list(boiler.glob(".*.partial"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "delay_s", [pytest.param(0.0, marks=pytest.mark.wide), 0.5, pytest.param(3.0, marks=pytest.mark.wide)]
)
def test_killed_in_the_middle_leaves_the_former_or_the_new_file_whole(delay_s: float, boiler: Path) -> None:
    older_values(boiler)
    before = state(boiler)
    process = subprocess.Popen(
        [*COMMAND, "run", "./boiler", "--end", "20", "--out", "run"], cwd=boiler.parent, env=environment(),
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    until = time.monotonic() + LIMIT_S
    while process.poll() is None and time.monotonic() < until:
        if (boiler / GRAPH).read_bytes() != before[GRAPH] or list(boiler.glob(".*.partial")):
            break  # one file is written, the other is not
    time.sleep(delay_s)
    process.send_signal(signal.SIGKILL)
    process.wait(LIMIT_S)
    for name in (GRAPH, BASELINES):
        assert is_sealed((boiler / name).read_bytes()), name
    done = homeostat("run", "./boiler", "--end", "20", "--out", "again", cwd=boiler.parent)
    assert done.status == 0 and (boiler / GRAPH).read_bytes() == build(boiler)
    assert load_plant(str(boiler)).remade == ()
