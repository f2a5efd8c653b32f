"""A disk that fills during a run: everything is still told, the run ends as it ends, and what is missing is said."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from homeostat.cli.commands.run import STATUS, Going, carry
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import load_plant
from homeostat.record.directory import RunDirectory
from tests.cli.command import COMMAND, LIMIT_S, Done, environment, homeostat, refused
from tests.cli.conftest import RECOVERY

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="needs limits on file size")]


def cramped(kibibytes: int, cwd: Path, cache: Path | None = None) -> Done:
    """The short run, with no file longer than ``kibibytes``; ``cache``: folder of compiled code."""
    line = f'ulimit -f {kibibytes}; exec "$@"'
    surroundings = environment() | ({} if cache is None else {"NUMBA_CACHE_DIR": str(cache)})
    done = subprocess.run(
        ["bash", "-c", line, "bash", *COMMAND, *RECOVERY],
        cwd=cwd, env=surroundings, capture_output=True, encoding="utf-8", timeout=LIMIT_S,
    )  # fmt: skip
    return Done(done.returncode, done.stdout, done.stderr, cwd)


@pytest.mark.parametrize(
    ("kibibytes", "outcome"), [(4, "fallback"), pytest.param(30, "recovered", marks=pytest.mark.wide)]
)
def test_the_person_is_told_everything_and_the_run_ends(tmp_path: Path, kibibytes: int, outcome: str) -> None:
    done = cramped(kibibytes, tmp_path)
    lines = [line.split()[2:] for line in done.out.partition("\n\n")[0].splitlines()]
    kinds = [words[0] for words in lines]
    assert done.status == STATUS[outcome], done
    assert ["alarm", "journal"] in [words[:2] for words in lines] or kibibytes == 30
    assert kinds[-1] == "end" and outcome.replace("_", " ") in done.out.splitlines()[len(lines) - 1]
    assert ("fallback" in kinds) == (outcome == "fallback") and "Production" in done.out
    assert done.err.count("\n") == 1
    assert done.err.startswith("homeostat: the record in 'run' is incomplete: ") and "trajectory.parquet" in done.err
    checked = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert checked.status == 1 and "incomplete run: verifies up to line" in checked.out
    refused(homeostat("resume", "run", cwd=tmp_path), "is over")


@pytest.mark.wide
def test_what_is_compiled_during_the_run_needs_no_room(tmp_path: Path) -> None:
    done = cramped(4, tmp_path, tmp_path / "nothing compiled yet")
    said = done.err.splitlines()
    assert done.status == STATUS["fallback"] and len(said) == 2 and said[0] == "homeostat: compiling, once", done


def test_a_run_that_cannot_begin_its_record_does_not_begin(tmp_path: Path) -> None:
    done = cramped(1, tmp_path)
    assert done.status == 2 and done.err.count("\n") == 1 and "make room" in done.err


def test_a_result_that_cannot_be_stored_is_printed_and_has_a_status_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plant, directory = load_plant("cstr"), RunDirectory(tmp_path / "run")
    (tmp_path / "run" / "result.json").mkdir()  # no file finds room here
    chosen = scenario(plant, "none", 1, None, None, 30.0)
    status = carry(Going(plant, chosen, directory, Thinking(declared_s=1.0), "search", Proposing(), Operation()), False)
    said = capsys.readouterr()
    assert status == 1 and "No action" in said.out
    assert said.err.count("\n") == 1 and "is incomplete: result.json: " in said.err
