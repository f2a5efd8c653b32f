"""Copies of plants that ship, for a mistake in them."""

from __future__ import annotations

import shutil
from pathlib import Path

from homeostat.plants.files.folder import INSTALLED


def copied(name: str, folder: Path) -> Path:
    """The plant that ships as ``name``, in ``folder``, without what is generated."""
    ignored = shutil.ignore_patterns("plant.ttl", "__pycache__")
    return Path(shutil.copytree(INSTALLED / name, folder / f"{name}_copy", ignore=ignored))
