"""Is a run what it was when it was written, and does it agree with itself?"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from homeostat.journal.beside.files import JOURNAL, StoredFile, describe
from homeostat.journal.beside.manifest import BadManifest, Manifest, read_manifest
from homeostat.journal.chain import GENESIS, digest
from homeostat.journal.reading import BrokenChain, Record, scan
from homeostat.journal.signing.signatures import NOBODY, Signatures, Vouched
from homeostat.journal.verify.evidence import Evidence, condensed, result_values
from homeostat.journal.verify.meaning import contradictions


@dataclass(frozen=True, slots=True)
class Report:
    """What verification found."""

    lines: int
    """Number of lines, from the first, that what follows them confirms; of an incomplete run, all that follow."""
    complete: bool
    """Whether the run was closed and nothing of it is missing, altered or contradicted."""
    intact: bool
    """Whether nothing contradicts the record; an incomplete run may still be intact."""
    problem: str | None
    """The first problem in one sentence; None for a complete run."""
    contradictions: tuple[str, ...] = ()
    """Everything in which the record contradicts itself, one sentence each."""
    vouched: Vouched = NOBODY
    """Who vouches for it."""


def verify(run_dir: Path | str, keys: Collection[str] = ()) -> Report:
    """Check the journal's chain, its signatures and its meaning, the manifest and every file that the manifest names.

    ``keys``: public keys that the reader trusts, in hexadecimal; without any, every signature is a stranger's, which
    does not touch whether the run is complete. Files that were added after the run was closed are not covered. Without
    a manifest nothing confirms the last line. Raises OSError where a file cannot be read.
    """
    directory = Path(run_dir)
    journal = directory / JOURNAL
    if not journal.is_file():
        return _altered(
            0, f"{str(directory)!r} holds no {JOURNAL}: it is not a run directory, or the journal is missing"
        )
    lines, size, last = 0, 0, GENESIS
    signatures, records = Signatures(keys), list[Record]()
    try:
        for line in scan(journal):
            if problem := signatures.follow(line.record, last):
                return _altered(lines - 1, problem)
            lines, size, last = lines + 1, size + len(line.raw) + 1, digest(line.raw)
            records.append(condensed(line.record))
        manifest = read_manifest(directory)
    except BrokenChain as broken:
        return _altered(broken.verified, str(broken))
    except BadManifest as bad:
        return _altered(lines - 1, str(bad))
    torn = journal.stat().st_size > size
    vouched = signatures.judge(manifest, lines)
    if manifest is None:
        end = f"; line {lines + 1} is torn" if torn else ""
        report = Report(lines, False, True, f"incomplete run: verifies up to line {lines}{end}")
    else:
        report = _against_manifest(directory, manifest, lines, last, torn)
    return _with_meaning(replace(report, vouched=vouched), directory, records, manifest)


def lacking(run_dir: Path, lines: int) -> str:
    """What the journal of a run that was closed lacks, of which ``lines`` whole lines were read; empty for nothing.

    Only its end is looked at: `verify` looks at everything.
    """
    try:
        manifest = read_manifest(run_dir)
    except BadManifest as bad:
        return str(bad)
    return _cut(manifest, lines) if manifest is not None and lines < manifest.events else ""


def _cut(manifest: Manifest, lines: int) -> str:
    return f"the journal ends after line {lines}, {manifest.events} were written"


def _with_meaning(report: Report, directory: Path, records: list[Record], manifest: Manifest | None) -> Report:
    """The report with every contradiction; only a record that is intact is asked what it means."""
    if not report.intact:
        return report
    result = None if manifest is None else result_values(directory)
    found = tuple(contradictions(Evidence(tuple(records), manifest, result)))
    if not found:
        return report
    return replace(report, complete=False, intact=False, problem=found[0], contradictions=found)


def _against_manifest(directory: Path, manifest: Manifest, lines: int, last: str, torn: bool) -> Report:
    if lines < manifest.events:
        return _altered(lines - 1, _cut(manifest, lines))
    if lines == manifest.events and last != manifest.last:
        return _altered(lines - 1, f"line {lines}, the last, was altered: its digest is not the manifest's")
    if lines > manifest.events or torn:
        return _altered(manifest.events, f"something was added to the journal after line {manifest.events}, its last")
    if manifest.signature and not manifest.self_signed:
        return _altered(lines, "the manifest carries a signature that is not of its content")
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
