"""Compiled code: the same as the Python it was made from."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.plants.cstr.reactor import batch, run

ROOT = Path(__file__).parents[2]
FAULTS = {"fouling": (0.6, 100.0), "leak": (0.003, 110.0), "temp_bias": (2.0, 120.0), "pump_degrade": (0.5, 130.0)}
INTERPRETED = f"""
import json
from homeostat.process.equipment import approach
from tests.plants.cstr.reactor import batch, run
assert not hasattr(approach, "py_func"), "this is to be plain Python"
result = run(batch(450, faults={FAULTS!r}, process=1.0, sensor=1.0))
print(json.dumps(result.record[0].tolist()))
"""


def python(code: str, *paths: Path, **environment: str) -> str:
    """What a fresh interpreter prints."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    search = os.pathsep.join(str(p) for p in paths)
    done = subprocess.run(
        [sys.executable, "-c", code], env=clean | {"PYTHONPATH": search} | environment, cwd=ROOT,
        capture_output=True, text=True, timeout=240, check=False,
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


def test_a_block_is_plain_python_outside_a_kernel() -> None:
    """Who calls a block once does not wait for the compiler."""
    code = (
        "import sys; from homeostat.process.equipment import clip; print(clip(2.0, 0.0, 1.0), 'numba' in sys.modules)"
    )
    assert python(code, ROOT / "src") == "1.0 False\n"
