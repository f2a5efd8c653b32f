"""The manifest that closes a run: what the journal and every other file of the run must be."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from homeostat import __version__
from homeostat.trace.chain import digest
from homeostat.trace.encode import canonical, encode_fields
from homeostat.trace.files import JOURNAL, MANIFEST, StoredFile, describe, write_whole

FORMAT = 1
"""Version of the run directory's format."""


class BadManifest(ValueError):
    """The manifest is not what was written; the message says so in one sentence."""


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run says of itself when it closes."""

    seed: int
    """Seed from which every random draw of the run followed."""
    outcome: str
    """How the run ended, one word or sentence."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """Content of ``manifest.json``."""

    format: int
    """Version of the run directory's format."""
    homeostat: str
    """Version of Homeostat that wrote the run."""
    seed: int
    """Seed of the run."""
    outcome: str
    """How the run ended."""
    events: int
    """Number of lines of the journal."""
    last: str
    """Digest of the journal's last line."""
    files: tuple[StoredFile, ...]
    """Every other file of the run, by name."""


def manifest_of(run_dir: Path, summary: Summary, events: int, last: str) -> Manifest:
    """The manifest for the files that ``run_dir`` holds now."""
    files = tuple(describe(path, run_dir) for path in sorted(_artifacts(run_dir)))
    return Manifest(FORMAT, __version__, summary.seed, summary.outcome, events, last, files)


def write_manifest(run_dir: Path, manifest: Manifest) -> None:
    """Write ``manifest.json`` in one step: after a crash it is there whole or not at all."""
    write_whole(run_dir / MANIFEST, _render(manifest))


def read_manifest(run_dir: Path) -> Manifest | None:
    """The run's manifest, or None where the run has not been closed; BadManifest when a byte of it has changed."""
    try:
        raw = (run_dir / MANIFEST).read_bytes()
    except FileNotFoundError:
        return None
    try:
        content = json.loads(raw)
        if content["format"] != FORMAT:
            raise BadManifest(f"{MANIFEST} has format {content['format']!r}, this version reads {FORMAT}")
        del content["sha256"]
        manifest = Manifest(**{**content, "files": tuple(StoredFile(**file) for file in content["files"])})
        intact = _render(manifest) == raw
    except BadManifest:
        raise
    except (ValueError, TypeError, KeyError, RecursionError):
        intact = False
    if not intact:
        raise BadManifest(f"{MANIFEST} was altered: it does not match its own digest")
    return manifest


def _render(manifest: Manifest) -> bytes:
    content = encode_fields(manifest, "manifest")
    content["files"] = [encode_fields(file, f"manifest file {file.name!r}") for file in manifest.files]
    content["sha256"] = digest(canonical(content).encode("ascii"))
    return (json.dumps(content, indent=1) + "\n").encode("ascii")


def _artifacts(run_dir: Path) -> Iterator[Path]:
    for path in run_dir.rglob("*"):
        if path.is_file() and path not in (run_dir / JOURNAL, run_dir / MANIFEST):
            yield path
