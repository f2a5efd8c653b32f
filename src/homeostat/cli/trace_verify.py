"""``homeostat trace verify``: is a recorded run what it was when it was written?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.arguments import UsageError

if TYPE_CHECKING:
    from homeostat.cli.arguments import Commands


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "verify",
        help="check that a recorded run is complete and unaltered",
        description="Check the hash chain of a run's journal, its manifest and every file that the manifest names.",
        epilog="Exit status: 0 complete and unaltered, 1 incomplete or altered, 2 not a run directory.",
        allow_abbrev=False,
    )
    command.add_argument("run", type=Path, metavar="RUN", help="run directory")
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Print one line; 0 where the run is whole, 1 where it is not."""
    from homeostat.trace import verify

    run_dir = run_directory(options.run)
    report = verify(run_dir)
    if report.complete:
        print(f"{run_dir}: complete and unaltered, {report.lines} events")
        return 0
    print(f"{run_dir}: {'' if report.intact else 'ALTERED: '}{report.problem}")
    return 1


def run_directory(path: Path) -> Path:
    """``path`` where it holds, or held, a run; UsageError where it does not."""
    from homeostat.trace.files import JOURNAL, MANIFEST

    if not path.is_dir():
        raise UsageError(f"{str(path)!r} is not a directory; name a run directory")
    if not ((path / JOURNAL).exists() or (path / MANIFEST).exists()):
        raise UsageError(f"{str(path)!r} is not a run directory: it has no {JOURNAL}")
    return path
