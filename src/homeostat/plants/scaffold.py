"""A scaffold: the folder of a small plant that runs at once, for an engineer to change into their own."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Final

from homeostat.journal.beside.files import write_whole
from homeostat.knowledge.build.tables.check import mistakes
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS, shown
from homeostat.plants.files.places import plant_names

SCAFFOLDS: Final = Path(__file__).resolve().parent / "scaffolds"
"""A folder for each kind of plant, with ``$plant`` where the plant's name stands."""
NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
"""What a plant may be called: its name is part of an IRI, and of names in its graph."""
_PLANT: Final = b"$plant"
_PATTERNS: Final = (SETTINGS, "*.py", "engineering/*.csv")


def scaffold_names() -> tuple[str, ...]:
    """Kinds of plants that there is a scaffold of."""
    return tuple(sorted(path.name for path in SCAFFOLDS.iterdir() if path.is_dir()))


def make_plant(folder: Path, like: str) -> tuple[str, ...]:
    """Write the scaffold ``like`` into ``folder``, which is new or empty; the names of its files.

    The plant is called after the folder. It is there as a whole or not at all: settings come last, and what fails
    takes everything away again.

    Raises PlantError where the name cannot be a plant's or is taken, or the folder holds something, and OSError where
    it cannot be written.
    """
    name = folder.resolve().name
    _refuse_name(name)
    template = SCAFFOLDS / like
    paths = sorted(path for pattern in _PATTERNS for path in template.glob(pattern))
    contents = {path.relative_to(template): path.read_bytes().replace(_PLANT, name.encode()) for path in paths}
    made = _empty(folder)
    inside = folder / f".new.{os.getpid()}.partial"
    moved: list[Path] = []
    try:
        for file, content in contents.items():
            (inside / file).parent.mkdir(parents=True, exist_ok=True)
            write_whole(inside / file, content)
        _refuse_ambiguous(name, inside)
        for entry in sorted(inside.iterdir(), key=lambda path: path.name == SETTINGS):
            moved.append(entry.rename(folder / entry.name))
        inside.rmdir()
    except BaseException:
        for path in (inside, *moved):
            _remove(path)
        if made:
            folder.rmdir()
        raise
    return tuple(file.as_posix() for file in contents)


def _refuse_name(name: str) -> None:
    """PlantError where ``name`` is none for a plant, or another one has it."""
    if not NAME.fullmatch(name):
        rule = "1 to 40 letters of the English alphabet, digits and _, beginning with a letter"
        raise PlantError(f"a plant cannot be called {shown(name)}, as its folder is: a name has {rule}; choose another")
    if name in plant_names():
        raise PlantError(f"there is a plant called {shown(name)} already, and a folder names its plant; choose another")


def _refuse_ambiguous(name: str, folder: Path) -> None:
    """PlantError where something of the scaffold in ``folder`` is called ``name``, too."""
    for mistake in mistakes(folder):
        raise PlantError(f"the scaffold calls something {shown(name)} itself ({mistake}); choose another name")


def _empty(folder: Path) -> bool:
    """Make ``folder`` where it is not there, and say whether; PlantError where it is no empty folder."""
    whole = shown(os.path.abspath(folder))
    try:
        folder.mkdir()
    except FileNotFoundError:
        lacks = f"there is no folder {shown(str(folder.parent))}"
        raise PlantError(f"{whole} cannot be made: {lacks}; make it first") from None
    except FileExistsError:
        if not folder.is_dir():
            raise PlantError(f"{whole} is no folder; name one that is new or empty") from None
        if held := sorted(path.name for path in folder.iterdir()):
            more = f" and {len(held) - 1} more" if held[1:] else ""
            what = f"it holds {held[0]!r}{more}"
            raise PlantError(f"{whole} is not empty: {what}; name a folder that is new or empty") from None
        return False
    return True


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
