"""``homeostat trace verify``: is a recorded run what it was when it was written, and who vouches for it?"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.options.arguments import UsageError

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands
    from homeostat.journal import Report

OLDER = 3
"""Exit status for a run that nobody signed and whose format is older than signatures."""


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "verify",
        help="check that a recorded run is complete, unaltered and signed",
        description="Check the hash chain and the signatures of a run's journal, whether its events agree with one "
        "another, its manifest and every file that the manifest names. A key is trusted only from outside the run.",
        epilog="Exit status: 0 complete, unaltered and signed by a trusted key; 1 incomplete, altered, contradicting "
        "itself, signed by a stranger, without a signature or without a closing one; 2 not a run directory, or no key; "
        "3 without a signature and in the format from before runs were signed: it agrees with itself, and anybody may "
        "have written it.",
        allow_abbrev=False,
    )
    command.add_argument("run", type=Path, metavar="RUN", help="run directory")
    command.add_argument(
        "--key", action="append", metavar="PUBLIC",
        help="public key to trust: a file, or 32 bytes in hexadecimal or base64 (may be given several times; default: "
        "the installation's key)",
    )  # fmt: skip
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Print what was found; 0 where the run is whole and a trusted key vouches for it."""
    from homeostat.domain.quotation import printable
    from homeostat.journal import Signature
    from homeostat.journal.verify.verify import verify

    run_dir = run_directory(options.run)
    report = verify(run_dir, trusted(options.key))
    for line in _told(report):
        print(printable(f"{run_dir}: {line}"))
    if not report.complete:
        return 1
    return {Signature.TRUSTED: 0, Signature.OLDER: OLDER}.get(report.vouched.signature, 1)


def trusted(given: list[str] | None) -> Collection[str]:
    """The public keys to trust: those that were given, else the installation's, if it has one."""
    from homeostat.journal.signing.keys import installation_public, read_public

    if given:
        return {read_public(key) for key in given}
    own = installation_public()
    return set() if own is None else {own}


def run_directory(path: Path) -> Path:
    """``path`` where it holds, or held, a run; UsageError where it does not."""
    from homeostat.journal.files import JOURNAL, MANIFEST

    if not path.is_dir():
        raise UsageError(f"{str(path)!r} is not a directory; name a run directory")
    if not ((path / JOURNAL).exists() or (path / MANIFEST).exists()):
        raise UsageError(f"{str(path)!r} is not a run directory: it has no {JOURNAL}")
    return path


def _told(report: Report) -> Iterator[str]:
    """What was found, line by line; one where there is nothing but the first thing to say."""
    from homeostat.journal import Signature

    if report.contradictions:
        yield from (f"CONTRADICTION: {sentence}" for sentence in report.contradictions)
        yield _signature(report)
    elif not report.intact:
        yield f"ALTERED: {report.problem}"
    elif report.problem is not None:
        yield f"{report.problem}; {_signature(report)}"
    elif report.vouched.signature is Signature.TRUSTED:
        yield f"complete and unaltered, {report.lines} events; {_signature(report)}"
    else:
        yield f"complete and in agreement with itself, {report.lines} events; {_signature(report)}"


def _signature(report: Report) -> str:
    """Who vouches for the run, in words."""
    from homeostat.journal import Signature

    vouched = report.vouched
    covered = f"line {vouched.lines}" if vouched.lines else "no line"
    match vouched.signature:
        case Signature.TRUSTED:
            return f"signed by trusted key {vouched.key[:16]}"
        case Signature.STRANGER:
            return f"SIGNED BY A STRANGER: nobody vouches for key {vouched.key}; trusted up to {covered}"
        case Signature.NOT_CLOSED:
            return f"NO CLOSING SIGNATURE: what comes after {covered} is not signed by a trusted key"
        case Signature.OLDER:
            return "NOT SIGNED: it says that it was recorded before runs were signed, as anybody may have it say"
    return "NOT SIGNED: anybody may have written it"
