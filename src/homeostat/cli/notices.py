"""What the program goes on in spite of: told in one line on standard error."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator
from typing import final


@contextlib.contextmanager
def notices() -> Iterator[None]:
    """Tell what the package logs as a warning, as long as this lasts; a terminal view moves out of its way."""
    logger, handler = logging.getLogger("homeostat"), _Teller(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


@final
class _Teller(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError):  # nobody reads it: no reason to stop either
            print(f"homeostat: {' '.join(record.getMessage().split())}", file=sys.stderr, flush=True)
