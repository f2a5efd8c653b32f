"""Whose failed tries are counted together: guessing from one place must not keep people from the plant at another."""

from __future__ import annotations

import ipaddress
import threading
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
AT_ONCE: Final = 25
"""So many of them come as fast as their places allow: one place alone makes fewer. The others come one by one."""
SPACED_S: Final = 450.0
"""How far apart the others are, wall-clock [s]: whoever guesses from many places at once closes a name for so long and
not for an hour, and not where its person has signed in before."""
HOMES: Final = 20
"""Most places of one person that are remembered."""
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
    known: bool = False
    """Whether there is such an account: names that are made up do not drive its failures out of memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A guess that was let through, and counts as wrong until it is known to be right; each is itself and no other."""

    guess: Guess
    """What was tried."""
    at: float
    """When, by the clock of the guesses [s]."""
    source: tuple[str, bool]
    """The name, and whether it came from where its person had signed in before."""


@final
class Guesses:
    """Counts failures by name and place, those of people who are signed in apart; it may be asked from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Nobody has failed yet, or signed in; ``clock`` tells seconds and is set by nobody."""
        self._clock, self._alone = clock, threading.RLock()
        self._orders, self._places = Tries(clock, SIGNED_IN_S, _HOUR_S), Tries(clock, PLACE_S, _HOUR_S)
        self._hours: dict[tuple[str, bool], deque[Taken]] = {}
        self._made_up: dict[tuple[str, bool], deque[Taken]] = {}
        self._homes: dict[str, dict[str, None]] = {}

    def wait_s(self, guess: Guess) -> float:
        """How long ``guess`` must wait [s]; 0 where it need not."""
        with self._alone:
            if guess.signed_in:
                return self._orders.wait_s(folded(guess.name))
            return max(0.0, self._hour_s(guess), self._places.wait_s(*_keys(guess)))

    def _hour_s(self, guess: Guess) -> float:
        """How long the failures of the last hour under one name keep it waiting [s]."""
        now = self._clock()
        late = [one.at for one in self._late(guess).get(self._source(guess), ()) if now - one.at < _HOUR_S]
        if len(late) < AT_ONCE:
            return 0.0
        full_s = late[0] + _HOUR_S - now if len(late) >= HOURLY else 0.0
        return max(full_s, late[-1] + SPACED_S - now)

    def take(self, guess: Guess) -> Taken | None:
        """Let ``guess`` through, and count it as wrong before it is known: many at once are no way around that.

        None where it must wait.
        """
        with self._alone:
            if self.wait_s(guess) > 0.0:
                return None
            taken = Taken(guess, self._clock(), self._source(guess))
            if guess.signed_in:
                self._orders.failed(folded(guess.name), by=place(guess.address))
                return taken
            self._places.failed(*_keys(guess), by=folded(guess.name))
            late = self._late(guess)
            late[taken.source] = deque([*late.pop(taken.source, ()), taken], maxlen=HOURLY)
            while len(self._made_up) > MOST:
                self._made_up.pop(next(iter(self._made_up)))
            return taken

    def succeeded(self, taken: Taken) -> None:
        """What was ``taken`` was right: it is forgiven, and so are failures under the same name at the same place."""
        name, where = folded(taken.guess.name), place(taken.guess.address)
        with self._alone:
            if taken.guess.signed_in:
                self._orders.succeeded(name, by=where)
                return
            self._places.succeeded(*_keys(taken.guess), by=name)
            if (recent := self._late(taken.guess).get(taken.source)) is not None and taken in recent:
                recent.remove(taken)
            homes = self._homes.pop(name, {})
            homes.pop(where, None)
            homes[where] = None
            if len(homes) > HOMES:
                homes.pop(next(iter(homes)))
            self._homes[name] = homes
            while len(self._homes) > MOST:
                self._homes.pop(next(iter(self._homes)))

    def _late(self, guess: Guess) -> dict[tuple[str, bool], deque[Taken]]:
        """Failures of the last hour of names as that of ``guess``: of accounts, which are few, or made up."""
        return self._hours if guess.known else self._made_up

    def _source(self, guess: Guess) -> tuple[str, bool]:
        """The name, and whether the guess comes from where its person has signed in before."""
        name = folded(guess.name)
        return name, place(guess.address) in self._homes.get(name, ())


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


def _keys(guess: Guess) -> tuple[str, str]:
    """What failures at a place are counted by: all of them, and those of one name, which stay when another gets in."""
    where = f"at {place(guess.address)}"
    return where, f"{folded(guess.name)} {where}"
