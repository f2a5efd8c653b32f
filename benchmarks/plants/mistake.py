"""One mistake: which class it is of, what it changes, and where a finding must point."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.plants.site import Edit


@dataclass(frozen=True)
class Mistake:
    """A mistake that somebody made in a plant's folder."""

    kind: str
    """Class of the mistake."""
    name: str
    """What was done, in a few words."""
    edits: tuple[Edit, ...]
    """How it is made."""
    points: tuple[str, ...]
    """A finding counts where its place or its text has one of these: a key, the name of a row, a file."""


def table(kind: str, name: str, file: str, old: str, new: str, *points: str) -> Mistake:
    """A mistake in one line of one table or of the settings."""
    return Mistake(kind, name, (Edit(file if "." in file else f"engineering/{file}.csv", old, new),), points)


def code(kind: str, name: str, text: str, *points: str) -> Mistake:
    """A mistake in the process model: what is appended to its class."""
    return Mistake(kind, name, (Edit("process.py", "", text),), points)


def acting(kind: str, name: str, body: str, *points: str) -> Mistake:
    """A mistake in the equations: what happens to a member's state ``x`` after each second, ``t`` [s] being its end."""
    text = f"""
    kernel = EachSecond(CstrModel.kernel, lambda x, p, sev, onset, t: act(x, p, sev, onset, t))


def act(x, p, sev, onset, t):
{body}
"""
    return code(kind, name, text, *points)
