"""``homeostat trace verify``: is a recorded run what it was when it was written, and who vouches for it?"""

import argparse
from collections.abc import Collection, Iterator

from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.journal import Report, Signature
from homeostat.journal.signing.keys import installation_public, read_public
from homeostat.journal.verify.verify import verify

OLDER = 3
"""Exit status for a run that nobody signed and whose format is older than signatures."""


def carry_out(options: argparse.Namespace) -> int:
    """Print what was found; 0 where the run is whole and a trusted key vouches for it."""
    run_dir = run_directory(options.run)
    report = verify(run_dir, trusted(options.key))
    for line in _told(report):
        print(printable(f"{run_dir}: {line}"))
    if not report.complete:
        return 1
    return {Signature.TRUSTED: 0, Signature.OLDER: OLDER}.get(report.vouched.signature, 1)


def trusted(given: list[str] | None) -> Collection[str]:
    """The public keys to trust: those that were given, else the installation's, if it has one."""
    if given:
        return {read_public(key) for key in given}
    own = installation_public()
    return set() if own is None else {own}


def _told(report: Report) -> Iterator[str]:
    """What was found, line by line; one where there is nothing but the first thing to say."""
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
