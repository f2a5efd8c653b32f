"""The engineer's side of a served plant: faults, an operator's hands and misbehaviour, one line of text each."""

import asyncio
import contextlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

from asyncua.ua.status_codes import StatusCodes

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.tag import Range
from homeostat.links.opcua.server.behaviour import Behaviour
from homeostat.links.opcua.server.control_system import ControlSystem
from homeostat.links.simulated import SimulatedLink

USAGE: Final = (
    "say fault NAME SEVERITY, repair, begin, operate TAG VALUE RATE, release TAG, permit yes|no, acknowledge, "
    "status, wire, step N, pace K, refuse TAG, ignore TAG, clamp TAG LOW HIGH, quality NODE STATUS, text TAG, "
    "counter stands, clock SECONDS, silence, drop SECONDS, stall SECONDS or behave"
)
MOST_STEPS: Final = 100_000
"""Most seconds of one step [s]."""
MOST_SCALE: Final = 1000.0
"""Fastest that a plant goes, process seconds per wall-clock second."""
MOST_STALL_S: Final = 600.0
"""Longest that a server stands, and longest between two cuts [s]."""
CLOCK_S: Final = 1e6
"""Largest error of a server's clock [s]."""


class Faulty(Protocol):
    """A plant that faults can be put into."""

    def inject(self, faults: tuple[FaultState, ...]) -> None:
        """Let ``faults`` act from now on, instead of those before; KeyError where the plant has no such fault."""
        ...


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated plant at its start."""

    link: SimulatedLink
    """The plant from outside."""
    faulty: Faulty | None = None
    """Takes its faults; None where it has none."""


class Engineer:
    """Carries lines out at a served plant."""

    def __init__(
        self,
        control: ControlSystem,
        faulty: Faulty | None,
        again: Callable[[], Simulated],
        nominal: Mapping[str, float] = {},
    ) -> None:
        """``faulty`` takes faults; ``again`` makes the plant anew; ``nominal``: fault -> severity if none is said."""
        self._control, self._faulty, self._again, self._nominal = control, faulty, again, nominal
        self._orders: dict[str, Callable[..., Any]] = {
            "fault": self._fault,
            "repair": self._repair,
            "operate": self._operate,
            "release": control.release,
            "permit": lambda word: self._permit(word == "yes"),
            "acknowledge": self._acknowledge,
            "status": self._status,
            "wire": self._wire,
            "step": self._step,
            "begin": self._begin,
            "pace": self._pace,
            "refuse": lambda *tags: self._wrong.refused.update(tags),
            "ignore": lambda *tags: self._wrong.ignored.update(tags),
            "clamp": lambda tag, low, high: self._wrong.clamped.update({tag: Range(float(low), float(high))}),
            "quality": self._quality,
            "text": self._text,
            "counter": lambda word: setattr(self._wrong, "counter_stands", word == "stands"),
            "clock": lambda seconds: setattr(self._wrong, "clock_offset_s", _number(seconds, -CLOCK_S, CLOCK_S)),
            "silence": lambda: setattr(self._wrong, "silent_writes", True),
            "drop": lambda seconds: setattr(self._wrong, "drop_every_s", _number(seconds, 0.0, MOST_STALL_S)),
            "stall": lambda seconds: setattr(self._wrong, "stall_s", _number(seconds, 0.0, MOST_STALL_S)),
            "behave": lambda: setattr(control, "behaviour", Behaviour()),
        }

    def carry_out(self, line: str) -> dict[str, Any]:
        """``{"done": ...}``, or ``{"error": ...}`` where ``line`` says nothing that can be done."""
        word, *rest = line.split() or [""]
        if word not in self._orders:
            return {"error": f"{line!r} says nothing that can be done; {USAGE}"}
        try:
            return {"done": self._orders[word](*rest)}
        except TypeError:
            return {"error": f"{line!r} has too many words or too few; {USAGE}"}
        except (LookupError, ValueError) as wrong:
            return {"error": f"{line!r} cannot be done: {wrong.args[0] if wrong.args else 'there is none'}"}

    @property
    def _wrong(self) -> Behaviour:
        return self._control.behaviour

    def _fault(self, name: str, severity: str = "") -> str:
        if self._faulty is None:
            raise ValueError("the plant has no faults")
        size, now_s = float(severity) if severity else self._nominal[name], self._control.link.now_s
        self._faulty.inject((FaultState(name, size, now_s),))
        return f"{name} of {size:g} from {now_s:g} s on"

    def _repair(self) -> None:
        if self._faulty is None:
            raise ValueError("the plant has no faults")
        self._faulty.inject(())

    def _operate(self, tag: str, value: str, rate: str = "") -> None:
        moved = None if value == "automatic" else float(value)
        self._control.operate(tag, moved, float(rate) if rate else None)

    def _permit(self, permitted: bool) -> None:
        self._control.permitted = permitted

    def _acknowledge(self) -> str:
        self._control.acknowledged = True
        return self._control.alarm

    def _status(self) -> dict[str, Any]:
        return {**self._control.values(), "leased": self._control.link.leased}

    def _wire(self) -> list[Any]:
        return [
            {"at_s": a.at_s, "commands": [[c.tag, c.value, c.rate] for c in a.commands], "error": a.error}
            for a in self._control.link.wire_log
        ]

    def _step(self, seconds: str) -> float:
        for _ in range(int(_number(seconds, 1, MOST_STEPS))):
            self._control.advance()
        return self._control.link.now_s

    def _quality(self, node: str, status: str) -> None:
        if node not in self._control.values():
            raise LookupError(f"there is no node {node!r}")
        if not hasattr(StatusCodes, status):
            raise LookupError(f"{status!r} is no status of OPC UA, as BadSensorFailure is")
        self._wrong.qualities[node] = status

    def _text(self, tag: str) -> None:
        if tag not in self._control.tags:
            raise LookupError(f"there is no reading {tag!r}")
        self._wrong.texts.add(tag)

    def _pace(self, scale: str) -> float:
        self._control.scale = _number(scale, 0.0, MOST_SCALE)
        return self._control.scale

    def _begin(self) -> float:
        made = self._again()
        self._faulty = made.faulty
        self._control.begin(made.link)
        return made.link.now_s


def _number(text: str, low: float, high: float) -> float:
    """``text`` as a number from ``low`` to ``high``; ValueError where it is none."""
    value = float(text)
    if not low <= value <= high:
        raise ValueError(f"{text} must be from {low:g} to {high:g}")
    return value


async def listen(engineer: Engineer, port: int, shown: Callable[[], Any]) -> asyncio.Server:
    """Take lines at ``port`` of this machine alone (0: any) and answer each with one line of JSON.

    ``shown`` is awaited after each line that was carried out: it brings the nodes up to date.
    """

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            while line := await reader.readline():
                answer = engineer.carry_out(line.decode("utf-8", "replace").strip())
                await shown()
                writer.write(json.dumps(answer).encode() + b"\n")
                await writer.drain()
        writer.close()

    return await asyncio.start_server(serve, "127.0.0.1", port)
