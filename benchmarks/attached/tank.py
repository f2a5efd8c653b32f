"""The scripted tank with a hard limit, and its guard as ``homeostat attach`` has it, in a process of its own.

``python -m benchmarks.attached.tank JSON`` guards until it is told to end.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from homeostat.domain.plant.limits import Limit, LimitKind, Limits
from homeostat.domain.plant.rules import GuardRules, QualityRule, TripRule
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.guard.settings import GuardSettings
from homeostat.links.opcua.mapping import mapping_of
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import Security
from homeostat.service.attached.guarding import Attaching, guard
from homeostat.stl.formula import parse
from tests.equipment.opcua.tank import TAGS, WRITABLES, tank_content

STALE_S: Final = 6.0
"""Age from which a reading is none, in process time [s]."""
GRACE_S: Final = 10.0
"""How long the limit may be undecided then, in process time [s]."""
_TRUE: Final = parse("L >= 0", TAGS)
MACHINE: Final = StateMachine(
    "tank",
    (
        State("running", "Running", 0, True, True, _TRUE, frozenset(), (SetpointRange("L.sp", 2.0, 12.0, 10.0),)),
        State("safe", "Safe", 1, False, False, _TRUE, frozenset(), (SetpointRange("L.sp", 2.0, 6.0, 5.0),)),
    ),
    (
        Transition("adjust", "running", "running", "fault_diagnosed", _TRUE),
        Transition("trip", "running", "safe", "trip", _TRUE),
    ),
)
HOT: Final = Limit("LIM-HOT", LimitKind.TRIP_LIMIT, parse("T <= 350", TAGS), True, "Test document 1", "The tank")
SAFE: Final = FallbackStrategy(
    "cool",
    ActionSet((Command("L.sp", 5.0, 2.0), Command("cool.man", 1.0, 1.0)), "safe"),
    serves={"LIM-HOT": Effect(30.0)},
)
RULES: Final = GuardRules(
    "tank", TAGS, MACHINE, Limits((HOT,), ()), {"LIM-HOT": TripRule("LIM-HOT", 2.0, GRACE_S)},
    {tag: QualityRule(tag, STALE_S) for tag in ("L", "T")}, WRITABLES, (SAFE,), configuration="tank-1",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Guarded:
    """What a tank is guarded with."""

    directory: str
    """Directory of journal and sockets."""
    port: int
    """Port of the server, or of what stands before it."""
    pki: str
    """Folder with key and certificates."""
    pace: float
    """Process seconds per wall-clock second."""

    @property
    def command(self) -> list[str]:
        """The command line of the process."""
        return [sys.executable, "-m", __spec__.name if __spec__ else __name__, json.dumps(asdict(self))]


def main(given: Guarded) -> int:
    attaching = Attaching(
        rules=RULES,
        mapping=mapping_of(tank_content(given.port, publish_s=0.25, answer_s=3.0, dead_s=3.0, retry_s=0.5), "tank"),
        security=Security(Pki(Path(given.pki))),
        directory=Path(given.directory),
        settings=(),
        guard=GuardSettings(persons=1, call_s=0.5),
        pace=given.pace,
        groups={},
        key=b"k" * 32,
    )
    return guard(attaching, os.open(os.devnull, os.O_WRONLY), os.getppid())


if __name__ == "__main__":
    sys.exit(main(Guarded(**json.loads(sys.argv[1]))))
