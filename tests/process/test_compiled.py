"""Compiled code: the same as the Python it was made from, and never older than its sources."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np

import homeostat.process.compiled as subject
from homeostat.process.compiled import compiled
from tests.plants.cstr.reactor import batch, run

ROOT = Path(__file__).parents[2]
PROCESS = Path(subject.__file__).parent
FAULTS = {"fouling": (0.6, 100.0), "leak": (0.003, 110.0), "temp_bias": (2.0, 120.0), "pump_degrade": (0.5, 130.0)}
INTERPRETED = f"""
import json
from homeostat.plants.cstr.kernel import advance
from tests.plants.cstr.reactor import batch, run
assert type(advance).__name__ == "function", "this is to be plain Python"
result = run(batch(450, faults={FAULTS!r}, process=1.0, sensor=1.0))
print(json.dumps(result.record[0].tolist()))
"""
DEPENDENT = """
from homeostat.process.compiled import compiled
from homeostat.process.equipment import linear_valve
from homeostat.process.types import Row
from kernels.constants import FACTOR

@compiled
def kernel(position):
    return FACTOR * linear_valve(2.0, position)
"""


def python(code: str, *paths: Path, **environment: str) -> str:
    """What a fresh interpreter prints."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    search = os.pathsep.join(str(p) for p in paths)
    done = subprocess.run(
        [sys.executable, "-c", code], env=clean | {"PYTHONPATH": search} | environment, cwd=ROOT,
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_compiled_reactor_is_the_reactor_as_plain_python() -> None:
    """Every block of the kernel, noise included; a step of it is some hundred operations, so bits may differ."""
    interpreted = python(
        INTERPRETED, ROOT / "src", ROOT, NUMBA_DISABLE_JIT="1", PYTHONWARNINGS="ignore::RuntimeWarning"
    )
    expected = np.array(json.loads(interpreted))
    actual = run(batch(450, faults=FAULTS, process=1.0, sensor=1.0)).record[0]
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-11)


def test_a_change_in_another_file_reaches_the_compiled_code(tmp_path: Path) -> None:
    """Numba's own cache looks at the file of a function only; a changed block or constant would pass it unseen."""
    package, kernels = tmp_path / "homeostat", tmp_path / "kernels"
    shutil.copytree(PROCESS, package / "process", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(PROCESS.parent / "domain", package / "domain", ignore=shutil.ignore_patterns("__pycache__"))
    (package / "__init__.py").touch()
    kernels.mkdir()
    (kernels / "kernel.py").write_text(DEPENDENT)
    (kernels / "constants.py").write_text("FACTOR = 10.0\n")
    ask = "from kernels.kernel import kernel; print(kernel(0.5), sum(kernel.stats.cache_hits.values()))"
    assert python(ask, tmp_path) == "10.0 0\n"
    assert python(ask, tmp_path) == "10.0 1\n", "the second process must find the compiled code"
    equipment = package / "process" / "equipment.py"
    block = equipment.read_text()
    assert "return coefficient * position" in block
    equipment.write_text(block.replace("return coefficient * position", "return coefficient * position * position"))
    assert python(ask, tmp_path) == "5.0 0\n"
    (kernels / "constants.py").write_text("FACTOR = 20.0\n")
    assert python(ask, tmp_path) == "10.0 0\n"
    (kernels / "unrelated.txt").write_text("not code")
    assert python(ask, tmp_path) == "10.0 1\n"


def test_the_users_cache_folder_is_respected(tmp_path: Path) -> None:
    ask = "from homeostat.process.equipment import clip; print(clip(2.0, 0.0, 1.0))"
    assert python(ask, ROOT / "src", NUMBA_CACHE_DIR=str(tmp_path)) == "1.0\n"
    assert [p.suffix for p in tmp_path.rglob("equipment.clip*")].count(".nbi") == 1


def test_compiling_leaves_numbas_settings_alone() -> None:
    before = numba.config.CACHE_DIR

    @compiled
    def double(x: float) -> float:
        return 2.0 * x

    after = numba.config.CACHE_DIR
    assert after == before
    assert double(1.5) == 3.0


def test_the_first_compilation_is_said_and_later_runs_are_silent(tmp_path: Path) -> None:
    ask = "from homeostat.process.equipment import clip, approach; print(clip(2.0, 0.0, 1.0), approach(0.0, 1.0, 0.5))"
    clean = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    environment = clean | {"PYTHONPATH": str(ROOT / "src"), "NUMBA_CACHE_DIR": str(tmp_path)}
    said = [
        subprocess.run([sys.executable, "-c", ask], env=environment, capture_output=True, text=True, check=True).stderr
        for _ in range(2)
    ]
    assert said == ["compiling, once\n", ""]
