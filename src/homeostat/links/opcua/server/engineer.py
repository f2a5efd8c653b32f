"""The engineer's side of a served plant: faults, an operator's hands and misbehaviour, one line of text each."""

import asyncio
import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Protocol

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.tag import Range
from homeostat.links.opcua.server.behaviour import Behaviour
from homeostat.links.opcua.server.control_system import ControlSystem

USAGE: Final = (
    "say fault NAME SEVERITY, repair, operate TAG VALUE, release TAG, permit yes|no, acknowledge, status, wire, "
    "step N, refuse TAG, ignore TAG, clamp TAG LOW HIGH, quality NODE STATUS, text TAG, counter stands, clock SECONDS, "
    "silence, drop SECONDS, stall SECONDS or behave"
)
MOST_STEPS: Final = 100_000


class Faulty(Protocol):
    """A plant that faults can be put into."""

    def inject(self, faults: tuple[FaultState, ...]) -> None:
        """Let ``faults`` act from now on, instead of those before; KeyError where the plant has no such fault."""
        ...


class Engineer:
    """Carries lines out at a served plant."""

    def __init__(self, control: ControlSystem, plant: Faulty | None = None, nominal: Mapping[str, float] = {}) -> None:
        """``plant`` takes faults, None where it has none; ``nominal``: fault -> severity where none is said."""
        self._control, self._plant, self._nominal = control, plant, nominal
        self._orders: dict[str, Callable[[Sequence[str]], Any]] = {
            "fault": self._fault, "repair": self._repair, "operate": self._operate, "release": self._release,
            "permit": self._permit, "acknowledge": self._acknowledge, "status": self._status, "wire": self._wire,
            "step": self._step, "refuse": self._refuse, "ignore": self._ignore, "clamp": self._clamp,
            "quality": self._quality, "text": self._text, "counter": self._counter, "clock": self._clock,
            "silence": self._silence, "drop": self._drop, "stall": self._stall, "behave": self._behave,
        }  # fmt: skip

    def carry_out(self, line: str) -> dict[str, Any]:
        """``{"done": ...}``, or ``{"error": ...}`` where ``line`` says nothing that can be done."""
        word, *rest = line.split() or [""]
        try:
            return {"done": self._orders[word](rest)}
        except (KeyError, ValueError, IndexError) as wrong:
            if word not in self._orders:
                return {"error": f"{line!r} says nothing that can be done; {USAGE}"}
            return {"error": f"{line!r} cannot be done: {wrong}"}

    def _fault(self, rest: Sequence[str]) -> str:
        if self._plant is None:
            raise ValueError("the plant has no faults")
        name = rest[0]
        severity = float(rest[1]) if len(rest) > 1 else self._nominal[name]
        self._plant.inject((FaultState(name, severity, self._control.link.now_s),))
        return f"{name} of {severity:g} from {self._control.link.now_s:g} s on"

    def _repair(self, rest: Sequence[str]) -> str:
        if self._plant is None:
            raise ValueError("the plant has no faults")
        self._plant.inject(())
        return "repaired"

    def _operate(self, rest: Sequence[str]) -> str:
        self._control.operate(rest[0], None if rest[1] == "automatic" else float(rest[1]))
        return "moved"

    def _release(self, rest: Sequence[str]) -> str:
        self._control.release(rest[0])
        return "released"

    def _permit(self, rest: Sequence[str]) -> bool:
        self._control.permitted = rest[0] == "yes"
        return self._control.permitted

    def _acknowledge(self, rest: Sequence[str]) -> str:
        self._control.acknowledged = True
        return self._control.alarm

    def _status(self, rest: Sequence[str]) -> dict[str, Any]:
        accepted = self._control.link.leased
        return {**self._control.values(), "leased": accepted}

    def _wire(self, rest: Sequence[str]) -> list[Any]:
        return [
            {"at_s": a.at_s, "commands": [[c.tag, c.value, c.rate] for c in a.commands], "error": a.error}
            for a in self._control.link.wire_log
        ]

    def _step(self, rest: Sequence[str]) -> float:
        for _ in range(min(int(rest[0]), MOST_STEPS)):
            self._control.advance()
        return self._control.link.now_s

    def _refuse(self, rest: Sequence[str]) -> str:
        self._control.behaviour.refused.update(rest)
        return "refused"

    def _ignore(self, rest: Sequence[str]) -> str:
        self._control.behaviour.ignored.update(rest)
        return "ignored"

    def _clamp(self, rest: Sequence[str]) -> str:
        self._control.behaviour.clamped[rest[0]] = Range(float(rest[1]), float(rest[2]))
        return "clamped"

    def _quality(self, rest: Sequence[str]) -> str:
        self._control.behaviour.qualities[rest[0]] = rest[1]
        return rest[1]

    def _text(self, rest: Sequence[str]) -> str:
        self._control.behaviour.texts.update(rest)
        return "as text"

    def _counter(self, rest: Sequence[str]) -> str:
        self._control.behaviour.counter_stands = True
        return "the counter stands"

    def _clock(self, rest: Sequence[str]) -> float:
        self._control.behaviour.clock_offset_s = float(rest[0])
        return self._control.behaviour.clock_offset_s

    def _silence(self, rest: Sequence[str]) -> str:
        self._control.behaviour.silent_writes = True
        return "writes are not answered"

    def _drop(self, rest: Sequence[str]) -> float:
        self._control.behaviour.drop_every_s = float(rest[0])
        return self._control.behaviour.drop_every_s

    def _stall(self, rest: Sequence[str]) -> float:
        self._control.behaviour.stall_s = float(rest[0])
        return self._control.behaviour.stall_s

    def _behave(self, rest: Sequence[str]) -> str:
        self._control.behaviour = Behaviour()
        return "as it should"


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
