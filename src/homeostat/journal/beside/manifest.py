"""The manifest that closes a run: what the journal and every other file of the run must be."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, get_type_hints

from homeostat import __version__
from homeostat.journal.beside.files import JOURNAL, MANIFEST, StoredFile, describe, write_whole
from homeostat.journal.chain import digest
from homeostat.journal.encode import Json, canonical, encode_fields
from homeostat.journal.signing.signing import Signer, signs_manifest

UNSIGNED_FORMAT = 1
"""The format before signatures, which is still read."""
FORMAT = 3
"""Version of the run directory's format; before 3, some events had other names (`homeostat.journal.reading.FORMER`)."""
OLDER_KINDS: Final = frozenset(
    {"run-started", "run-finished", "noticed", "deviated", "retrieved", "diagnosed", "fallback-armed", "model-called"}
    | {"attempted", "gave-up", "no-action", "released", "state-entered", "fallback-activated"}
)
"""Every kind of event that the format before signatures knew."""
_SINCE_2 = ("configuration", "key", "signature")
"""Fields that the format before does not have."""


class BadManifest(ValueError):
    """The manifest is not what was written; the message says so in one sentence."""


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run says of itself when it closes."""

    seed: int
    """Seed from which every random draw of the run followed."""
    outcome: str
    """How the run ended, one word or sentence."""
    configuration: str = ""
    """Digest of the configuration that the run was made with; empty where there is none."""


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
    configuration: str = ""
    """Digest of the configuration that the run was made with; empty where there is none."""
    key: str = ""
    """Public key of the signature, in hexadecimal; empty where there is none."""
    signature: str = ""
    """Signature over all the rest, in hexadecimal; empty where there is none."""

    @property
    def self_signed(self) -> bool:
        """Whether the signature is by ``key`` and of this content; who holds the key is another question."""
        return bool(self.signature) and signs_manifest(_unsigned(self), self.key, self.signature)


def manifest_of(run_dir: Path, summary: Summary, events: int, last: str, signer: Signer | None = None) -> Manifest:
    """The manifest for the files that ``run_dir`` holds now, signed by ``signer`` where there is one."""
    files = tuple(describe(path, run_dir) for path in sorted(_artifacts(run_dir)))
    manifest = Manifest(FORMAT, __version__, summary.seed, summary.outcome, events, last, files, summary.configuration)
    if signer is None:
        return manifest
    manifest = replace(manifest, key=signer.public)
    return replace(manifest, signature=signer.sign_manifest(_unsigned(manifest)))


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
        if content["format"] not in range(UNSIGNED_FORMAT, FORMAT + 1):
            raise BadManifest(f"{MANIFEST} has format {content['format']!r}, this version reads up to {FORMAT}")
        del content["sha256"]
        manifest = Manifest(**{**content, "files": tuple(StoredFile(**file) for file in content["files"])})
        intact = _is_typed(manifest) and all(map(_is_typed, manifest.files)) and _render(manifest) == raw
    except BadManifest:
        raise
    except (ValueError, TypeError, KeyError, RecursionError):
        intact = False
    if not intact:
        raise BadManifest(f"{MANIFEST} was altered: it does not match its own digest")
    return manifest


def _is_typed(record: Manifest | StoredFile) -> bool:
    """Whether numbers are numbers and texts are texts: a forger may write anything."""
    hints = get_type_hints(type(record))
    return all(type(getattr(record, name)) is kind for name, kind in hints.items() if kind in (int, str))


def _content(manifest: Manifest) -> dict[str, Json]:
    content = encode_fields(manifest, "manifest")
    content["files"] = [encode_fields(file, f"manifest file {file.name!r}") for file in manifest.files]
    if manifest.format == UNSIGNED_FORMAT:
        content = {name: value for name, value in content.items() if name not in _SINCE_2}
    return content


def _unsigned(manifest: Manifest) -> dict[str, Json]:
    return {name: value for name, value in _content(manifest).items() if name != "signature"}


def _render(manifest: Manifest) -> bytes:
    content = _content(manifest)
    content["sha256"] = digest(canonical(content).encode("ascii"))
    return (json.dumps(content, indent=1) + "\n").encode("ascii")


def _artifacts(run_dir: Path) -> Iterator[Path]:
    for path in run_dir.rglob("*"):
        if path.is_file() and path not in (run_dir / JOURNAL, run_dir / MANIFEST):
            yield path
