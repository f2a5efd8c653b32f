"""Whose failed tries are counted together: guessing from one place must not keep people from the plant at another."""

from __future__ import annotations

import ipaddress
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, final

from homeostat.console.people.accounts import folded
from homeostat.console.people.tries import MOST, Tries

SIGNED_IN_S: Final = 150.0
"""Longest wait of who is signed in and gives a wrong password with an order, wall-clock [s]: 36 tries in an hour."""
PLACE_S: Final = 300.0
"""Longest wait of one place from which people try to sign in, wall-clock [s]: 24 tries in its first hour."""
HOURLY: Final = 32
"""Most failures in an hour to sign in under one name from all places where its person has signed in before, and as
many from all others. With those of who is signed in that is 100, the most of an account (OWASP ASVS 2.2.1)."""
_HOUR_S: Final = 3600.0
_PREFIX: Final = 64


@dataclass(frozen=True, slots=True)
class Guess:
    """A password that is tried."""

    name: str
    """Whose."""
    address: str
    """Where from."""
    signed_in: bool = False
    """Whether that person has signed in there: whoever has not cannot use these tries up."""


@final
class Guesses:
    """Counts failures by name and place; those of people who are signed in apart."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Nobody has failed yet, or signed in; ``clock`` tells seconds and is set by nobody."""
        self._clock = clock
        self._orders, self._places = Tries(clock, SIGNED_IN_S, _HOUR_S), Tries(clock, PLACE_S, _HOUR_S)
        self._hours: dict[tuple[str, bool], deque[float]] = {}
        self._homes: dict[tuple[str, str], None] = {}

    def wait_s(self, guess: Guess) -> float:
        """How long ``guess`` must wait [s]; 0 where it need not."""
        if guess.signed_in:
            return self._orders.wait_s(folded(guess.name))
        recent, now = self._hours.get(self._source(guess), ()), self._clock()
        late = [at for at in recent if now - at < _HOUR_S]
        full_s = late[0] + _HOUR_S - now if len(late) >= HOURLY else 0.0
        return max(full_s, self._places.wait_s(*_keys(guess)))

    def failed(self, guess: Guess) -> None:
        """``guess`` was wrong, as far as is known."""
        if guess.signed_in:
            self._orders.failed(folded(guess.name))
            return
        self._places.failed(*_keys(guess))
        source = self._source(guess)
        self._hours[source] = deque([*self._hours.pop(source, ()), self._clock()], maxlen=HOURLY)
        while len(self._hours) > MOST:
            self._hours.pop(next(iter(self._hours)))

    def succeeded(self, guess: Guess) -> None:
        """``guess``, which was counted as wrong before it was known, was right."""
        if guess.signed_in:
            self._orders.succeeded(folded(guess.name))
            return
        self._places.succeeded(*_keys(guess))
        if recent := self._hours.get(self._source(guess)):
            recent.pop()
        home = _home(guess)
        self._homes.pop(home, None)
        self._homes[home] = None
        while len(self._homes) > MOST:
            self._homes.pop(next(iter(self._homes)))

    def _source(self, guess: Guess) -> tuple[str, bool]:
        """The name, and whether the guess comes from where its person has signed in before."""
        return folded(guess.name), _home(guess) in self._homes


def place(address: str) -> str:
    """What is one place: an address, or the network that somebody has to themselves.

    >>> place("192.0.2.7"), place("::ffff:192.0.2.7"), place("2001:db8::1:2:3:4"), place("2001:db8::1")
    ('192.0.2.7', '192.0.2.7', '2001:db8::/64', '2001:db8::/64')
    """
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv4Address):
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    return str(ipaddress.ip_network((int(found), _PREFIX), strict=False))


def _home(guess: Guess) -> tuple[str, str]:
    return folded(guess.name), place(guess.address)


def _keys(guess: Guess) -> tuple[str, str]:
    """What failures at a place are counted by: all of them, and those of one name, which stay when another gets in."""
    where = f"at {place(guess.address)}"
    return where, f"{folded(guess.name)} {where}"
