"""Model servers as processes of their own, reached over the loopback as a user's would be."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]


@contextmanager
def random_model(seed: int) -> Iterator[str]:
    """A transformer with random weights that decodes along schemas; its base URL."""
    with _served("tests.llm.random_model", "--seed", str(seed)) as url:
        yield url


@contextmanager
def hostile() -> Iterator[str]:
    """A server that misbehaves as the model's name says; its base URL."""
    with _served("tests.llm.hostile") as url:
        yield url


@contextmanager
def _served(module: str, *arguments: str) -> Iterator[str]:
    process = subprocess.Popen(
        [sys.executable, "-m", module, "--port", "0", *arguments], cwd=ROOT, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None and process.stderr is not None
        line = process.stdout.readline()
        if not line.startswith("listening on "):
            raise RuntimeError(f"{module} did not start: {process.stderr.read()}")
        yield f"http://127.0.0.1:{int(line.split()[-1])}/v1"
    finally:
        process.kill()
        process.communicate()
