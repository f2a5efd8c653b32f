"""Two thousand tags at 1 Hz: ``python -m benchmarks.attached.many [--tags N] [--minutes M]``.

A scripted plant is served by a process of its own, a guard is attached to it here as ``homeostat attach`` has it, and a
historian keeps what it sees. A row has what a tick took, what was missed, memory, and room of the history.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import psutil

from benchmarks.attached.rows import Rows
from benchmarks.attached.tank import GRACE_S, HOT, MACHINE, SAFE, STALE_S
from benchmarks.host import commit
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import GuardRules, QualityRule, TripRule
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.guard.settings import GuardSettings
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.samples import ALWAYS
from homeostat.links.opcua.extra import need_opcua
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import mapping_of
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import Security
from homeostat.links.opcua.server.control_system import ControlSystem
from homeostat.links.opcua.server.endpoint import Serving
from homeostat.links.opcua.server.engineer import Engineer, Simulated
from homeostat.links.opcua.server.serve import serve
from homeostat.links.simulated import SimulatedLink
from homeostat.service.attached.guarding import Attaching, _Guarding, _opened
from homeostat.service.historian.observed import PROCESS_TIME
from tests.equipment.links.scripted import PlantScript, ScriptedPlant, ScriptedTag
from tests.equipment.opcua.process import ServerProcess
from tests.equipment.opcua.served import make_pkis
from tests.equipment.opcua.tank import TAGS, WRITABLES, tank_content

STEPS: Final = 1 << 14
"""Steps of a transmitter."""
SETTLE: Final = 30
"""First ticks that are not counted: everything is subscribed to meanwhile."""


def names(count: int) -> tuple[str, ...]:
    """The tags beside those of the tank."""
    return tuple(f"unit{k // 50:02d}.PI{k:04d}" for k in range(count - len(TAGS)))


class Coarse(ScriptedPlant):
    """A plant whose transmitters have steps, as those of control systems do."""

    def advance(self) -> dict[str, float]:  # type: ignore[override]
        step = 100.0 / STEPS
        return {tag: round(v / step) * step if "PI" in tag else v for tag, v in super().advance().items()}


def served(count: int, pki: str) -> None:
    """Serve the plant until this process is ended."""
    need_opcua()
    more = tuple(ScriptedTag(name, 50.0, noise=0.1) for name in names(count))
    own = (ScriptedTag("L", 10.0, {"L.sp": 1.0}, lag_s=5.0, noise=0.01), ScriptedTag("T", 300.0, noise=0.01))
    script = PlantScript((*own, *more), {"L.sp": 10.0, "cool.man": None}, 1e9)

    def simulated() -> Simulated:
        return Simulated(SimulatedLink(Coarse(script)))

    tags = TAGS | {name: Tag(name, Role.PV, "bar", Range(0.0, 100.0), 1.0) for name in names(count)}
    control = ControlSystem(simulated().link, tags, {tag: rule.automatic for tag, rule in WRITABLES.items()})

    def ready(port: int, engineers: int) -> None:
        print(f"opc.tcp://127.0.0.1:{port}/homeostat/; engineer at 127.0.0.1:{engineers}", flush=True)

    serving = Serving(port=0, scale=1.0, pki=Pki(Path(pki)))
    asyncio.run(serve(control, Engineer(control, None, simulated), serving, 0, ready))


def attaching(count: int, port: int, pki: Path, folder: Path) -> Attaching:
    """What the guard is attached with."""
    tags = TAGS | {name: Tag(name, Role.PV, "bar", Range(0.0, 100.0), 1.0) for name in names(count)}
    rules = GuardRules(
        "many", tags, MACHINE, Limits((HOT,), ()), {"LIM-HOT": TripRule("LIM-HOT", 2.0, GRACE_S)},
        {tag: QualityRule(tag, STALE_S) for tag in tags if tag not in WRITABLES}, WRITABLES, (SAFE,),
        configuration="many-1",
    )  # fmt: skip
    content = tank_content(port, publish_s=0.25, answer_s=10.0, dead_s=10.0, retry_s=0.5)
    content["tags"] |= {name: {"node": f"ns=2;s={name}"} for name in names(count)}
    return Attaching(
        rules=rules, mapping=mapping_of(content, "many"), security=Security(Pki(pki)), directory=folder / "live",
        settings=(), guard=GuardSettings(call_s=0.5), pace=1.0, groups={}, key=b"k" * 32, history=folder / "kept",
    )  # fmt: skip


def measured(count: int, minutes: float, folder: Path) -> dict[str, Any]:
    """Guard for ``minutes``; what that took."""
    pkis = make_pkis(folder / "pki")
    server = ServerProcess()
    server.start(
        [sys.executable, "-m", "benchmarks.attached.many", "--served", json.dumps([count, str(pkis[0].folder)])]
    )
    given = attaching(count, server.port, pkis[1].folder, folder)
    given.directory.mkdir()
    directory, records = _opened(given)
    listens, says = os.pipe()
    module, ours = "homeostat.service.historian", (str(says), str(os.getpid()))
    command = [sys.executable, "-m", module, str(given.directory), str(given.history), *ours]
    historian = psutil.Process(subprocess.Popen(command, pass_fds=(says,)).pid)
    os.set_blocking(listens, False)
    walls, cpus, memory, missed = list[float](), list[float](), list[float](), 0
    me, cpu = psutil.Process(), 0.0
    try:
        with directory:
            link = OpcuaLink(given.mapping, given.rules, given.security, given.pace)
            guarding = _Guarding(given, directory, records, link)
            read, ended = guarding._reader.read, [0.0, 0.0]

            def timed(tick_s: float) -> Any:
                found = read(tick_s)
                ended[:] = [time.perf_counter(), time.thread_time()]
                return found

            guarding._reader.read = timed  # type: ignore[method-assign]
            until = time.monotonic() + 60.0 * minutes
            while time.monotonic() < until or len(walls) <= SETTLE:
                guarding.tick()
                walls.append(time.perf_counter() - ended[0])
                cpus.append(time.thread_time() - ended[1])
                with contextlib.suppress(BlockingIOError):
                    os.read(listens, 4096)
                if len(walls) % 60 == SETTLE:
                    memory.append(me.memory_info().rss / 1e6)
                if len(walls) == SETTLE:
                    cpu, missed = sum(me.cpu_times()[:2]), guarding.source._link.missed
            ticks = guarding._board.told()["ticks"]
            spent = sum(me.cpu_times()[:2]) - cpu
            kept = sum(historian.cpu_times()[:2])
            missed = guarding.source._link.missed - missed
            guarding.stop("measured")
        historian.terminate()
        historian.wait(60.0)
    finally:
        server.kill()
    assert given.history is not None
    history = EmbeddedHistory(given.history)
    times = history.read([PROCESS_TIME], ALWAYS)[PROCESS_TIME].value
    room = sum(path.stat().st_size for path in given.history.rglob("*.parquet"))
    wall, thread = (np.percentile(np.array(column[SETTLE:]) * 1e3, [50, 99, 100]) for column in (walls, cpus))
    return {
        "tags": count,
        "ticks": len(walls) - SETTLE,
        "without": ticks["without"],
        "missed": missed,
        "wall_ms": [round(v, 1) for v in wall],
        "cpu_ms": [round(v, 1) for v in thread],
        "guard_cores": round(spent / max(len(walls) - SETTLE, 1), 3),
        "historian_cores": round(kept / len(walls), 3),
        "memory_mb": [round(memory[0]), round(memory[-1])],
        "gaps": int((np.diff(times) > 1.5).sum()),
        "samples": len(times) * (count + 1),
        "bytes_per_sample": round(room / max(len(times) * (count + 1), 1), 2),
        "load": round(os.getloadavg()[0], 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tags", type=int, default=2000)
    parser.add_argument("--minutes", type=float, default=120.0)
    parser.add_argument("--served", type=json.loads, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, default=Path("runs/attached/many.jsonl"))
    options = parser.parse_args()
    if options.served:
        served(*options.served)
        return
    with tempfile.TemporaryDirectory(prefix="many") as folder:
        Rows(options.out).add({"commit": commit(), **measured(options.tags, options.minutes, Path(folder))})


if __name__ == "__main__":
    main()
