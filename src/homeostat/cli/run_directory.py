"""Where a run was recorded."""

from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.journal.beside.files import JOURNAL, MANIFEST


def run_directory(path: Path) -> Path:
    """``path`` where it holds, or held, a run; UsageError where it does not."""
    if not path.is_dir():
        raise UsageError(f"{str(path)!r} is not a directory; name a run directory")
    if not ((path / JOURNAL).exists() or (path / MANIFEST).exists()):
        raise UsageError(f"{str(path)!r} is not a run directory: it has no {JOURNAL}")
    return path
