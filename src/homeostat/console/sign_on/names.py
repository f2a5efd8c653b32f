"""Names of a provider's people: the first one that somebody has stays theirs, and nobody else gets it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import final

from homeostat.console.people.accounts import folded
from homeostat.console.people.owned import NotOwned, changing, mapping, replace
from homeostat.console.sign_on.settings import SignOnError


@final
class Names:
    """Who has which name, kept beside the settings: the journal's names must be people, whatever a provider renames."""

    def __init__(self, settings: Path) -> None:
        """``settings``: their file."""
        self._path = settings.with_name(f"{settings.name}.names")

    def known(self) -> dict[str, str]:
        """Subject -> name; SignOnError where the file cannot be used."""
        try:
            return mapping(self._path, str, "who has which name")
        except NotOwned as error:
            raise SignOnError(str(error)) from error

    def of(self, subject: str, name: str) -> str | None:
        """The name of ``subject``, which is ``name`` where they had none; None where somebody else has that.

        SignOnError where it cannot be kept.
        """
        try:
            with changing(self._path):
                known = self.known()
                if subject in known:
                    return known[subject]
                if folded(name) in {folded(taken) for taken in known.values()}:
                    return None
                content = json.dumps({**known, subject: name}, indent=1, ensure_ascii=False)
                replace(self._path, content.encode() + b"\n")
                return name
        except OSError as error:
            raise SignOnError(f"{str(self._path)!r} cannot be written: {error.strerror}") from error
