"""Arguments: numbers that are numbers, and errors that are one line."""

import argparse
import math
from collections.abc import Callable
from typing import Final, NoReturn, final

ENDINGS: Final = "its ending says the format: .ttl, .nt, .jsonld, .rdf, .owl, .trig or .nq"
"""What the help says about a file with a graph."""
LEAST_DIGITS: Final = 8
"""Fewest digits that name a digest."""
SEARCH: Final = "search"
"""The proposer that is always there."""


class UsageError(ValueError):
    """The command line asks for something that there is not; one line with the remedy."""


@final
class Parser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line and exits with 2."""

    def error(self, message: str) -> NoReturn:
        """Leave with the message."""
        self.exit(2, f"homeostat: {' '.join(message.split())}; see '{self.prog} --help'\n")


def number(low: float = -math.inf, high: float = math.inf) -> Callable[[str], float]:
    """A converter for a finite number from ``low`` to ``high``."""

    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
        if not low <= value <= high:
            allowed = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
            raise argparse.ArgumentTypeError(f"{text} must be {allowed}")
        return value

    return convert


def whole(low: int, high: int) -> Callable[[str], int]:
    """A converter for a whole number from ``low`` to ``high``."""

    def convert(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} must be from {low} to {high}")
        return value

    return convert
