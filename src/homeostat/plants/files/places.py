"""Where plants are: in this package, in folders that a user names once and for all, and in other installed packages."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final

from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, SETTINGS, is_plant, lacking, shown
from homeostat.stl.spelling import near_matches

VARIABLE: Final = "HOMEOSTAT_PLANTS"
"""Folders that hold plants' folders, or are one, separated as in ``PATH``."""
GROUP: Final = "homeostat.plants"
"""Entry points of other packages: the name of a plant -> the package whose folder it is, as ``packing.line_3``."""


def shipped_names() -> tuple[str, ...]:
    """Names of the plants of this package."""
    return tuple(sorted(path.name for path in INSTALLED.iterdir() if is_plant(path)))


def plant_names() -> tuple[str, ...]:
    """Names of every plant that has one."""
    return tuple(sorted(_places(troubles=[])))


def troubles() -> tuple[str, ...]:
    """Why something that says where plants are leads to none, one line each."""
    found: list[str] = []
    _places(found)
    return tuple(found)


def is_path(name: str) -> bool:
    """Whether ``name`` is a path of a plant's folder rather than the name of a plant."""
    return "/" in name or "\\" in name


def plant_folder(name: str, base: Path = Path()) -> Path:
    """Folder of the plant called ``name``, or the folder that ``name`` is a path of, from ``base`` on.

    A name without a ``/`` is that of a folder in ``base`` only where no plant is called so. Raises PlantError with what
    there is, near matches and the remedy where there is no such plant, or several have the name, and TypeError where
    ``name`` is no text.
    """
    if not isinstance(name, str):
        raise TypeError(f"plant {name!r} must be a text: the name of a plant, or the path of a folder")
    if is_path(name):
        if is_plant(base / name):
            return (base / name).resolve()
        installed = ", ".join(shipped_names())
        raise PlantError(f"unknown plant {shown(name)}: {lacking(base / name)}; installed: {installed}")
    found: list[str] = []
    places = _places(found)
    if name in places:
        return _only(name, places)
    if name and is_plant(base / name):
        return (base / name).resolve()
    known = sorted(places)
    text = f"unknown plant {shown(name)}{near_matches(name, known)}; installed: {', '.join(known)}"
    raise PlantError("; ".join((text, "a folder is named by its path, as './my_plant'", *found)))


def _only(name: str, places: Mapping[str, list[Path]]) -> Path:
    """The one folder of the plant called ``name``: which of two is meant nobody can tell."""
    first, *others = places[name]
    if others:
        where = " and ".join(repr(str(folder)) for folder in places[name])
        raise PlantError(f"several plants are called {shown(name)}: {where}; name one by its path")
    return first


def _places(troubles: list[str]) -> Mapping[str, list[Path]]:
    """Name -> every folder that is a plant's of that name; ``troubles`` takes why something leads to none."""
    found: dict[str, list[Path]] = {}
    shipped = (INSTALLED / name for name in shipped_names())
    for folder in (*shipped, *_own_folders(troubles), *_of_packages(troubles)):
        same = found.setdefault(folder.name, [])
        if folder not in same:
            same.append(folder)
    return found


def _own_folders(troubles: list[str]) -> Iterator[Path]:
    """The plants of the folders that the user's variable names."""
    for text in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        folder = Path(text)
        try:
            inside = sorted(folder.iterdir())
        except OSError as error:
            troubles.append(f"{VARIABLE} names {shown(text)}, which is no folder to read: {error.strerror}; correct it")
            continue
        yield from (each.resolve() for each in (folder, *inside) if is_plant(each))


def _of_packages(troubles: list[str]) -> Iterator[Path]:
    """The plants of other installed packages; none of their code is run to find them."""
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        parts = entry.value.split(".")
        folders = (Path(place or ".", *parts) for place in sys.path)
        folder = next((each.resolve() for each in folders if is_plant(each)), None)
        if folder is None:
            troubles.append(f"{_told(entry)}, and no such folder has a {SETTINGS}; install it again, or remove it")
        elif folder.name != entry.name:
            troubles.append(f"{_told(entry)}, a folder of another name; give both the same")
        else:
            yield folder


def _told(entry: EntryPoint) -> str:
    package = entry.dist.name if entry.dist is not None else "a package"
    return f"{package} offers the plant {shown(entry.name)} in {shown(entry.value)}"
