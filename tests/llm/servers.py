"""Model servers as processes of their own, reached over the loopback as a user's would be."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
START_S = 30.0
"""A server that has not said where it listens after this time [s] never will."""


@contextmanager
def random_model(seed: int) -> Iterator[str]:
    """A transformer with random weights that decodes along schemas; its base URL."""
    with served("tests.llm.random_model", "--seed", str(seed)) as url:
        yield url


@contextmanager
def hostile() -> Iterator[str]:
    """A server that misbehaves as the model's name says; its base URL."""
    with served("tests.llm.hostile") as url:
        yield url


@contextmanager
def served(module: str, *arguments: str, within_s: float = START_S) -> Iterator[str]:
    """The base URL of a server that says ``listening on PORT`` once it is ready; it is killed at the end."""
    command = [sys.executable, "-m", module, "--port", "0", *arguments]
    # Matrices of this size gain nothing from threads, and threads of two processes wait for each other.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    # Into a file: nobody reads a pipe while the tests run, and a full one would stop the server.
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True)
        late = threading.Timer(within_s, process.kill)
        late.start()
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            late.cancel()
            if not line.startswith("listening on "):
                process.kill()
                process.wait()
                errors.seek(0)
                raise RuntimeError(f"{module} did not start within {within_s:g} s: {errors.read()}")
            yield f"http://127.0.0.1:{int(line.split()[-1])}/v1"
        finally:
            late.cancel()
            process.kill()
            process.communicate()
