"""A plant's own code: the modules of its folder, run from what was read of them, under a name that no other plant has.

What runs is what the digest of the configuration is made of, though a file be changed meanwhile. Modules of one plant
import each other relatively (``from .layout import STATES``); they see nothing else that is in the folder or beside it.
"""

from __future__ import annotations

import errno
import importlib
import logging
import os
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder, SourceLoader
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple, final

from homeostat.knowledge.build.provenance import sha256
from homeostat.plants.configuration import configuration_digest
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS, PlantFiles
from homeostat.process.blocks.given import FlowsheetError

_PACKAGE: Final = "__init__.py"
_TRUE: Final = "true/"
_HIDES: Final = "true.py"
_OF_A_TEXT: Final = ("'str'", "can't multiply sequence", "concatenate str")
"""What Python says of arithmetic with a text."""


class _Source(NamedTuple):
    files: PlantFiles
    name: str

    @property
    def file(self) -> Path:
        """Where it was read."""
        return self.files.folder / self.name


_sources: Final[dict[str, _Source]] = {}


def modules(files: PlantFiles) -> tuple[str, ...]:
    """Names of the modules in the plant's folder, but for those of its true plant."""
    names = (name.removesuffix(".py") for name in files.own_code if "/" not in name)
    return tuple(name for name in names if name != "__init__")


def import_own(files: PlantFiles, module: str) -> ModuleType:
    """The ``module`` of the plant's folder; says whose code it is before any of it runs for the first time.

    Raises PlantError with the line where the code cannot be run.
    """
    package = _package(files)
    if f"{package}.{module}" not in sys.modules:
        _announce(files)
    try:
        return importlib.import_module(f"{package}.{module}")
    except KeyboardInterrupt:
        raise
    except BaseException as broken:  # it is anybody's code
        raise PlantError(f"{files.folder.name}/{SETTINGS}: {told(files, broken)}{remedy(broken)}") from None


def told(files: PlantFiles, broken: BaseException) -> str:
    """What went wrong in the plant's own code, and where, in one line."""
    return f"{_place(files, broken)}{_said(broken)}"


def remedy(broken: BaseException) -> str:
    """What to do about it, behind what was told: Python takes a symbol for a text where no term stands beside it."""
    if isinstance(broken, FlowsheetError) and "; " in str(broken):
        return ""  # it says that itself
    if isinstance(broken, TypeError) and any(word in str(broken) for word in _OF_A_TEXT):
        return '; write term("SYMBOL") where a symbol meets a number or another symbol, as in term("cp") / 1000'
    return "; mend it"


def _package(files: PlantFiles) -> str:
    """Name of the package that the folder's code is; it is another one where the code or the folder is."""
    if _HIDES in files.own_code:
        raise PlantError(f"{files.folder.name}/{_HIDES} has the name of the folder of the true plant; rename it")
    own = [path for path in files.contents if path in files.own_code or path.startswith(_TRUE)]
    named = [str(files.folder), *(f"{path} {sha256(files.contents[path])}" for path in own)]
    name = f"_homeostat_plant_{sha256(chr(0).join(named).encode('utf-8', 'surrogateescape'))[:16]}"
    if name not in _sources:
        for path in (_PACKAGE, f"{_TRUE}{_PACKAGE}", *files.own_code):
            _sources[_dotted(name, path)] = _Source(files, path)
        if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
            sys.meta_path.append(_Finder())
    return name


def _dotted(package: str, path: str) -> str:
    parts = path.removesuffix(".py").split("/")
    return ".".join((package, *parts)).removesuffix(".__init__")


def _announce(files: PlantFiles) -> None:
    from homeostat.plants.files.signature import signer  # cryptography takes its time

    signed, names = signer(files.folder, configuration_digest(files)), ", ".join(files.own_code)
    logging.getLogger(__name__).warning("running the code in %r (%s): %s", str(files.folder), names, signed)


def _place(files: PlantFiles, broken: BaseException) -> str:
    """The last line of the plant's own code that ``broken`` came from, or that it is about."""
    if isinstance(broken, SyntaxError) and broken.filename:
        return f"{Path(broken.filename).name}, line {broken.lineno}: "
    found, trace = "", broken.__traceback__
    while trace is not None:
        file = Path(trace.tb_frame.f_code.co_filename)
        if file.is_relative_to(files.folder):
            found = f"{file.relative_to(files.folder).as_posix()}, line {trace.tb_lineno}: "
        trace = trace.tb_next
    return found


def _said(broken: BaseException) -> str:
    try:
        text = broken.msg if isinstance(broken, SyntaxError) else " ".join(str(broken).split())
    except Exception:  # what says what went wrong may go wrong itself
        text = "it does not say why"
    return f"{type(broken).__name__}: {text:.300}"


@final
class _Finder(MetaPathFinder):
    """Finds the modules of plants' folders, whose names nothing else has."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        source = _sources.get(fullname)
        if source is None:
            return None
        package = source.file.name == _PACKAGE  # whose path stays empty: nothing on disk is looked for
        spec = ModuleSpec(fullname, _Loader(source), origin=str(source.file), is_package=package)
        spec.has_location = True
        return spec


@final
class _Loader(SourceLoader):
    """Runs what was read of a module, and keeps no bytecode."""

    def __init__(self, source: _Source) -> None:
        self._source = source

    def get_filename(self, fullname: str) -> str:
        return str(self._source.file)

    def get_data(self, path: Any) -> bytes:
        """Content of a file of the folder as it was read; OSError where nothing of it was."""
        files, asked = self._source.files, Path(path)
        if asked == self._source.file:
            return files.contents.get(self._source.name, b"")
        name = asked.relative_to(files.folder).as_posix() if asked.is_relative_to(files.folder) else ""
        if name not in files.contents:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return files.contents[name]
