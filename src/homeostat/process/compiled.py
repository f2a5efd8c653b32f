"""One way to compile scalar code, so that every kernel has the same settings."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import logging
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast, final

F = TypeVar("F", bound=Callable[..., Any])

_making = threading.RLock()


def compiled(function: F) -> F:
    """``function`` compiled on first use, cached on disk, and free of the interpreter lock.

    Strict IEEE arithmetic (no fast-math): the same inputs give the same bits on one and on many threads,
    and a NaN stays a NaN that the engine can find. Blocks become part of what calls them: a real call counts the
    users of every array that it is given, and that took a third of a kernel's time. Compiled code contains the code
    and the constants that it uses from other files, which numba's cache does not look at; so the cache has one folder
    per version of the sources, and a kernel uses compiled code of its own folder and of this package only.

    The compiler itself is loaded on first use as well: who only describes a plant does not wait for it.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return function
    return cast(F, _Compiled(function))


@final
class _Compiled:
    """A function that is compiled when it is called, or when a compiled function that calls it is."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        """The function as plain Python."""

    def __call__(self, *args: Any) -> Any:
        return self._kernel(*args)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._kernel, name)

    @property
    def _numba_type_(self) -> Any:
        """What numba takes it for where compiled code calls it."""
        return self._kernel._numba_type_

    @functools.cached_property
    def _kernel(self) -> Any:
        import numba

        folder = Path(inspect.getfile(self.py_func)).parent
        config: Any = numba.config
        with _making:
            usual = config.CACHE_DIR
            config.CACHE_DIR = str(_cache_base(folder, usual) / f"kernels-{_version(folder)}")
            try:
                kernel: Any = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(self.py_func)
            finally:
                config.CACHE_DIR = usual
        _watch(kernel._cache)
        return kernel


def _watch(cache: Any) -> None:
    """Say that it compiles where ``cache`` has nothing, and keep nothing where there is no room.

    A full disk must not stop what is compiled already.
    """
    load, save = cache.load_overload, cache.save_overload

    def load_or_say(*overload: object) -> Any:
        found = load(*overload)
        if found is None:
            _say_once()
        return found

    def save_if_there_is_room(*overload: object) -> None:
        with contextlib.suppress(OSError):
            save(*overload)

    cache.load_overload, cache.save_overload = load_or_say, save_if_there_is_room


@functools.cache
def _say_once() -> None:
    logging.getLogger(__name__).warning("compiling, once")


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
