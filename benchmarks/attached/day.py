"""A day of the served reactor at twenty times real time, a fault every two hours: ``tools/attached_day.sh``.

One directory goes on where it was stopped: each fault is a line of a file, with how it ended. After each the script
repairs the plant, resets the latch, and raises the mode again, as people would.
"""

from __future__ import annotations

import argparse
import os
import secrets
import time
from itertools import cycle, islice
from pathlib import Path
from typing import Any, Final

import psutil

from benchmarks.attached.rows import Rows
from benchmarks.host import commit
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.journal import Record, read_events
from homeostat.service.doors.asking import order
from homeostat.service.order import OrderError
from tests.equipment.opcua.attached import Attached, Reactor

SCALE: Final = 20.0
EVERY_S: Final = 7200.0
"""Process time from one fault to the next [s]."""
LASTS_S: Final = 1800.0
"""How long a fault lasts before it is repaired [s]."""
FAULTS: Final = (("cool_stuck_closed", 0.7), ("pump_degrade", 0.5), ("cool_stuck_open", 0.7), ("inlet_stuck_open", 0.7))
COUNTED: Final = ("released", "fallback-activated", "diagnosed", "tripped", "alarm-raised", "lease-lost")


def ordered(live: Path, verb: Verb, subject: str = "") -> bool:
    """Whether the guard did what a person ordered."""
    command = PersonCommand(secrets.token_hex(8), "Ada", Role.ENGINEER, verb, subject, reason="a day")
    try:
        return order(live, command).done
    except OrderError:
        return False


def counted(live: Path, since_s: float) -> dict[str, int]:
    """How often what happened since process time ``since_s`` [s]."""
    records: list[Record] = [record for record in read_events(live) if record.at_s >= since_s]
    return {kind: sum(record.kind == kind for record in records) for kind in COUNTED}


def raised(attached: Attached) -> None:
    """Have the guard in closed loop, without a latch, with every tag in service, and the plant started again."""
    for _ in range(300):
        now = attached.status
        if not now:
            time.sleep(0.5)
            continue
        if now["latched"]:
            ordered(attached.directory, Verb.RESET)
        for tag in now["out_of_service"]:
            ordered(attached.directory, Verb.IN_SERVICE, tag)
        if now["mode"]["actual"] == "closed-loop" and not now["latched"] and now["state"] != "shutdown":
            return
        ordered(attached.directory, Verb.MODE, "closed-loop")
        if now["state"] == "shutdown":
            ordered(attached.directory, Verb.START, "t_restart")
        time.sleep(0.5)


def one(attached: Attached, reactor: Reactor, fault: str, severity: float, lasts_s: float) -> dict[str, Any]:
    """One fault from its onset to its repair; what came of it."""
    raised(attached)
    now = attached.status
    ticks, begin_s = now["ticks"], now["now_s"]
    reactor.ask(f"fault {fault} {severity}")
    attached.waits_for(lambda then: then["now_s"] >= begin_s + lasts_s, "its end", 600.0)
    end = attached.status
    happened = counted(attached.directory, begin_s)
    reactor.ask("repair")
    memory = psutil.Process(end["guard_process"]).memory_info().rss / 1e6
    return {
        "fault": fault, "at_s": begin_s, "state": end["state"], "latched": bool(end["latched"]), **happened,
        "without": end["ticks"]["without"] - ticks["without"], "missed": end["link"]["missed"],
        "memory_mb": round(memory, 1), "load": round(os.getloadavg()[0], 1),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="process time [h]")
    parser.add_argument("--every", type=float, default=EVERY_S, help="from one fault to the next [s]")
    parser.add_argument("--dir", type=Path, default=Path("runs/attached/day"))
    options = parser.parse_args()
    folder: Path = options.dir.resolve()  # what it starts works in folders of its own
    rows = Rows(folder / "faults.jsonl")
    planned = list(islice(cycle(FAULTS), int(options.hours * 3600.0 / options.every)))[len(rows.all()) :]
    served = folder / f"served{len(list(folder.glob('served*')))}"  # a server that begins anew has new keys
    served.mkdir(parents=True)
    with Reactor(served, SCALE, "--heartbeat", "60") as reactor:
        text = reactor.mapping.read_text().replace("[connection]\n", "[connection]\npublish_s = 0.02\n")
        reactor.mapping.write_text(text)
        with Attached(reactor, folder / f"live{served.name[6:]}") as attached:
            attached.waits_for(lambda now: now["thinking"]["process"] and now["state"] == "normal", "normal", 600.0)
            for fault, severity in planned:
                due_s = attached.status["now_s"] + options.every
                lasts_s = min(LASTS_S, options.every / 2)
                rows.add({"commit": commit(), **one(attached, reactor, fault, severity, lasts_s)})
                raised(attached)
                attached.waits_for(lambda now, due_s=due_s: now["now_s"] >= due_s, "the next", 1200.0)


if __name__ == "__main__":
    main()
