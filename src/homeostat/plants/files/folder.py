"""The files of a plant's folder, read once."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.build.provenance import with_one_line_end
from homeostat.plants.error import PlantError

INSTALLED: Final = Path(__file__).resolve().parents[1]
"""Where the plants of this package are."""
SETTINGS: Final = "case.toml"
"""Name of the settings in a plant's folder."""
BASELINES: Final = "baseline.csv"
"""Name of the reference values in a plant's folder."""
SIGNATURE: Final = "plant.sig"
"""Name of the engineer's signature in a plant's folder; no part of what is signed."""
_LONGEST: Final = 200
"""Most characters of a name that a message shows."""
_TRUE: Final = ("true/*.py", "true/mismatches.toml")
_PATTERNS: Final = (SETTINGS, GRAPH, BASELINES, "engineering/*.csv", "*.py", *_TRUE)


@dataclass(frozen=True, slots=True)
class PlantFiles:
    """What a plant's folder held when it was read."""

    folder: Path
    """The folder."""
    contents: Mapping[str, bytes]
    """Name relative to the folder, with ``/`` -> content with LF at the end of every line."""

    @property
    def own_code(self) -> Mapping[str, bytes]:
        """Name -> content of every module that the plant brings."""
        return {name: content for name, content in self.contents.items() if name.endswith(".py")}

    def content(self, name: str) -> bytes:
        """Content of the file called ``name``; PlantError where there was none."""
        if name not in self.contents:
            raise PlantError(f"plant {str(self.folder)!r} has no file {name!r}")
        return self.contents[name]


def read_files(folder: Path) -> PlantFiles:
    """What configures the plant in ``folder``: settings, tables, generated files, and its own code.

    Raises PlantError where one of them is a link: what it leads to is nothing that anybody signs with the folder.
    """
    paths = [path for pattern in _PATTERNS for path in folder.glob(pattern) if path.is_file()]
    for path in paths:
        inside = [folder / name for name in (path.relative_to(folder), path.relative_to(folder).parent)]
        if linked := next((each for each in inside if each != folder and each.is_symlink()), None):
            name = linked.relative_to(folder).as_posix()
            raise PlantError(f"{name!r} of the plant {str(folder)!r} is a link; put what it leads to in its place")
    contents = {path.relative_to(folder).as_posix(): with_one_line_end(path.read_bytes()) for path in paths}
    return PlantFiles(folder, dict(sorted(contents.items())))


def is_plant(folder: Path) -> bool:
    """Whether ``folder`` is that of a plant."""
    try:
        return (folder / SETTINGS).is_file()
    except OSError:  # a name that is too long, a folder that may not be read
        return False


def lacking(folder: Path) -> str:
    """Why ``folder`` is no plant's, and what to do."""
    whole = shown(os.path.abspath(folder))
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


def shown(text: str) -> str:
    """``text`` as a message quotes it, cut where it is very long."""
    whole = repr(text)
    return whole if len(whole) <= _LONGEST else f"{whole[:_LONGEST]}..."
