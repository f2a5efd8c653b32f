from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.cli.command import LIMIT_S, Done, homeostat, homeostat_process

RECOVERY = (
    "run", "cstr", "--fault", "cool_stuck_closed", "--onset", "900", "--end", "1050", "--thinking-declared", "1",
    "--out", "run",
)  # fmt: skip
"""A short run that recovers, the same whenever it runs; its record is in ``run``."""


def once(
    factory: pytest.TempPathFactory, name: str, *arguments: str, carried_out: Callable[..., Done] = homeostat
) -> Done:
    """What ``homeostat arguments`` did in folder ``name``: carried out by the first test process that asks."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / f"cli-{name}"
    answer = folder / "done.json"
    try:
        (folder / "cwd").mkdir(parents=True)
    except FileExistsError:
        deadline = time.monotonic() + LIMIT_S
        while not answer.exists():
            assert time.monotonic() < deadline, f"the process that runs {name!r} has not finished"
            time.sleep(0.05)
        kept = json.loads(answer.read_text())
        return Done(**{**kept, "cwd": Path(kept["cwd"])})
    done = carried_out(*arguments, cwd=folder / "cwd")
    fresh = answer.with_suffix(".new")
    fresh.write_text(json.dumps({**asdict(done), "cwd": str(done.cwd)}))
    fresh.replace(answer)
    return done


@pytest.fixture(scope="session")
def recovered(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A run that recovered, with its lines, in a process of its own."""
    return once(tmp_path_factory, "recovered", *RECOVERY, carried_out=homeostat_process)


@pytest.fixture(scope="session")
def recovered_json(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """The same run once more, with JSON."""
    return once(tmp_path_factory, "recovered-json", *RECOVERY, "--json")


@pytest.fixture(scope="session")
def handed_over(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A run in which the fallback acted, with JSON; its record is in ``runs/cstr-none-2``."""
    fault = ("--disturb", "L1 frozen from 900")
    return once(tmp_path_factory, "handed-over", "run", "cstr", *fault, "--seed", "2", "--end", "1050", "--json")


@pytest.fixture
def record(recovered: Done) -> Path:
    """The directory of the recovered run."""
    return recovered.cwd / "run"
