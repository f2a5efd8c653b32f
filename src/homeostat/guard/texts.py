"""Texts that strangers send: how long they may be, and what may be said of one that is too long or no text at all."""

from __future__ import annotations

LONGEST = 500
"""Most characters of a text in a message, and of what is said of it."""
LONGEST_NAME = 200
"""Most characters of an identifier of an order, of a person's name and of the name of a tag."""


def fits(given: object, most: int) -> bool:
    """Whether ``given`` is a plain text of at most ``most`` characters."""
    return type(given) is str and len(given) <= most


def brief(given: object, most: int = LONGEST) -> str:
    """The beginning of ``given`` where it is a text; of anything else its kind, which takes no time to say."""
    return given[:most] if isinstance(given, str) else type(given).__name__
