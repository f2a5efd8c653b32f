"""Texts that strangers send: how long they may be, and what may be said of one that is too long or no text at all."""

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


def said(error: BaseException) -> str:
    """What code that is not the guard's has raised: its text, or its name where it has none.

    Whatever it raises, also what would end a program or a task, is its failure and not the guard's end; only a
    person's interrupt goes on its way.
    """
    if isinstance(error, KeyboardInterrupt):
        raise error
    return brief(_text(error)) or type(error).__name__


def _text(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # an error whose text cannot be made
        return ""
