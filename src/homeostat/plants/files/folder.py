"""The files of a plant's folder, read once, and the folders of the installed plants."""

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


def plant_folder(name: str) -> Path:
    """Folder of the plant called ``name``, or the folder that ``name`` is a path of (it has a ``/``).

    Raises PlantError naming near matches where there is no such plant.
    """
    if ("/" in name or "\\" in name) and (Path(name) / SETTINGS).is_file():
        return Path(name).resolve()
    if name not in plant_names():
        known = plant_names()
        raise PlantError(f"unknown plant {name!r}{near_matches(name, known)}; installed: {', '.join(known)}")
    return INSTALLED / name
