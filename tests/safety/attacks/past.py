"""The subject of the past: commit 170fbcd, attacked in a process of its own."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any

from tests.safety.attacks.plant import Attack, Report, as_data

COMMIT = "170fbcd"
HERE = Path(__file__).parent
ROOT = HERE.parents[2]
OURS = ("plant.py", "past_script.py", "forging.py")
"""What of this folder the past gets: nothing in it knows the present code."""


class NoPast(Exception):
    """The past is not there."""


class Past:
    """Implements :class:`tests.safety.attacks.adapter.Subject` over the code of 170fbcd."""

    def __init__(self, folder: Path) -> None:
        """``folder`` keeps the checkout and what is compiled for it. Raises NoPast where git has no history."""
        tree = folder / COMMIT
        if not (tree / "src").is_dir():
            _check_out(tree)
        ours = tree / "tests" / "safety" / "attacks"
        ours.mkdir(exist_ok=True)
        for name in OURS:
            if not (ours / name).exists() or (ours / name).read_bytes() != (HERE / name).read_bytes():
                shutil.copy(HERE / name, ours / name)
        code = (
            f"import sys, runpy; sys.path[:0] = [{str(tree / 'src')!r}, {str(tree)!r}]; "
            "runpy.run_module('tests.safety.attacks.past_script', run_name='__main__')"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", code], cwd=tree, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def supervise(self, attack: Attack) -> Report:
        return Report(**self._call("supervise", attack=as_data(attack)))

    def request(self, attack: Attack) -> Report:
        return Report(**self._call("request", attack=as_data(attack)))

    def batch(self, end_s: float) -> dict[str, Any]:
        return dict(self._call("batch", end_s=end_s))

    def loads(self, plant: str, file: str, before: str, after: str) -> str:
        return str(self._call("loads", plant=plant, file=file, before=before, after=after))

    def verifies(self, forgery: str) -> bool:
        return bool(self._call("verifies", forgery=forgery))

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()

    def _call(self, name: str, **rest: Any) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps({"call": name, **rest}) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, "the process of the past has ended"
        said = json.loads(line)
        assert "error" not in said, said["error"]
        return said["answer"]


def _check_out(tree: Path) -> None:
    parts = ["src", "tests/agents/scripted.py", "tests/safety/world.py", "tests/supervisor/line.py"]
    command = ["git", "-C", str(ROOT), "archive", "--format=tar", COMMIT, *parts]
    try:
        archive = subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise NoPast(f"commit {COMMIT} is not in this checkout's history, so it cannot be attacked") from error
    whole = Path(tempfile.mkdtemp(dir=tree.parent))
    with tarfile.open(fileobj=BytesIO(archive)) as files:
        # As an attribute, because the first releases of Python 3.11 have no such argument.
        files.extraction_filter = getattr(tarfile, "data_filter", None)  # type: ignore[assignment]
        files.extractall(whole)
    try:
        whole.rename(tree)
    except OSError:  # another process was first
        shutil.rmtree(whole)
