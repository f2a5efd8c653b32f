"""What every test needs: an installation of its own, so that none writes into a home directory."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from pathlib import Path

import homeostat  # noqa: F401  # before numpy is loaded: one thread for its sums, as on the command line

if "PYTEST_XDIST_WORKER" not in os.environ:  # the workers inherit the first process's key
    _folder = tempfile.mkdtemp(prefix="homeostat-tests-")
    atexit.register(shutil.rmtree, _folder, ignore_errors=True)
    os.environ["HOMEOSTAT_SIGNING_KEY"] = str(Path(_folder) / "signing.key")
