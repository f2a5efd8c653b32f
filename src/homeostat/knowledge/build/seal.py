"""The seal of a generated file: its last line is the hash of all lines before it, so that a change by hand is seen.

The line is a comment in Turtle and in our CSV files. Line ends count as one byte, however a file was checked out. A
seal protects against mistakes, not against somebody who computes a new one; that is what signatures are for.
"""

from __future__ import annotations

import hashlib
import re
from typing import Final

_SEAL: Final = re.compile(rb"# sha256 ([0-9a-f]{64})\n\Z")


def with_one_line_end(content: bytes) -> bytes:
    """``content`` with LF at the end of every line."""
    return content.replace(b"\r\n", b"\n")


def sha256(content: bytes) -> str:
    """SHA-256 in lower-case hexadecimal, whatever the line ends are."""
    return hashlib.sha256(with_one_line_end(content)).hexdigest()


def seal(content: bytes) -> bytes:
    """``content`` with its seal as the last line; ``content`` must end with a line end."""
    return content + f"# sha256 {sha256(content)}\n".encode("ascii")


def is_sealed(content: bytes) -> bool:
    """Whether ``content`` is as it was sealed: not a byte before the last line has changed."""
    plain = with_one_line_end(content)
    found = _SEAL.search(plain)
    return found is not None and found[1].decode("ascii") == sha256(plain[: found.start()])
