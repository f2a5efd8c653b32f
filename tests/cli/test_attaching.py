"""A plant is read in another process while this one loads what attaches it: the same comes of it, whatever happens."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from homeostat.cli.attaching.beside import Beside
from homeostat.cli.attaching.stated import stated
from homeostat.plants.error import PlantError
from tests.cli.command import environment

TANKS = Path(__file__).parents[2] / "examples" / "two_tanks"


def child_of(reading: Beside) -> int:
    return reading._process.pid


@pytest.mark.parametrize("plant", ["cstr", str(TANKS)])
def test_what_comes_from_the_other_process_is_what_is_read_here(plant: str) -> None:
    with Beside(plant) as reading:
        assert reading.stated() == stated(plant)
        assert reading._process.returncode == 0, "it was the other process that has read it"


def test_a_plant_that_is_none_is_refused_here(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(PlantError, match="cstrr"), Beside("cstrr") as reading:
        reading.stated()
    assert capfd.readouterr() == ("", ""), "the other process complains to nobody"


def test_a_process_that_dies_is_made_up_for() -> None:
    with Beside("cstr") as reading:
        os.kill(child_of(reading), signal.SIGKILL)
        assert reading.stated() == stated("cstr")


def test_nobody_is_left_behind_where_nobody_waits() -> None:
    with pytest.raises(KeyboardInterrupt), Beside("cstr") as reading:
        raise KeyboardInterrupt
    with pytest.raises(ProcessLookupError):
        os.kill(child_of(reading), 0)


def test_what_lies_in_the_folder_where_it_is_started_is_nobodys_code(tmp_path: Path) -> None:
    (tmp_path / "pickle.py").write_text("raise SystemExit('taken')")
    code = "from homeostat.cli.attaching.beside import Beside\nwith Beside('cstr') as r: print(r.stated().rules.plant)"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], cwd=tmp_path, env=environment(), capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "cstr\n", "")


def test_the_process_that_attaches_loads_nothing_that_reads_a_plant() -> None:
    """So small is the process that a guard is forked from, and so soon is it there."""
    pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")
    code = (
        "import sys, argparse; from homeostat.cli.commands.attach import Beside\n"
        "with Beside('cstr') as r:\n    import homeostat.service.keeping.attach; r.stated()\n"
        "print(sorted({'pyoxigraph', 'lark', 'numba', 'homeostat.plants.described', 'homeostat.knowledge', "
        "'homeostat.process.blocks', 'homeostat.evaluate', 'multiprocessing.pool'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment())
    assert done.stdout == "[]\n"


@pytest.mark.slow
def test_an_interpreter_that_keeps_nothing_of_what_it_compiles_is_told(tmp_path: Path) -> None:
    pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")
    code = "from homeostat.cli.attaching.compiled import recompiled; print(recompiled())"

    def told(**changed: str) -> str:
        given = {**environment(), "PYTHONPYCACHEPREFIX": str(tmp_path), **changed}
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=given
        ).stdout.strip()

    slow = told(PYTHONDONTWRITEBYTECODE="1")
    assert slow.startswith("the code in ") and "asyncua is compiled anew at every start" in slow
    remedy = slow.split("'")[1].split()
    assert remedy[0] == sys.executable and remedy[-1].endswith("asyncua") and remedy[-2].endswith("homeostat")
    subprocess.run(remedy, check=True, env={**environment(), "PYTHONPYCACHEPREFIX": str(tmp_path)})
    assert told(PYTHONDONTWRITEBYTECODE="1") == "" == told(PYTHONDONTWRITEBYTECODE="")
