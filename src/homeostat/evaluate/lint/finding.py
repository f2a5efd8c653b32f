"""What a check of a plant's folder finds: where, what, why it matters, and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


def amount(value: float, unit: str, digits: int = 4) -> str:
    """A number with its unit as a message has it; a share has none."""
    return f"{value:.{digits}g}" if unit == "1" else f"{value:.{digits}g} {unit}"


class Severity(StrEnum):
    """How much a finding weighs."""

    ERROR = "error"
    """The plant is refused, or would be controlled wrongly."""
    WARNING = "warning"
    """Somebody should decide on it; it counts as a finding."""
    NOTE = "note"
    """True, and worth knowing; it does not count."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where something is stated."""

    file: str
    """Name of the file, relative to the plant's folder."""
    row: int | None = None
    """Line in the file; None where it is not known."""
    key: str = ""
    """Name of the row, or keys of the settings; empty where the file is meant."""

    def __str__(self) -> str:
        """As a message names it."""
        called = "row" if self.file.endswith(".csv") else "line"
        where = "" if self.row is None else f" {called} {self.row}"
        return f"{self.file}{where}" + (f" ({self.key})" if self.key else "")


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong with a plant's folder, or worth knowing of it."""

    severity: Severity
    """How much it weighs."""
    check: str
    """Which check found it, for example ``loops``."""
    where: Place
    """Where it is stated."""
    what: str
    """What is wrong, with value, limit and unit, and why it matters."""
    remedy: str
    """What to do."""

    @property
    def counts(self) -> bool:
        """Whether a plant with it is not clean."""
        return self.severity is not Severity.NOTE

    def __str__(self) -> str:
        """One line."""
        return f"{self.where}: {self.severity}: {self.what}; {self.remedy} [{self.check}]"


def split(message: str, otherwise: str) -> tuple[str, str]:
    """What a message of the package says is wrong, and its remedy, which is its last clause; ``otherwise`` if none."""
    what, separator, remedy = message.rpartition("; ")
    return (what, remedy) if separator else (message, otherwise)
