"""Name and password for a server: from the environment, or from a file that its owner alone can read."""

import os
from pathlib import Path
from typing import Final

from homeostat.links.errors import LinkError
from homeostat.links.opcua.security.certificate import refuse_readable

USER: Final = "HOMEOSTAT_OPCUA_USER"
"""Environment variable with the name."""
PASSWORD: Final = "HOMEOSTAT_OPCUA_PASSWORD"
"""Environment variable with the password."""


def login_from(file: Path | None) -> tuple[str, str] | None:
    """Name and password: from ``file`` (one line, ``name:password``) where it is given, else from the environment.

    None where neither says anything. LinkError where the file is no such line or others can read it, or where the
    environment has one of the two only.
    """
    if file is not None:
        refuse_readable(file)
        try:
            name, colon, password = file.read_text("utf-8").strip().partition(":")
        except UnicodeDecodeError:
            raise LinkError(f"{str(file)!r} is no text in UTF-8; write one line, name:password") from None
        if not (name and colon and password):
            raise LinkError(f"{str(file)!r} is no login; write one line, name:password")
        return name, password
    user, secret = os.environ.get(USER), os.environ.get(PASSWORD)
    if bool(user) != bool(secret):
        raise LinkError(f"{USER} and {PASSWORD} belong together, and one of them is not set; set both or none")
    return (user, secret) if user and secret else None
