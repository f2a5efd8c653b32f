"""Secrets: keys that must not get into a trace, a file or a prompt, however they are spelled."""

import re
import unicodedata
from collections.abc import Iterable, Iterator
from typing import Final

from homeostat.domain.quotation import is_unseen
from homeostat.llm.model import STRUCK_OUT

SHORTEST_KEY: Final = 6
"""Anything shorter is not a key, and striking it out would spoil ordinary text."""
_VISIBLE: Final = re.compile(r"\\(?:u([0-9a-fA-F]{4})|(/))")
"""Escapes of JSON that need not be there; without them it is JSON still, most of the time."""
_ANY: Final = re.compile(r"\\(?:u([0-9a-fA-F]{4})|([\"'\\/]))")
"""Those and the ones that must be there, in JSON or in what Python shows of a text."""


class Secrets:
    """Strikes keys out of texts."""

    def __init__(self, keys: Iterable[str]) -> None:
        """White space around a key is not sent, so nobody repeats it."""
        self._keys = tuple(key for k in keys if len(key := k.strip()) >= SHORTEST_KEY)

    def strike(self, text: str) -> str:
        """``text`` without any key, also where reading it as JSON or quoting it would bring one to light.

        A text in which a key is hidden comes back in the form in which it was found.
        """
        while (view := next((v for v in _views(text) if any(key in v for key in self._keys)), None)) is not None:
            for key in self._keys:
                view = view.replace(key, STRUCK_OUT)
            text = view
        return text


def _views(text: str) -> Iterator[str]:
    """What may be seen of ``text``, the least changed first: as it is, unescaped, and unescaped twice."""
    once = _unescaped(text, _ANY)
    for view in (text, _unescaped(text, _VISIBLE), once, _unescaped(once, _ANY)):
        yield view
        yield _plain(view)


def _unescaped(text: str, escape: re.Pattern[str]) -> str:
    return escape.sub(lambda found: chr(int(found[1], 16)) if found[1] else found[2], text)


def _plain(text: str) -> str:
    """``text`` with plain letters for look-alike forms, and without characters that nobody sees."""
    return "".join(c for c in unicodedata.normalize("NFKC", text) if not is_unseen(c) or c in "\n\t")
