"""Whether the interpreter keeps what it has compiled: what it does not keep is compiled anew at every start."""

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Final

LOADED: Final = ("homeostat.service.keeping.attach", "asyncua.ua.object_ids")
"""A module of each package that takes long to compile; both are loaded by whoever attaches."""


def recompiled() -> str:
    """Why every start is slow, in one line with the remedy, once a plant's link was loaded; empty where it is not."""
    folders = [folder for folder in map(_not_kept, LOADED) if folder]
    if not folders:
        return ""
    names = " ".join(folders)
    return (
        f"the code in {names} is compiled anew at every start, so that a guard is away for seconds longer; have who "
        f"installed it run '{sys.executable} -m compileall -q {names}' once"
    )


def _not_kept(module: str) -> str:
    """The folder of the package that ``module`` is of, where that is not kept as it was compiled; else empty."""
    spec, package = find_spec(module), find_spec(module.partition(".")[0])
    assert spec is not None and package is not None and package.origin is not None
    kept = spec.cached is not None and Path(spec.cached).exists()
    return "" if kept else str(Path(package.origin).parent)
