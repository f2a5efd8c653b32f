"""Arguments: numbers that are numbers, and errors that are one line."""

import argparse
import math
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Final, NoReturn, final

ENDINGS: Final = "its ending says the format: .ttl, .nt, .jsonld, .rdf, .owl, .trig or .nq"
"""What the help says about a file with a graph."""
LEAST_DIGITS: Final = 8
"""Fewest digits that name a digest."""


class UsageError(ValueError):
    """The command line asks for something that there is not; one line with the remedy."""


def writable(path: Path, force: bool) -> Path:
    """Where what is to be written to ``path`` goes: a link is followed; UsageError where it is there and not ``force``.

    Something that is no file is never replaced.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise UsageError(f"{str(path)!r} is no file, and is not replaced by one; name another one")
    if path.exists() and not force:
        raise UsageError(f"{str(path)!r} is there already; --force replaces it")
    return path.resolve() if path.is_symlink() else path


def apart(path: Path, folder: Path, names: Collection[str]) -> Path:
    """``path``; UsageError where it is one of the files that a plant is made of: ``names`` in its ``folder``."""
    for name in names:
        if (folder / name).exists() and path.resolve() == (folder / name).resolve():
            raise UsageError(
                f"{str(path)!r} is a file of the plant {folder.name!r} and is not replaced; name another one"
            )
    return path


@final
class Parser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line and exits with 2."""

    def error(self, message: str) -> NoReturn:
        """Leave with the message."""
        self.exit(2, f"homeostat: {' '.join(message.split())}; see '{self.prog} --help'\n")


def number(
    low: float = -math.inf, high: float = math.inf, read: Callable[[str], float] = float, kind: str = "finite"
) -> Callable[[str], float]:
    """A converter for a number of a ``kind`` from ``low`` to ``high``, as ``read`` makes it of a text."""

    def convert(text: str) -> float:
        try:
            value = read(text)
        except ValueError:
            value = math.nan
        if not abs(value) < math.inf:
            raise argparse.ArgumentTypeError(f"{text!r} is not a {kind} number")
        if not low <= value <= high:
            allowed = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
            raise argparse.ArgumentTypeError(f"{text} must be {allowed}")
        return value

    return convert


def whole(low: int, high: int) -> Callable[[str], float]:
    """A converter for a whole number from ``low`` to ``high``."""
    return number(low, high, int, "whole")
