"""Blocks of which kernels are made: plain Python where Python calls them, machine code inside a kernel."""

import functools
import os
from collections.abc import Callable
from typing import Any, TypeVar, cast, final

F = TypeVar("F", bound=Callable[..., Any])


def interpreted() -> bool:
    """Whether nothing is to be compiled: NUMBA_DISABLE_JIT is set."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def compiled(function: F) -> F:
    """``function`` as a block: part of each kernel that calls it, and otherwise the Python that it is.

    Strict IEEE arithmetic (no fast-math): both give the same bits where a block has no transcendental functions, and
    a NaN stays a NaN that the engine can find. Inside a kernel a block becomes part of what calls it: a real call
    counts the users of every array that it is given, and that took a third of a kernel's time.
    """
    return function if interpreted() else cast(F, _Block(function))


def machine_code(block: F) -> F:
    """``block`` compiled for itself: for who calls it many times, or wants to see what a kernel will do with it."""
    return cast(F, block._compiled) if isinstance(block, _Block) else block


@final
class _Block:
    """A function that numba compiles where compiled code calls it; only then is numba loaded."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        """The function as plain Python."""
        functools.update_wrapper(self, function)

    def __call__(self, *args: Any) -> Any:
        return self.py_func(*args)

    @functools.cached_property
    def _compiled(self) -> Any:
        import numba

        return numba.njit(nogil=True, error_model="numpy", forceinline=True)(self.py_func)

    @functools.cached_property
    def _part(self) -> Any:
        """It as a part of kernels: without ways in from Python and C, which are a quarter of what is to be compiled."""
        import numba

        inside: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return numba.njit(nogil=True, error_model="numpy", forceinline=True, **inside)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """What numba takes it for where compiled code calls it."""
        return self._part._numba_type_
