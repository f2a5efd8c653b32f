"""One way to compile scalar code, so that every kernel has the same settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """``function`` compiled on first use, cached on disk, and free of the interpreter lock.

    Strict IEEE arithmetic (no fast-math): the same inputs give the same bits on one and on many threads,
    and a NaN stays a NaN that the engine can find.
    """
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
