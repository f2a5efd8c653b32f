"""The scripted tank, served by a process of its own: ``python -m tests.equipment.opcua.tank_server JSON``."""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

from homeostat.links.opcua.extra import need_opcua
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.server.control_system import ControlSystem
from homeostat.links.opcua.server.endpoint import Serving
from homeostat.links.opcua.server.engineer import Engineer, Simulated
from homeostat.links.opcua.server.serve import serve
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from tests.equipment.links.scripted import ScriptedPlant
from tests.equipment.opcua.tank import TAGS, WRITABLES, never_ending


def main(given: dict[str, Any]) -> None:
    need_opcua()
    configuration = LinkConfiguration(heartbeat_s=given.pop("heartbeat_s", 10.0))

    def simulated() -> Simulated:
        return Simulated(SimulatedLink(ScriptedPlant(never_ending()), configuration))

    writable = {tag: rule.automatic for tag, rule in WRITABLES.items()}
    control = ControlSystem(simulated().link, TAGS, writable, given.pop("two_step", False))
    pki, login, engineer = given.pop("pki", None), given.pop("login", None), given.pop("engineer_port", 0)
    serving = Serving(pki=pki and Pki(Path(pki)), login=login and tuple(login), **given)

    def ready(port: int, engineers: int) -> None:
        print(f"opc.tcp://127.0.0.1:{port}/homeostat/; engineer at 127.0.0.1:{engineers}", flush=True)

    asyncio.run(serve(control, Engineer(control, None, simulated), serving, engineer, ready))


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
