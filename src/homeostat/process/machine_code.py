"""Machine code on disk: written whole or not at all, read back where it can be trusted, and linked without numba."""

import contextlib
import ctypes
import functools
import hashlib
import os
import stat
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

IMPLICIT = ("memcpy", "memmove", "memset", "fmod", "sincos")
"""What the code generator may call without being told to."""
_kept_alive: list[Any] = []


class MachineCode(NamedTuple):
    """What a compiled kernel is on disk."""

    name: str
    """Of the function in the object file."""
    calls: tuple[str, ...]
    """What the object file refers to: the C library, intrinsics of LLVM, and what only an error would reach."""
    object_file: bytes


def machine(llvm: Any) -> Any:
    """This machine, as LLVM makes code for it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=cpu, features=features, opt=3, reloc="default", codemodel="jitdefault", jit=True
    )


def load(code: MachineCode, types: Sequence[Any]) -> Callable[..., None]:
    """The function that ``code`` is, linked with the C library of this process; ``types`` are its arguments for ctypes.

    RuntimeError where it cannot be linked.
    """
    import llvmlite.binding as llvm

    builder, c_library = llvm.JITLibraryBuilder().add_object_img(code.object_file), library()
    for wanted in {*code.calls, *IMPLICIT}:
        name = wanted.split(".")[1] if wanted.startswith("llvm.") else wanted
        found = getattr(c_library, name, None if name != wanted else c_library.abort)
        if found is not None:
            builder.import_symbol(name, ctypes.cast(found, ctypes.c_void_p).value)
    # Each kernel is a library of its own: their functions have the same name.
    linked = builder.export_symbol(code.name).link(_linker(), f"kernel {len(_kept_alive)}")
    _kept_alive.append(linked)
    function = ctypes.CFUNCTYPE(None)(linked[code.name])
    function.argtypes = types
    return function


@functools.cache
def library() -> ctypes.CDLL:
    """The C library that this process has loaded already."""
    return ctypes.CDLL(None)


@functools.cache
def _linker() -> Any:
    import llvmlite.binding as llvm

    return llvm.create_lljit_compiler(machine(llvm))


def read(file: Path) -> MachineCode | None:
    """What :func:`keep` wrote; None where there is nothing, not all of it, or what somebody else may have written."""
    try:
        found = file.lstat()
        if not stat.S_ISREG(found.st_mode) or found.st_uid not in (0, os.getuid()) or found.st_mode & 0o022:
            return None
        digest, rest = file.read_bytes().split(b"\n", 1)
        if hashlib.sha256(rest).hexdigest().encode() != digest:
            return None
        name, calls, code = rest.split(b"\n", 2)
        return MachineCode(name.decode(), tuple(calls.decode().split()), code)
    except (OSError, ValueError):
        return None


def keep(file: Path, code: MachineCode) -> None:
    """Keep machine code in one step; a full disk must not stop what is compiled already."""
    whole = f"{code.name}\n{' '.join(code.calls)}\n".encode() + code.object_file
    part = file.with_suffix(f".{os.getpid()}.part")
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(hashlib.sha256(whole).hexdigest().encode() + b"\n" + whole)
        part.chmod(0o644)
        part.replace(file)
    with contextlib.suppress(OSError):
        part.unlink(missing_ok=True)


def cache_folder(folder: Path) -> Path:
    """Where machine code is kept: as NUMBA_CACHE_DIR says, beside the source, or in the user's cache."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    if os.access(folder, os.W_OK):
        return folder / "__pycache__"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "homeostat"


@functools.cache
def sources(*folders: Path) -> str:
    """Digest of what every kernel made of ``folders`` follows from: their place and sources, compiler, processor."""
    import llvmlite.binding as llvm

    digest = hashlib.sha256()
    made_by = (version("numba"), version("llvmlite"), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    digest.update("\0".join((*(str(folder.resolve()) for folder in folders), *made_by)).encode())
    for source in [path for folder in (*folders, Path(__file__).parent) for path in sorted(folder.glob("*.py"))]:
        digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()
