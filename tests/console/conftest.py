from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.opened import OpenedRun
from tests.cli.command import Done, homeostat_process
from tests.cli.conftest import RECOVERY, once
from tests.console.served import SHOWN, Served, served

FROZEN = ("run", "cstr", "--disturb", "L1 frozen from 900", "--seed", "2", "--end", "1050")
"""A run in which the fallback acts, the same as other tests of the command line make."""

WARM = (
    "run", "cstr", "--disturb", "T_coolant + 5 from 700", "--seed", "13", "--end", "830", "--thinking-declared", "1",
    "--out", "run",
)  # fmt: skip
"""A run whose plant is left alone: the coolant is warmer, no table lists that, and every limit is kept."""


@pytest.fixture(scope="session")
def recovered_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run that recovered."""
    done: Done = once(tmp_path_factory, "recovered", *RECOVERY, carried_out=homeostat_process)
    return done.cwd / "run"


@pytest.fixture(scope="session")
def handed_over_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run in which the fallback acted."""
    return once(tmp_path_factory, "handed-over", *FROZEN, "--json").cwd / "runs" / "cstr-none-2"


@pytest.fixture(scope="session")
def left_alone_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run whose plant was left alone."""
    return once(tmp_path_factory, "left-alone", *WARM, carried_out=homeostat_process).cwd / "run"


@pytest.fixture(scope="session")
def advised_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the same run in mode advise: nobody does anything, and a hard limit is violated."""
    arguments = [*RECOVERY[: RECOVERY.index("--end")], "--end", "1012", *RECOVERY[RECOVERY.index("--end") + 2 :]]
    done: Done = once(tmp_path_factory, "advised", *arguments, "--mode", "advise", carried_out=homeostat_process)
    return done.cwd / "run"


@pytest.fixture(scope="session")
def recovered(recovered_run: Path) -> OpenedRun:
    """The run that recovered, opened."""
    return opened(recovered_run, None)


@pytest.fixture(scope="session")
def console(recovered_run: Path) -> Iterator[Served]:
    """A server that shows the run that recovered."""
    with served(recovered_run) as server:
        yield server


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, driven by Playwright; its event loop must be gone before other modules start one."""
    api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("there is no Chromium here; on Debian it is the package 'chromium'")
    quiet = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
             "--disable-sync")  # fmt: skip
    with api.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=found, args=list(quiet))
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page of which every complaint is a failure."""
    opened, complaints = browser.new_page(viewport={"width": 1280, "height": 800}), []
    opened.on("console", lambda said: complaints.append(said.text) if said.type in ("error", "warning") else None)
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    SHOWN.append(opened)
    yield opened
    SHOWN.remove(opened)
    opened.close()
    assert complaints == []
