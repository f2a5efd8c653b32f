"""Waiting for a link: for a sample of which something is true, and for an answer."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from homeostat.domain.ports import Ticket
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.opcua.link import OpcuaLink


def sample(link: OpcuaLink, until: Callable[[Snapshot], bool] = lambda s: True, within_s: float = 20.0) -> Snapshot:
    """The first sample of which ``until`` is true."""
    end, seen = time.monotonic() + within_s, None
    while time.monotonic() < end:
        with contextlib.suppress(LinkError):
            now = link.source.advance()
            seen = now or seen
            if now is not None and until(now):
                return now
    raise AssertionError(f"not within {within_s} s: {seen}")


def settled(ticket: Ticket, within_s: float = 10.0) -> str:
    """What went wrong, once the link has answered."""
    end = time.monotonic() + within_s
    while not ticket.done:
        assert time.monotonic() < end, "the link has not answered"
        time.sleep(0.01)
    return ticket.error
