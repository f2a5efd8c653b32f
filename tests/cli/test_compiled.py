"""An interpreter that compiles everything anew at each start keeps a guard away for seconds: who attaches is told."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import environment


@pytest.mark.slow
def test_an_interpreter_that_keeps_nothing_of_what_it_compiles_is_told(tmp_path: Path) -> None:
    pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")
    code = "from homeostat.cli.compiled import recompiled; print(recompiled())"

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
