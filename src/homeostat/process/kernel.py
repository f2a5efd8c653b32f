"""A plant's kernel: compiled once, kept on disk as machine code, and loaded without the compiler.

numba compiles it; what comes out is an object file that LLVM's linker loads in a twentieth of the time that numba takes
to load itself. Own code, because numba's cache needs all of numba to be read and looks at one source file only.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import gc
import hashlib
import inspect
import logging
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, final

import numpy as np

from homeostat.process.compiled import compiled, interpreted
from homeostat.process.machine_code import MachineCode, cache_folder, keep, library, load, machine, read, sources
from homeostat.process.moves import Moves
from homeostat.process.moving import H, W, with_moves
from homeostat.process.types import Cube, Indices, Table, Vec

REAL, WHOLE = np.dtype(np.float64), np.dtype(np.int64)
NAMES = (
    *("states", "parameters", "severities", "onsets", "inputs", "input_of", "begin", "seeds", "process noise"),
    *("sensor noise", "picks", "record", "broken_at", "moves of members", "moved columns", "moves"),
)
TYPES = (*[REAL] * 5, *[WHOLE] * 3, *[REAL] * 2, WHOLE, *[REAL] * 2, *[WHOLE] * 2, REAL)
"""Names and types of the arrays that machine code takes, in its order; the room for its own use comes last."""
_address: Callable[[Any], Any] = (ctypes.c_char * 0).from_buffer
"""Where an array lies; TypeError if it is read-only or not in one piece."""
ARGUMENTS = (
    *[ctypes.c_int64] * 8,
    *[ctypes.c_double] * 2,
    *[ctypes.c_int64] * 2,
    *[ctypes.c_void_p] * (len(TYPES) + 1),
)
"""Sizes, times and addresses, for ctypes."""
UNREACHED = ("PyErr_", "PyExc_", "PyUnicode_FromString", "Py_DecRef", "numba_gil_", "NRT_MemInfo_call_dtor")
"""Beginnings of names that every kernel refers to where it would hand an error on; one that never raises calls none."""
_making = threading.RLock()


class Columns(NamedTuple):
    """How many columns the arrays of one process have."""

    states: int
    parameters: int
    faults: int
    inputs: int


def kernel(
    columns: Columns, scratch: int, parts: ModuleType | None = None
) -> Callable[[Callable[..., None]], CompiledKernel]:
    """A decorator: the function as a :class:`CompiledKernel` with ``scratch`` numbers of room for its own use.

    ``parts`` is a module in another folder whose blocks it is made of.

    TypeError where the function takes values from around it: machine code is found again by its sources.

    The function takes what a kernel takes and an array of ``scratch`` numbers more. It is made of
    :func:`~homeostat.process.compiled.compiled` blocks; it neither raises nor allocates (no ``np.empty``, no slices
    assigned to slices).
    """

    def made(function: Callable[..., None]) -> CompiledKernel:
        if function.__closure__:
            raise TypeError(f"kernel {function.__qualname__} depends on what is around it; make that a parameter")
        return CompiledKernel(function, columns, scratch, parts)

    return made


@final
class CompiledKernel:
    """A :class:`~homeostat.process.batch.Kernel` of machine code, for any number of threads at once."""

    def __init__(
        self,
        function: Callable[..., None],
        columns: Columns,
        scratch: int,
        parts: ModuleType | None = None,
        source: str | None = None,
        tick_s: float = 1.0,
    ) -> None:
        """``source``: what ``function`` was made of, where it was written by a program and stands in no file.

        ``tick_s``: process time by which ``function`` goes on with each row of inputs [s].
        """
        self.py_func = function
        """The kernel as plain Python."""
        self.tick_s = tick_s
        """Process time of one step [s]."""
        written = (function, parts) if source is None else ()
        self._folders = tuple(Path(inspect.getfile(part)).parent for part in written if part)
        self._columns, self._scratch, self._source = columns, scratch, source

    def __call__(
        self, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
        begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
        broken_at: Vec, moves: Moves | None = None,
    ) -> None:  # fmt: skip
        """Advance the members as a kernel does.

        Raises:
            ValueError: an array does not have the columns of the process, or not one line for each member.
            TypeError: an array is of another type, may not be written, or does not lie in one piece.
        """
        m = Moves.none(len(x)) if moves is None else moves
        moved = (m.begin, m.what, m.how)
        arrays = (x, p, sev, onset, u, u_of, begin, seeds, process, sensor, picks, out, broken_at, *moved)
        self._check(arrays, first, last)
        work = np.zeros(self._scratch)
        if interpreted():
            given = (x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks, out)
            with_moves(self.py_func)(self.tick_s, first, last, *given, broken_at, *moved, work)
            return
        sizes = (len(x), len(u), u.shape[1], out.shape[1], len(picks), len(m.what))
        self._code(first, last, *sizes, self.tick_s, t0, steps, stride, *map(_address, arrays), _address(work))

    def _check(self, arrays: tuple[np.ndarray, ...], first: int, last: int) -> None:
        """Refuse what machine code would misread: it looks at nothing but addresses and sizes."""
        x, p, sev, onset, u, u_of, begin, seeds, process, sensor, picks, out, broken_at, moves_of, what, how = arrays
        members, columns = len(x), self._columns
        tables = (x.shape, p.shape, sev.shape, onset.shape)
        if tables != tuple((members, columns[i]) for i in (0, 1, 2, 2)) or u.ndim != 3 or u.shape[2] != columns.inputs:
            raise ValueError("states, parameters, severities or inputs do not have the columns of the layout")
        rows = (u_of.shape, begin.shape, seeds.shape, process.shape, sensor.shape, broken_at.shape)
        if rows != ((members,),) * 6 or out.ndim != 3 or out.shape[::2] != (members, *picks.shape):
            raise ValueError(f"an array does not have one value for each of {members} members, or for each pick")
        if moves_of.shape != (members + 1,) or what.shape != (len(what), len(W)) or how.shape != (len(what), len(H)):
            raise ValueError(f"the moves are not those of {members} members, or their columns are not the engine's")
        if not 0 <= first <= last <= members:
            raise ValueError(f"members {first} to {last} must lie in 0 to {members}")
        for name, array, dtype in zip(NAMES, arrays, TYPES, strict=True):
            if array.dtype != dtype:
                raise TypeError(f"{name} holds {array.dtype}; a kernel takes {dtype}")

    def load(self) -> None:
        """Compile it, or read what was compiled, now and not with the first call."""
        if not interpreted():
            _ = self._code

    @functools.cached_property
    def _code(self) -> Callable[..., None]:
        with _making:
            made_of = self._folders[0] if self._folders else Path(__file__).parent
            file = cache_folder(made_of) / f"{self.py_func.__module__}.{self._version()}.o"
            kept = read(file)
            if kept is not None:
                with contextlib.suppress(RuntimeError):  # what cannot be linked is compiled again
                    return load(kept, ARGUMENTS)
            logging.getLogger(__name__).warning("compiling, once")
            made = self._compile()
            code = load(made, ARGUMENTS)
            keep(file, made)
            return code

    def _version(self) -> str:
        """Digest of everything that the machine code follows from: sources, kernel, compiler, processor."""
        made = (self.py_func.__qualname__, self.py_func.__code__.co_firstlineno, self._source)
        mine = (*made, *self._columns, self._scratch)
        options = sorted(item for item in os.environ.items() if item[0].startswith("NUMBA_") and "CACHE" not in item[0])
        return hashlib.sha256(f"{sources(*self._folders)} {mine} {options}".encode()).hexdigest()[:16]

    def _compile(self) -> MachineCode:
        import llvmlite.binding as llvm
        import numba

        cfunc: Any = numba.cfunc
        with _no_garbage():
            entry = cfunc(_signature(numba), error_model="numpy", boundscheck=False)(self._entry())
        module = llvm.parse_assembly(entry.inspect_llvm())
        called = {function.name for function in module.functions if function.is_declaration}
        data = {variable.name for variable in module.global_variables if variable.is_declaration}
        for name in sorted(called | data):
            if not name.startswith(("llvm.", *UNREACHED)) and not hasattr(library(), name):
                raise TypeError(
                    f"kernel of {self.py_func.__module__} calls {name}, which needs the interpreter: it raises an "
                    "error, allocates an array, or uses what only numba has; write it with plain arithmetic and math, "
                    "let broken_at say what is wrong, and use the room that it is given"
                )
        return MachineCode(entry.native_name, tuple(sorted(called | data)), machine(llvm).emit_object(module))

    def _entry(self) -> Callable[..., None]:
        """The kernel as C sees it: sizes, times, then the addresses of the arrays."""
        from numba import carray  # type: ignore[attr-defined]

        advance, room, whats, hows = compiled(with_moves(compiled(self.py_func))), self._scratch, len(W), len(H)
        states, parameters, faults, inputs = self._columns

        def entry(  # type: ignore[no-untyped-def]
            first, last, members, schedules, cover, rows, picked, moved, tick, t0, steps, stride, x, p, sev, onset, u,
            u_of, begin, seeds, process, sensor, picks, out, broken_at, moves_of, what, how, work,
        ) -> None:  # fmt: skip
            advance(
                tick, first, last, carray(x, (members, states)), carray(p, (members, parameters)),
                carray(sev, (members, faults)), carray(onset, (members, faults)),
                carray(u, (schedules, cover, inputs)), carray(u_of, (members,)), t0, carray(begin, (members,)), steps,
                stride, carray(seeds, (members,)), carray(process, (members,)), carray(sensor, (members,)),
                carray(picks, (picked,)), carray(out, (members, rows, picked)), carray(broken_at, (members,)),
                carray(moves_of, (members + 1,)), carray(what, (moved, whats)), carray(how, (moved, hows)),
                carray(work, (room,)),
            )  # fmt: skip

        return entry


@contextlib.contextmanager
def _no_garbage() -> Iterator[None]:
    """Nobody looks for what may be freed: a compiler keeps nearly all it makes, and a tenth of its time went there."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _signature(numba: Any) -> Any:
    """What :meth:`CompiledKernel._entry` takes, for numba."""
    types = numba.types
    pointers = {REAL: types.CPointer(types.float64), WHOLE: types.CPointer(types.int64)}
    return types.void(
        *[types.int64] * 8, *[types.float64] * 2, *[types.int64] * 2, *(pointers[dtype] for dtype in (*TYPES, REAL))
    )
