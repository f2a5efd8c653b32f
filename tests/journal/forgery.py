"""What somebody with write access to a run may do: rewrite the journal and everything that follows from it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from homeostat.journal.chain import Chain, digest
from homeostat.journal.encode import canonical, encode_fields
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.signing.signing import Signer


def lines_of(directory: Path) -> list[dict[str, Any]]:
    """The journal's lines."""
    return [json.loads(line) for line in (directory / "events.jsonl").read_bytes().splitlines()]


def rewrite(directory: Path, lines: Sequence[dict[str, Any]], **manifest: Any) -> None:
    """Write ``lines`` as a whole new chain, and a manifest that agrees with it and has the values ``manifest``."""
    raw, last = b"", "0" * 64
    for number, content in enumerate(lines, start=1):
        line = canonical({**content, "seq": number, "prev": last}).encode()
        raw, last = raw + line + b"\n", digest(line)
    (directory / "events.jsonl").write_bytes(raw)
    path = directory / "manifest.json"
    if path.exists():
        remade = {**json.loads(path.read_bytes()), "events": len(lines), "last": last, **manifest}
        write_manifest(path, {name: value for name, value in remade.items() if value is not None})


def write_manifest(path: Path, content: dict[str, Any]) -> None:
    """A manifest with its own digest."""
    body = {name: value for name, value in content.items() if name != "sha256"}
    path.write_text(json.dumps({**body, "sha256": digest(canonical(body).encode())}, indent=1) + "\n")


def change(directory: Path, edit: Callable[[list[dict[str, Any]]], None]) -> None:
    """Change lines, forge the rest and take every signature out."""
    lines = [line for line in lines_of(directory) if line["event"] != "signed"]
    edit(lines)
    rewrite(directory, lines, key="", signature="")


def sign(directory: Path, key: SigningKey) -> None:
    """Sign a whole run anew, with a key of one's own."""
    lines = [line for line in lines_of(directory) if line["event"] != "signed"]
    rewrite(directory, lines)
    last = digest((directory / "events.jsonl").read_bytes().splitlines()[-1])
    signer, chain = Signer(key), Chain(len(lines), last, lines[-1]["at_s"])
    signed = {"at_s": chain.at_s, "event": "signed", **encode_fields(signer.signed(chain), "signed")}
    header = {"seq": 0, "prev": ""}
    rewrite(directory, [*lines, {**header, **signed}], key=key.public, signature="")
    write_signed(directory, signer)


def write_signed(directory: Path, signer: Signer) -> None:
    """The same manifest, with a signature."""
    content = json.loads((directory / "manifest.json").read_bytes())
    unsigned = {name: value for name, value in content.items() if name not in ("sha256", "signature")}
    write_manifest(directory / "manifest.json", {**unsigned, "signature": signer.sign_manifest(unsigned)})
