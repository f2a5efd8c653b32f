"""A plant's kernel: compiled once, kept on disk as machine code, and loaded without the compiler.

numba compiles it; what comes out is an object file that LLVM's linker loads in a twentieth of the time that numba takes
to load itself. Own code, because numba's cache needs all of numba to be read and looks at one source file only.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import inspect
import logging
import os
import threading
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np

from homeostat.process.compiled import compiled, interpreted
from homeostat.process.types import Cube, Indices, Table, Vec

REAL, WHOLE = np.dtype(np.float64), np.dtype(np.int64)
TYPES = (*[REAL] * 5, *[WHOLE] * 3, *[REAL] * 2, WHOLE, *[REAL] * 3)
"""Types of the arrays that machine code takes, in its order."""
_address: Callable[[Any], Any] = (ctypes.c_char * 0).from_buffer
"""Where an array lies; TypeError if it is read-only or not in one piece."""
NEVER = ("numba_do_raise", "NRT_Allocate", "NRT_MemInfo_alloc")
"""What machine code may not call: there is no interpreter that could hear an error, and nobody who frees memory."""
IMPLICIT = ("memcpy", "memmove", "memset", "fmod", "sincos")
"""What the code generator may call without being told to."""
_making = threading.RLock()
_kept_alive: list[Any] = []


class Columns(NamedTuple):
    """How many columns the arrays of one process have."""

    states: int
    parameters: int
    faults: int
    inputs: int


class MachineCode(NamedTuple):
    """What a compiled kernel is on disk."""

    name: str
    """Of the function in the object file."""
    calls: tuple[str, ...]
    """What the object file refers to: the C library, intrinsics of LLVM, and what only an error would reach."""
    object_file: bytes


def kernel(columns: Columns, scratch: int) -> Callable[[Callable[..., None]], CompiledKernel]:
    """A decorator: the function as a :class:`CompiledKernel` with ``scratch`` numbers of room for its own use.

    The function takes what a kernel takes and an array of ``scratch`` numbers more. It is made of
    :func:`~homeostat.process.compiled.compiled` blocks; it neither raises nor allocates (no ``np.empty``, no slices
    assigned to slices).
    """
    return lambda function: CompiledKernel(function, columns, scratch)


@final
class CompiledKernel:
    """A :class:`~homeostat.process.batch.Kernel` of machine code, for any number of threads at once."""

    def __init__(self, function: Callable[..., None], columns: Columns, scratch: int) -> None:
        self.py_func = function
        """The kernel as plain Python."""
        self._columns, self._scratch = columns, scratch

    def __call__(
        self, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
        begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
        broken_at: Vec,
    ) -> None:  # fmt: skip
        """Advance the members as a kernel does.

        Raises:
            ValueError: an array does not have the columns of the process.
            TypeError: an array is of another type, may not be written, or does not lie in one piece.
        """
        if (x.shape[1], p.shape[1], sev.shape[1], u.shape[2]) != self._columns or onset.shape != sev.shape:
            raise ValueError("states, parameters, severities or inputs do not have the columns of the layout")
        work = np.zeros(self._scratch)
        if interpreted():
            given = (x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks, out)
            self.py_func(first, last, *given, broken_at, work)
            return
        sizes = (len(x), len(u), u.shape[1], out.shape[1], len(picks))
        arrays = (x, p, sev, onset, u, u_of, begin, seeds, process, sensor, picks, out, broken_at, work)
        if any(array.dtype is not dtype for array, dtype in zip(arrays, TYPES, strict=True)):
            raise TypeError("a kernel takes float64 and int64, each array in its place")
        self._code(first, last, *sizes, t0, steps, stride, *map(_address, arrays))

    def load(self) -> None:
        """Compile it, or read what was compiled, now and not with the first call."""
        if not interpreted():
            _ = self._code

    @functools.cached_property
    def _code(self) -> Callable[..., None]:
        folder = Path(inspect.getfile(self.py_func)).parent
        with _making:
            file = _cache_folder(folder) / f"{self.py_func.__module__}.{_version(folder)}.o"
            kept = _read(file)
            if kept is None:
                logging.getLogger(__name__).warning("compiling, once")
                kept = self._compile()
                _keep(file, kept)
            return _load(kept)

    def _compile(self) -> MachineCode:
        import llvmlite.binding as llvm
        import numba

        entry = numba.cfunc(_signature(numba), error_model="numpy")(self._entry())
        module = llvm.parse_assembly(entry.inspect_llvm())
        called = {function.name for function in module.functions if function.is_declaration}
        if forbidden := sorted(called.intersection(NEVER)):
            raise TypeError(
                f"kernel of {self.py_func.__module__} raises an error or allocates an array ({forbidden[0]}); let it "
                "write what is wrong into broken_at, and use the room that it is given"
            )
        data = {variable.name for variable in module.global_variables if variable.is_declaration}
        return MachineCode(entry.native_name, tuple(sorted(called | data)), _machine(llvm).emit_object(module))

    def _entry(self) -> Callable[..., None]:
        """The kernel as C sees it: sizes, times, then the addresses of the arrays."""
        from numba import carray  # type: ignore[attr-defined]

        advance, room = compiled(self.py_func), self._scratch
        states, parameters, faults, inputs = self._columns

        def entry(  # type: ignore[no-untyped-def]
            first, last, members, schedules, cover, rows, picked, t0, steps, stride, x, p, sev, onset, u, u_of, begin,
            seeds, process, sensor, picks, out, broken_at, work,
        ):  # fmt: skip
            advance(
                first, last, carray(x, (members, states)), carray(p, (members, parameters)),
                carray(sev, (members, faults)), carray(onset, (members, faults)),
                carray(u, (schedules, cover, inputs)), carray(u_of, (members,)), t0, carray(begin, (members,)), steps,
                stride, carray(seeds, (members,)), carray(process, (members,)), carray(sensor, (members,)),
                carray(picks, (picked,)), carray(out, (members, rows, picked)), carray(broken_at, (members,)),
                carray(work, (room,)),
            )  # fmt: skip

        return entry


def _signature(numba: Any) -> Any:
    """What :meth:`CompiledKernel._entry` takes, for numba."""
    types = numba.types
    pointers = {REAL: types.CPointer(types.float64), WHOLE: types.CPointer(types.int64)}
    return types.void(*[types.int64] * 7, types.float64, *[types.int64] * 2, *(pointers[dtype] for dtype in TYPES))


def _machine(llvm: Any) -> Any:
    """This machine, as LLVM makes code for it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=cpu, features=features, opt=3, reloc="default", codemodel="jitdefault", jit=True
    )


def _load(code: MachineCode) -> Callable[..., None]:
    """The function that ``code`` is, linked with what it calls in the C library of this process."""
    import llvmlite.binding as llvm

    builder, library = llvm.JITLibraryBuilder().add_object_img(code.object_file), ctypes.CDLL(None)
    for wanted in {*code.calls, *IMPLICIT}:
        name = wanted.split(".")[1] if wanted.startswith("llvm.") else wanted
        found = getattr(library, name, None if name != wanted else library.abort)
        if found is not None:
            builder.import_symbol(name, ctypes.cast(found, ctypes.c_void_p).value)
    # Each kernel is a library of its own: their functions have the same name.
    linked = builder.export_symbol(code.name).link(_linker(), f"kernel {len(_kept_alive)}")
    _kept_alive.append(linked)
    function = ctypes.CFUNCTYPE(None)(linked[code.name])
    function.argtypes = (*[ctypes.c_int64] * 7, ctypes.c_double, *[ctypes.c_int64] * 2, *[ctypes.c_void_p] * len(TYPES))
    return function


@functools.cache
def _linker() -> Any:
    import llvmlite.binding as llvm

    return llvm.create_lljit_compiler(_machine(llvm))


def _read(file: Path) -> MachineCode | None:
    """What :func:`_keep` wrote; None where there is nothing, or not all of it."""
    try:
        digest, rest = file.read_bytes().split(b"\n", 1)
        if hashlib.sha256(rest).hexdigest().encode() != digest:
            return None
        name, calls, code = rest.split(b"\n", 2)
    except (OSError, ValueError):
        return None
    return MachineCode(name.decode(), tuple(calls.decode().split()), code)


def _keep(file: Path, code: MachineCode) -> None:
    """Keep machine code in one step; a full disk must not stop what is compiled already."""
    whole = f"{code.name}\n{' '.join(code.calls)}\n".encode() + code.object_file
    part = file.with_suffix(f".{os.getpid()}.part")
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(hashlib.sha256(whole).hexdigest().encode() + b"\n" + whole)
        part.replace(file)
    with contextlib.suppress(OSError):
        part.unlink(missing_ok=True)


def _cache_folder(folder: Path) -> Path:
    """Where machine code is kept: as NUMBA_CACHE_DIR says, beside the source, or in the user's cache."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    if os.access(folder, os.W_OK):
        return folder / "__pycache__"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "homeostat"


@functools.cache
def _version(folder: Path) -> str:
    """Digest of everything that machine code of ``folder`` follows from: sources, compiler, processor."""
    import llvmlite.binding as llvm

    digest = hashlib.sha256()
    made_by = (version("numba"), version("llvmlite"), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    digest.update("\0".join(made_by).encode())
    for source in sorted({*folder.glob("*.py"), *Path(__file__).parent.glob("*.py")}):
        digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
