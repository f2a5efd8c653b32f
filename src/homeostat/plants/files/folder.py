"""The files of a plant's folder, read once, and the folders of the installed plants."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.build.provenance import with_one_line_end
from homeostat.plants.error import PlantError
from homeostat.stl.spelling import near_matches

INSTALLED: Final = Path(__file__).parents[1]
"""Where the installed plants are."""
SETTINGS: Final = "case.toml"
"""Name of the settings in a plant's folder."""
BASELINES: Final = "baseline.csv"
"""Name of the reference values in a plant's folder."""
SIGNATURE: Final = "plant.sig"
"""Name of the engineer's signature in a plant's folder; no part of what is signed."""
_LONGEST: Final = 200
"""Most characters of a name that a message shows."""
_PATTERNS: Final = (SETTINGS, GRAPH, BASELINES, "engineering/*.csv", "*.py")


@dataclass(frozen=True, slots=True)
class PlantFiles:
    """What a plant's folder held when it was read."""

    folder: Path
    """The folder."""
    contents: Mapping[str, bytes]
    """Name relative to the folder, with ``/`` -> content with LF at the end of every line."""

    def content(self, name: str) -> bytes:
        """Content of the file called ``name``; PlantError where there was none."""
        if name not in self.contents:
            raise PlantError(f"plant {str(self.folder)!r} has no file {name!r}")
        return self.contents[name]


def read_files(folder: Path) -> PlantFiles:
    """What configures the plant in ``folder``: settings, tables, generated files, and its own code."""
    paths = (path for pattern in _PATTERNS for path in folder.glob(pattern) if path.is_file())
    contents = {path.relative_to(folder).as_posix(): with_one_line_end(path.read_bytes()) for path in paths}
    return PlantFiles(folder, dict(sorted(contents.items())))


def plant_names() -> tuple[str, ...]:
    """Names of every plant that is installed."""
    return tuple(sorted(path.parent.name for path in INSTALLED.glob(f"*/{SETTINGS}")))


def is_path(name: str) -> bool:
    """Whether ``name`` is a path of a plant's folder rather than the name of an installed plant."""
    return "/" in name or "\\" in name


def plant_folder(name: str, base: Path = Path()) -> Path:
    """Folder of the plant called ``name``, or the folder that ``name`` is a path of, from ``base`` on (it has a ``/``).

    Raises PlantError with what there is, near matches and the remedy where there is no such plant, and TypeError where
    ``name`` is no text.
    """
    if not isinstance(name, str):
        raise TypeError(f"plant {name!r} must be a text: the name of an installed plant, or the path of a folder")
    known, shown = plant_names(), _short(name)
    there = _is_plant(base / name)
    if is_path(name):
        if there:
            return (base / name).resolve()
        raise PlantError(f"unknown plant {shown}: {_lacking(base / name)}; installed: {', '.join(known)}")
    if name in known:
        return INSTALLED / name
    own = f"for the folder {shown} write './{name}'" if there else "a folder is named by its path, as './my_plant'"
    raise PlantError(f"unknown plant {shown}{near_matches(name, known)}; installed: {', '.join(known)}; {own}")


def _is_plant(folder: Path) -> bool:
    try:
        return (folder / SETTINGS).is_file()
    except OSError:  # a name that is too long, a folder that may not be read
        return False


def _lacking(folder: Path) -> str:
    """Why ``folder`` is no plant's, and what to do."""
    whole = _short(os.path.abspath(folder))
    try:
        if not folder.exists():
            return f"there is no folder {whole}; correct the path"
        if not folder.is_dir():
            return f"{whole} is a file; give the folder that it is in"
        (folder / SETTINGS).stat()
    except FileNotFoundError:
        return f"the folder {whole} has no {SETTINGS}; give the folder of a plant"
    except OSError as error:
        return f"{whole} cannot be used: {error.strerror}; correct the path"
    return f"{SETTINGS} in the folder {whole} is no file; give the folder of a plant"


def _short(text: str) -> str:
    shown = repr(text)
    return shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}..."
