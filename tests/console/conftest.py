from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.opened import OpenedRun
from tests.cli.command import Done, homeostat_process
from tests.cli.conftest import RECOVERY, once
from tests.console.served import Served, served

LEAK = ("run", "cstr", "--fault", "leak", "--severity", "0.02", "--onset", "900", "--seed", "2", "--end", "1050")
"""A run in which the fallback acts, the same as other tests of the command line make."""


@pytest.fixture(scope="session")
def recovered_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run that recovered."""
    done: Done = once(tmp_path_factory, "recovered", *RECOVERY, carried_out=homeostat_process)
    return done.cwd / "run"


@pytest.fixture(scope="session")
def handed_over_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run in which the fallback acted."""
    return once(tmp_path_factory, "handed-over", *LEAK, "--json").cwd / "runs" / "cstr-leak-2"


@pytest.fixture(scope="session")
def recovered(recovered_run: Path) -> OpenedRun:
    """The run that recovered, opened."""
    return opened(recovered_run, None)


@pytest.fixture(scope="session")
def console(recovered_run: Path) -> Iterator[Served]:
    """A server that shows the run that recovered."""
    with served(recovered_run) as server:
        yield server
