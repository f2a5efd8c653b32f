"""``homeostat plant doc``: a plant on one page, from its tables and settings."""

import argparse
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.journal.beside.files import write_whole
from homeostat.plants.described import read_described
from homeostat.plants.page.page import page


def carry_out(options: argparse.Namespace) -> int:
    """Write the page and say where it is; 0."""
    plant = read_described(options.case)
    path: Path = options.out or Path(f"{plant.name}.html")
    if path.is_dir():
        raise UsageError(f"{str(path)!r} is a folder; name the file to write with --out FILE")
    if path.exists() and not options.force:
        raise UsageError(f"{str(path)!r} is there already; --force replaces it, --out FILE names another one")
    write_whole(path, page(plant).encode())
    print(f"{path.resolve()}: {plant.settings.title}, on one page")
    return 0
