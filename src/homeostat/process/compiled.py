"""One way to compile scalar code, so that every kernel has the same settings."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """``function`` compiled on first use, cached on disk, and free of the interpreter lock.

    Strict IEEE arithmetic (no fast-math): the same inputs give the same bits on one and on many threads,
    and a NaN stays a NaN that the engine can find. Blocks become part of what calls them: a real call counts the
    users of every array that it is given, and that took a third of a kernel's time. Compiled code contains the code
    and the constants that it uses from other files, which numba's cache does not look at; so the cache has one folder
    per version of the sources, and a kernel uses compiled code of its own folder and of this package only.
    """
    folder = Path(inspect.getfile(function)).parent
    config: Any = numba.config
    usual = config.CACHE_DIR
    config.CACHE_DIR = str(_cache_base(folder, usual) / f"kernels-{_version(folder)}")
    try:
        kernel: Any = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function)
    finally:
        config.CACHE_DIR = usual
    if kernel is not function:  # it is where numba is told not to compile
        _spare(kernel._cache)
    return cast(F, kernel)


def _spare(cache: Any) -> None:
    """Have ``cache`` keep nothing where there is no room: a full disk must not stop what is compiled already."""
    save = cache.save_overload

    def save_if_there_is_room(*overload: object) -> None:
        with contextlib.suppress(OSError):
            save(*overload)

    cache.save_overload = save_if_there_is_room


def _cache_base(folder: Path, chosen: str) -> Path:
    """Where compiled code is kept: ``chosen`` (NUMBA_CACHE_DIR), beside the source, or in the user's cache."""
    if chosen:
        return Path(chosen)
    if os.access(folder, os.W_OK):
        return folder / "__pycache__"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "homeostat"


@functools.cache
def _version(folder: Path) -> str:
    """Digest of everything that code compiled from ``folder`` may contain."""
    digest = hashlib.sha256()
    for source in sorted({*folder.glob("*.py"), *Path(__file__).parent.glob("*.py")}):
        digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
