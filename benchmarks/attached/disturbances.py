"""What happens to links: servers die, stand and lie about the time, networks swallow, certificates end."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from benchmarks.attached.rig import HEARTBEAT_S, Never, Rig

NOTICED_S: Final = 15.0
"""Longest that a certificate that has ended may go on unnoticed once it counts, wall-clock [s]."""


class Seen(NamedTuple):
    """What came of one disturbance."""

    lasted_s: float
    """How long the plant's side was away, wall-clock [s]."""
    back_s: float
    """From its return until the guard had a sample again, wall-clock [s]."""
    shed_s: float | None = None
    """From our death, as the plant sees it, until its own control took over [s]; None where it was not looked for."""
    dead_s: float = 0.0
    """How long we were dead to the plant [s]."""


def _killed(rig: Rig, chance: random.Random) -> Seen:
    lasted_s = chance.uniform(0.5, 8.0)
    rig.server.kill()
    began = time.monotonic()
    time.sleep(lasted_s)
    rig.server.start()
    rig.lost.append(rig.asking.asked)
    return Seen(time.monotonic() - began, rig.back())


def _stalled(*stalls: float) -> Callable[[Rig, random.Random], Seen]:
    def disturb(rig: Rig, chance: random.Random) -> Seen:
        began, worst = time.monotonic(), 0.0
        for k, seconds in enumerate(stalls):
            if k:
                time.sleep(3.0)
            rig.server.freeze(True)
            time.sleep(seconds)
            rig.server.freeze(False)
            worst = max(worst, rig.back()) if k == len(stalls) - 1 else worst
        return Seen(time.monotonic() - began - worst, worst)

    return disturb


def _client_frozen(rig: Rig, chance: random.Random) -> Seen:
    lasted_s = chance.uniform(12.0, 25.0)
    rig.freeze_guard(True)
    shed_s = rig.shed_within(lasted_s)
    time.sleep(max(lasted_s - (lasted_s if shed_s is None else shed_s), 0.0))
    rig.freeze_guard(False)
    return Seen(lasted_s, rig.back(), shed_s, lasted_s)


def _cut(rig: Rig, chance: random.Random) -> Seen:
    rig.proxy.cut()
    return Seen(0.0, rig.back())


def _half_open(rig: Rig, chance: random.Random) -> Seen:
    lasted_s = chance.uniform(2.0, 25.0)
    rig.proxy.swallow(True)
    dead = lasted_s >= HEARTBEAT_S + 2.0
    shed_s = rig.shed_within(lasted_s) if dead else None
    time.sleep(max(lasted_s - ((shed_s or lasted_s) if dead else 0.0), 0.0))
    rig.proxy.swallow(False)
    return Seen(lasted_s, rig.back(), shed_s, lasted_s if dead else 0.0)


def _clock(rig: Rig, chance: random.Random) -> Seen:
    """The server's clock is 10 s off for a while: data go on, and the mode goes down."""
    rig.server.ask(f"clock {chance.choice((-10, 10))}")
    worst = 0.0
    rig.wait(lambda: rig.mode == "observe", "observe", 20.0)
    worst = max(worst, rig.back())
    lasted_s = chance.uniform(1.0, 5.0)
    before = rig.arrived[-1:]
    time.sleep(lasted_s)
    if rig.arrived[-1:] != before:
        raise Never("something was written while the clocks differed")
    rig.server.ask("clock 0")
    return Seen(lasted_s, max(worst, rig.back()))


def _certificate(side: str) -> Callable[[Rig, random.Random], Seen]:
    def disturb(rig: Rig, chance: random.Random) -> Seen:
        """The connection ends when the certificate of one side has; it is renewed a while later."""
        rig.swap(side)
        _renewed(rig, side)
        rig.wait(lambda: rig.status.get("link", {}).get("trouble"), "the refusal", NOTICED_S)
        before, lasted_s = rig.samples, chance.uniform(3.0, 8.0)
        time.sleep(lasted_s)
        let_in = rig.samples > before
        rig.swap(side)
        _renewed(rig, side)
        if let_in:
            raise Never("data came although the certificate had ended")
        return Seen(lasted_s, rig.back())

    return disturb


def _renewed(rig: Rig, side: str) -> None:
    """Let what was put into the folder of ``side`` count."""
    if side == "served":
        rig.server.kill()
        rig.server.start()
        rig.lost.append(rig.asking.asked)
    else:
        rig.proxy.cut()


DISTURBANCES: Final[Mapping[str, Callable[[Rig, random.Random], Seen]]] = {
    "server killed": _killed,
    "server stands 3 s": _stalled(3.0),
    "server stands 15 s": _stalled(15.0),
    "server stands 3 s, goes on 3 s, stands 15 s": _stalled(3.0, 15.0),
    "guard stands": _client_frozen,
    "network cut": _cut,
    "half-open": _half_open,
    "clock 10 s off": _clock,
    "server's certificate ended": _certificate("served"),
    "link's certificate ended": _certificate("link"),
}
"""Name -> what is done."""
