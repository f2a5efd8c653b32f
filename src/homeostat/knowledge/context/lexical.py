"""Lexical retrieval: which documents have the words of a question (BM25, Robertson and Zaragoza, 2009)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from homeostat.knowledge.context.documents import Document

EXTRA: Final = "retrieving documents needs 'bm25s': pip install 'homeostat[campaign]'"
"""Said where the library is not installed."""
_WORD: Final = re.compile(r"\w+(?:[.-]\w+)*")
_JOINTS: Final = re.compile(r"[_.-]")
_COMMON: Final = frozenset(
    _WORD.findall(
        "a an and are as at be by every for from has if in into is it its no not of on or that the their them then "
        "these they this to was with"
    )
)
"""English words that are in too many documents to tell them apart."""


class LexicalIndex:
    """Documents by their words, ranked by BM25 with the usual k1 = 1.5 and b = 0.75."""

    def __init__(self, documents: Sequence[Document]) -> None:
        """Index ``documents``. ImportError, in one line, where the library is not installed."""
        try:
            import bm25s
        except ImportError as error:
            raise ImportError(EXTRA, name="bm25s") from error
        self._documents = tuple(documents)
        self._scores = bm25s.BM25()
        self._scores.index([words(document.text) for document in documents], show_progress=False)

    def matching(self, question: str) -> tuple[Document, ...]:
        """The documents with at least one word of ``question``, best first; of equals the first by name."""
        scores = self._scores.get_scores(words(question))
        found = [(-float(score), k) for k, score in enumerate(scores) if score > 0.0]
        return tuple(self._documents[k] for _, k in sorted(found, key=lambda f: (f[0], self._documents[f[1]].name)))


def words(text: str) -> list[str]:
    """The words of ``text`` that are looked for: names as a whole and by their parts, in lower case.

    >>> words("Is V2.cmd of cool_stuck_closed at 0.5?")
    ['v2.cmd', 'v2', 'cmd', 'cool_stuck_closed', 'cool', 'stuck', 'closed', '0.5']
    """
    found = []
    for word in _WORD.findall(text.lower()):
        parts = [part for part in _JOINTS.split(word) if part] if word[0].isalpha() else []
        found += [word, *parts] if len(parts) > 1 else [word]
    return [word for word in found if word not in _COMMON]
