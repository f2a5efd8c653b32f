"""What every test needs: an installation of its own, so that none writes into a home directory; nobody's clock."""

from __future__ import annotations

import atexit
import gc
import os
import random
import shutil
import tempfile
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import homeostat  # noqa: F401  # before numpy is loaded: one thread for its sums, as on the command line
from homeostat.plants.mixing_module.kernel import advance as module
from homeostat.plants.plant import load_plant
from homeostat.process.kernel import CompiledKernel

# A busy host draws and computes slowly, which says nothing about the code: time is no property of an example.
settings.register_profile("tests", deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tests")

if "PYTEST_XDIST_WORKER" not in os.environ:  # the workers inherit the first process's key
    _folder = tempfile.mkdtemp(prefix="homeostat-tests-")
    atexit.register(shutil.rmtree, _folder, ignore_errors=True)
    os.environ["HOMEOSTAT_SIGNING_KEY"] = str(Path(_folder) / "signing.key")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Every session draws other examples; the workers of one session draw with the seed that it shows."""
    if config.getoption("--hypothesis-seed") is None:
        config.option.hypothesis_seed = str(random.SystemRandom().randrange(2**32))
    if "PYTEST_XDIST_WORKER" not in os.environ and not config.option.collectonly:
        reactor = load_plant("cstr", learned=False).model.kernel
        assert isinstance(reactor, CompiledKernel)
        for kernel in (reactor, module):  # no test is the first to simulate, and says that it compiles
            kernel.load()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is loaded and collected stays to the end: looking through it for garbage took a tenth of the tests' time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Libraries look for what is left when the interpreter ends, and complain of it."""
    gc.unfreeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """``reference(what, *paths)``: skipped with the reason where what others published is not there."""
    for mark in item.iter_markers("reference"):
        what, *paths = mark.args
        missing = [path for path in paths if not path.exists()]
        if missing:
            pytest.skip(f"{what}: not part of the project, and not at {missing[0]}")


def pytest_report_header(config: pytest.Config) -> str:
    """How to draw the same examples again."""
    return f"drawn examples: --hypothesis-seed={config.option.hypothesis_seed}"
