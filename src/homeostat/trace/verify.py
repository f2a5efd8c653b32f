"""Is a run what it was when it was written?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from homeostat.trace.chain import GENESIS, digest
from homeostat.trace.files import JOURNAL, StoredFile, describe
from homeostat.trace.manifest import BadManifest, Manifest, read_manifest
from homeostat.trace.replay import BrokenChain, scan


@dataclass(frozen=True, slots=True)
class Report:
    """What verification found."""

    lines: int
    """Number of lines, from the first, that what follows them confirms; of an incomplete run, all that follow."""
    complete: bool
    """Whether the run was closed and nothing of it is missing or altered."""
    intact: bool
    """Whether nothing contradicts the record; an incomplete run may still be intact."""
    problem: str | None
    """The first problem in one sentence; None for a complete run."""


def verify(run_dir: Path | str) -> Report:
    """Check the journal's chain, the manifest and every file that the manifest names.

    Files that were added after the run was closed are not covered. Without a manifest nothing confirms the last line.
    """
    directory = Path(run_dir)
    journal = directory / JOURNAL
    if not journal.is_file():
        return _altered(
            0, f"{str(directory)!r} holds no {JOURNAL}: it is not a run directory, or the journal is missing"
        )
    lines, size, last = 0, 0, GENESIS
    try:
        for line in scan(journal):
            lines, size, last = lines + 1, size + len(line.raw) + 1, digest(line.raw)
        manifest = read_manifest(directory)
    except BrokenChain as broken:
        return _altered(broken.verified, str(broken))
    except BadManifest as bad:
        return _altered(lines - 1, str(bad))
    torn = journal.stat().st_size > size
    if manifest is None:
        end = f"; line {lines + 1} is torn" if torn else ""
        return Report(lines, False, True, f"incomplete run: verifies up to line {lines}{end}")
    return _against_manifest(directory, manifest, lines, last, torn)


def _against_manifest(directory: Path, manifest: Manifest, lines: int, last: str, torn: bool) -> Report:
    if lines < manifest.events:
        return _altered(lines - 1, f"the journal ends after line {lines}, {manifest.events} were written")
    if lines == manifest.events and last != manifest.last:
        return _altered(lines - 1, f"line {lines}, the last, was altered: its digest is not the manifest's")
    if lines > manifest.events or torn:
        return _altered(manifest.events, f"something was added to the journal after line {manifest.events}, its last")
    for problem in _file_problems(directory, manifest.files):
        return _altered(lines, problem)
    return Report(lines, True, True, None)


def _file_problems(directory: Path, files: tuple[StoredFile, ...]) -> Iterator[str]:
    for file in files:
        path = PurePosixPath(file.name)
        if path.is_absolute() or ".." in path.parts:
            yield f"the manifest names {file.name!r}, which lies outside the run directory"
        elif not (directory / path).is_file():
            yield f"file {file.name!r} is missing"
        elif describe(directory / path, directory) != file:
            yield f"file {file.name!r} was altered: its size or digest is not the manifest's"


def _altered(lines: int, problem: str) -> Report:
    return Report(max(lines, 0), False, False, problem)
