"""On a terminal a run is shown live; with JSON, standard output stays clean even then."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
from pathlib import Path

from tests.cli.command import COMMAND, environment

ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def on_terminal(cwd: Path, *arguments: str, both: bool, **extra: str) -> tuple[int, str, str]:
    """Status, what the terminal got, and what standard output got where the terminal is only for errors."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, *arguments], cwd=cwd, stdin=subprocess.DEVNULL, stdout=theirs if both else subprocess.PIPE,
        stderr=theirs, env={**environment(), "TERM": "xterm-256color", "COLUMNS": "110", **extra},
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    while True:
        try:
            block = os.read(ours, 65536)
        except OSError:  # the other side is closed
            break
        if not block:
            break
        shown += block
    os.close(ours)
    out, _ = process.communicate(timeout=240)
    return process.returncode, shown.decode(), (out or b"").decode()


def test_a_terminal_sees_the_plant_live(tmp_path: Path) -> None:
    arguments = ("run", "cstr", "--fault", "leak", "--onset", "650", "--end", "700", "--out", "run")
    status, shown, _ = on_terminal(tmp_path, *arguments, both=True)
    plain = ESCAPE.sub("", shown)
    assert status in (0, 3) and ESCAPE.search(shown)
    assert "650 s  onset     Leak of the vessel" in plain
    assert re.search(r"starting|watching", plain) and re.search(r"T1 +\d+\.\d+ K  L1 +-?\d+\.\d+ L", plain)
    assert shown.rindex("\x1b[?25h") > shown.rindex("\x1b[?25l")  # the cursor is back


def test_no_colour_where_none_is_wanted(tmp_path: Path) -> None:
    _, shown, _ = on_terminal(tmp_path, "run", "cstr", "--end", "50", "--out", "run", both=True, NO_COLOR="1")
    assert not re.search(r"\x1b\[[0-9;]*3[0-7]m", shown)


def test_json_stays_clean_beside_a_terminal(tmp_path: Path) -> None:
    status, shown, out = on_terminal(tmp_path, "run", "cstr", "--end", "700", "--json", both=False)
    assert status == 0 and json.loads(out)["outcome"] == "no_action"
    assert "no fault" in ESCAPE.sub("", shown)
