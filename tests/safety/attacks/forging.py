"""What somebody with write access does to a recorded run: one lie, and everything that follows from it made anew."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any


def forge(folder: Path, forgery: str, digest: Callable[[bytes], str]) -> None:
    """Tell the lie called ``forgery`` in the run in ``folder`` and chain journal and manifest anew.

    state: another state was entered; digest: other commands under the same digest; times: time runs backwards.
    """
    lines = [json.loads(raw) for raw in (folder / "events.jsonl").read_bytes().splitlines()]
    released = next(line for line in lines if line["event"] == "released")
    last = [line for line in lines if line["event"] == "state-entered"][-1]
    match forgery:
        case "state":
            last["state"] = "running"
        case "digest":
            released["commands"][0]["value"] = 0.05
        case "times":
            released["at_s"], last["at_s"] = 99999.0, -5.0
    raw, before = b"", "0" * 64
    for line in lines:
        line["prev"] = before
        text = _compact(line).encode("ascii")
        raw, before = raw + text + b"\n", digest(text)
    (folder / "events.jsonl").write_bytes(raw)
    path = folder / "manifest.json"
    manifest = {n: v for n, v in json.loads(path.read_bytes()).items() if n != "sha256"} | {"last": before}
    path.write_text(json.dumps({**manifest, "sha256": digest(_compact(manifest).encode())}, indent=1) + "\n")


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
