"""Secrets: keys that must not get into a trace, a file or a prompt, however they are spelled."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from typing import Final

from homeostat.domain.quotation import is_unseen
from homeostat.llm.model import STRUCK_OUT

SHORTEST_KEY: Final = 6
"""Anything shorter is not a key, and striking it out would spoil ordinary text."""
_ESCAPE: Final = re.compile(r"\\(?:u([0-9a-fA-F]{4})|(/))")


class Secrets:
    """Strikes keys out of texts."""

    def __init__(self, keys: Iterable[str]) -> None:
        """White space around a key is not sent, so nobody repeats it."""
        self._keys = tuple(key for k in keys if len(key := k.strip()) >= SHORTEST_KEY)

    def strike(self, text: str) -> str:
        """``text`` without any key, also where reading it as JSON or quoting it would bring one to light.

        A text in which a key is hidden comes back in the form in which it was found.
        """
        for view in (text, shown := _unescaped(text), _plain(shown)):
            if any(key in view for key in self._keys):
                return self.strike(self._replaced(view))
        return text

    def _replaced(self, text: str) -> str:
        for key in self._keys:
            text = text.replace(key, STRUCK_OUT)
        return text


def _unescaped(text: str) -> str:
    """``text`` with the escapes of JSON resolved that may stand for a visible character."""
    return _ESCAPE.sub(lambda found: chr(int(found[1], 16)) if found[1] else "/", text)


def _plain(text: str) -> str:
    """``text`` with plain letters for look-alike forms, and without characters that nobody sees."""
    return "".join(c for c in unicodedata.normalize("NFKC", text) if not is_unseen(c) or c in "\n\t")
