"""A kernel's machine code: never older than its sources, never half of a file, and nothing that needs the compiler."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from homeostat.process.batch import simulate
from homeostat.process.kernel import Columns, kernel
from homeostat.process.machine_code import read
from tests.plants.cstr.reactor import MODEL, F, P, S, U, batch

ROOT = Path(__file__).parents[2]
TANK = """
import numpy as np
from homeostat.process.compiled import compiled
from homeostat.process.equipment import linear_valve
from homeostat.process.kernel import Columns, kernel
from tank.constants import FACTOR

@compiled
def gain(position):
    return FACTOR * linear_valve(2.0, position)

@kernel(Columns(1, 1, 1, 1), scratch=3)
def advance(first, last, x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks, out,
            broken_at, work):
    for m in range(first, last):
        for k in range(begin[m], steps):
            x[m, 0] += gain(u[u_of[m], k, 0])
            MORE
"""
RUN = """
import sys
import numpy as np
from tank.kernel import advance
one, whole, none = np.ones((1, 1)), np.zeros(1, dtype=np.int64), np.zeros(1)
x = np.zeros((1, 1))
advance(0, 1, x, one, one, one, np.full((1, 4, 1), 0.5), whole, 0.0, whole, 2, 1, whole, none, none, whole,
        np.zeros((1, 2, 1)), none)
print(x[0, 0], "numba" in sys.modules)
"""


def made(folder: Path, more: str = "pass") -> Path:
    """A plant of one tank in ``folder``: its level grows by 5 each second; ``more`` is done each second as well."""
    tank = folder / "tank"
    tank.mkdir()
    (tank / "__init__.py").touch()
    (tank / "kernel.py").write_text(TANK.replace("MORE", more))
    (tank / "constants.py").write_text("FACTOR = 5.0\n")
    return tank


def run(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """What a fresh interpreter makes of two seconds of the tank."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    search = {"PYTHONPATH": os.pathsep.join((str(folder), str(ROOT / "src")))}
    return subprocess.run(
        [sys.executable, "-c", RUN], env=clean | search | environment, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_it_compiles_once_says_so_and_again_after_a_change_in_another_file(tmp_path: Path) -> None:
    tank = made(tmp_path)
    first, second = run(tmp_path), run(tmp_path)
    assert (first.stdout, first.stderr) == ("10.0 True\n", "compiling, once\n")
    assert (second.stdout, second.stderr) == ("10.0 False\n", ""), "it needs no compiler any more"
    (tank / "constants.py").write_text("FACTOR = 7.0\n")
    changed = run(tmp_path)
    assert changed.stdout.split()[0] == "14.0" and changed.stderr == "compiling, once\n"
    (tank / "unrelated.txt").write_text("not code")
    assert run(tmp_path).stderr == ""


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a tank and its machine code, compiled once for all tests that spoil it and have it made again."""
    folder = tmp_path_factory.mktemp("compiled")
    made(folder)
    run(folder)
    return folder


@pytest.mark.parametrize("keep", [0, 100, 3000, -1])
def test_what_is_left_of_a_file_is_not_read(compiled: Path, tmp_path: Path, keep: int) -> None:
    (file,) = compiled.rglob("*.o")
    part = tmp_path / "part.o"
    part.write_bytes(file.read_bytes()[:keep])
    part.chmod(0o644)
    assert read(file) is not None and read(part) is None


def test_what_is_left_of_a_file_is_made_again(compiled: Path) -> None:
    """A machine that died while it wrote, or a disk that was full: compiled again, not loaded."""
    (file,) = compiled.rglob("*.o")
    file.write_bytes(file.read_bytes()[:-1])
    again = run(compiled)
    assert (again.stdout, again.stderr) == ("10.0 True\n", "compiling, once\n")
    assert run(compiled).stderr == ""


def test_the_users_cache_folder_is_respected(tmp_path: Path) -> None:
    made(tmp_path)
    kept = tmp_path / "elsewhere"
    assert run(tmp_path, NUMBA_CACHE_DIR=str(kept)).stdout == "10.0 True\n"
    assert [file.suffix for file in kept.iterdir()] == [".o"]


def test_where_nothing_can_be_kept_it_works_all_the_same(tmp_path: Path) -> None:
    made(tmp_path)
    (tmp_path / "file").touch()
    done = run(tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "file" / "below"))
    assert (done.returncode, done.stdout) == (0, "10.0 True\n")


@pytest.mark.parametrize(
    "more",
    [
        "raise ValueError('no')",
        pytest.param("work[:] = u[0, :2, 0]", marks=pytest.mark.wide),
        pytest.param("x[m, 0] += np.ones(k + 1)[k]", marks=pytest.mark.wide),
    ],
)
def test_a_kernel_that_raises_or_allocates_is_refused_when_it_is_compiled(tmp_path: Path, more: str) -> None:
    made(tmp_path, more)
    done = run(tmp_path)
    assert done.returncode == 1 and "TypeError: kernel of tank.kernel calls" in done.stderr


@pytest.mark.parametrize("wrong", ["type", "pieces", "read-only"])
def test_an_array_that_machine_code_would_misread_is_refused(wrong: str) -> None:
    x, p, u = np.zeros((2, len(S))), np.zeros((2, len(P))), np.zeros((3, 4, len(U)))
    if wrong == "type":
        p = p.astype(np.float32)
    elif wrong == "pieces":
        u = np.asfortranarray(u)
    else:
        x.flags.writeable = False
    sev, whole, real = np.zeros((2, len(F))), np.zeros(2, dtype=np.int64), np.zeros(2)
    given = (x, p, sev, sev, u, whole, 0.0, whole, 1, 1, whole, real, real, whole, np.zeros((2, 1, 2)), real)
    with pytest.raises(TypeError):
        MODEL.kernel(0, 2, *given)


TWO = """
from homeostat.process.kernel import Columns, kernel

@kernel(Columns(1, 1, 1, 1), scratch=1)
def one(first, last, x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks, out,
        bad, work):
    x[0, 0] += 1.0

@kernel(Columns(2, 1, 1, 1), scratch=1)
def two(first, last, x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks, out,
        bad, work):
    x[0, 1] += 2.0
"""
RUN_TWO = """
import numpy as np
from tank.kernel import one, two
first, second, ones = np.zeros((1, 1)), np.zeros((1, 2)), np.ones((1, 1))
whole, none = np.zeros(1, dtype=np.int64), np.zeros(1)
rest = (ones, ones, ones, np.ones((1, 2, 1)), whole, 0.0, whole, 1, 1, whole, none, none, whole, np.zeros((1, 1, 1)),
        none)
one(0, 1, first, *rest)
two(0, 1, second, *rest)
print(first.tolist(), second.tolist())
"""


@pytest.mark.slow
def test_each_kernel_has_machine_code_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also two of one module, and a copy of a folder that reads other numbers, with one cache for all."""
    made(tmp_path)
    (tmp_path / "tank" / "kernel.py").write_text(TWO)
    monkeypatch.setattr(f"{__name__}.RUN", RUN_TWO)
    assert [run(tmp_path).stdout for _ in range(2)] == ["[[1.0]] [[0.0, 2.0]]\n"] * 2
    monkeypatch.undo()
    shared = {"NUMBA_CACHE_DIR": str(tmp_path / "shared")}
    for gain in ("5.0", "7.0"):
        tank = made(tmp_path / gain) if not (tmp_path / gain).mkdir() else None
        assert tank is not None
        (tank / "constants.py").write_text(
            "from pathlib import Path\nFACTOR = float(Path(__file__).with_name('gain.csv').read_text())\n"
        )
        (tank / "gain.csv").write_text(gain)
        assert run(tmp_path / gain, **shared).stdout.split()[0] == str(2.0 * float(gain))


def test_a_kernel_that_depends_on_what_is_around_it_is_refused() -> None:
    factor = 2.0

    def around(*_: object) -> None:
        print(factor)

    with pytest.raises(TypeError, match="depends on what is around it"):
        kernel(Columns(1, 1, 1, 1), scratch=1)(around)


@pytest.mark.parametrize(
    "more",
    [
        "x[m, 0] += math.gamma(3.0)",
        pytest.param("x[m, 0] += math.ldexp(1.0, 2)", marks=pytest.mark.wide),
        pytest.param("x[m, 0] += k**k", marks=pytest.mark.wide),
    ],
)
def test_what_only_numba_has_is_refused_when_it_is_compiled(tmp_path: Path, more: str) -> None:
    """A name that nobody has would end the process at the first call."""
    tank = made(tmp_path, more)
    tank.joinpath("kernel.py").write_text("import math\n" + tank.joinpath("kernel.py").read_text())
    done = run(tmp_path)
    assert done.returncode == 1 and "TypeError: kernel of tank.kernel" in done.stderr and not done.stdout


def test_arrays_that_were_sent_to_another_process_are_taken() -> None:
    """What is unpickled has a type of numbers of its own, equal to everybody's."""
    sent = pickle.loads(pickle.dumps(batch(20)))
    assert simulate(MODEL.kernel, sent).state.tobytes() == simulate(MODEL.kernel, batch(20)).state.tobytes()


@pytest.mark.parametrize("wrong", ["seeds", "x", "out", "members"])
def test_arrays_of_another_shape_are_refused(wrong: str) -> None:
    x, whole, real = np.zeros((2, len(S))), np.zeros(2, dtype=np.int64), np.zeros(2)
    seeds = np.zeros((2, 2), dtype=np.int64) if wrong == "seeds" else whole
    state = x[None] if wrong == "x" else x
    out = np.zeros((1, 1, 2)) if wrong == "out" else np.zeros((2, 1, 2))
    sev, p, u = np.zeros((2, len(F))), np.zeros((2, len(P))), np.zeros((1, 4, len(U)))
    given = (state, p, sev, sev, u, whole, 0.0, whole, 1, 1, seeds, real, real, whole, out, real)
    with pytest.raises(ValueError):
        MODEL.kernel(0, 3 if wrong == "members" else 2, *given)


def test_machine_code_that_others_could_have_written_is_not_loaded(compiled: Path) -> None:
    (file,) = compiled.rglob("*.o")
    file.chmod(0o666)
    assert run(compiled).stderr == "compiling, once\n"
    assert file.stat().st_mode & 0o777 == 0o644 and run(compiled).stderr == ""
