"""The tables of the shipped plants with every row stated, in a folder that nobody changes."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

from homeostat.knowledge.build.whole import write_whole
from homeostat.plants.files.folder import INSTALLED


@cache
def whole(plant: str) -> Path:
    """A folder with the settings of ``plant``, its graph as it ships, and all of its tables."""
    place = Path(tempfile.mkdtemp(prefix="whole-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    folder = place / plant
    write_whole(INSTALLED / plant, folder)
    for name in ("case.toml", "plant.ttl"):
        shutil.copy(INSTALLED / plant / name, folder)
    return folder
