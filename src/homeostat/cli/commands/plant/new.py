"""``homeostat plant new``: a folder with a small plant that runs at once."""

import argparse
from pathlib import Path

from homeostat.plants.scaffold import make_plant


def carry_out(options: argparse.Namespace) -> int:
    """Write the folder and say what to do next; 0."""
    folder: Path = options.folder
    files = make_plant(folder, options.like)
    print(f"{folder}: {len(files)} files of a plant like {options.like!r}; process.py says what to change first")
    named = folder.as_posix() if "/" in folder.as_posix() else f"./{folder.as_posix()}"
    print(f"homeostat plant learn {named} learns what is normal; then it can be run")
    return 0
