"""The served reactor recovered over the wire at five times real time: ``python -m benchmarks.attached.recovered``.

The three published faults, in closed loop, in approve with a person who says yes, and in advise. Each run is a line of
a file, beside the run in one process with the same plant, and those that are there are not done again.
"""

from __future__ import annotations

import argparse
import os
import secrets
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import homeostat as hs
from benchmarks.arguments import names
from benchmarks.attached.rows import Rows
from benchmarks.host import commit
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.samples import ALWAYS
from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.wired.assembly import guard_rules
from homeostat.record.decode import decode
from homeostat.service.doors.asking import order
from homeostat.service.historian.observed import PROCESS_TIME
from homeostat.service.order import OrderError
from tests.equipment.opcua.attached import Attached, Reactor

FAST: Final = 20.0
"""Process seconds per second until the fault."""
SCALE: Final = 5.0
"""The same from then on."""
ONSET_S: Final = 1300.0
FAULTS: Final = {"cool_stuck_closed": (0.7, 500.0), "pump_degrade": (0.5, 500.0), "fouling": (0.7, 1100.0)}
"""Fault -> severity, and how long it is looked on after its onset [s]."""
MODES: Final = ("closed-loop", "approve", "advise")


def over_the_wire(fault: str, mode: str, folder: Path) -> dict[str, Any]:
    """What happens to the served reactor when ``fault`` comes, with ``mode`` ordered by a person."""
    severity, lasts_s = FAULTS[fault]
    with Reactor(folder, SCALE, "--heartbeat", "30") as reactor:
        text = reactor.mapping.read_text().replace("[connection]\n", "[connection]\npublish_s = 0.02\n")
        reactor.mapping.write_text(text)
        reactor.ask(f"pace {FAST}")
        live = folder / "live"
        with Attached(reactor, live) as attached:
            attached.waits_for(lambda now: now["thinking"]["process"] and now["now_s"], "thinking")
            _order(live, Verb.MODE, mode)
            attached.waits_for(lambda now: now["now_s"] >= ONSET_S - SCALE, "the onset", 300.0)
            reactor.ask(f"pace {SCALE}")
            began, before = time.monotonic(), len(reactor.commands)
            reactor.ask(f"fault {fault} {severity}")
            onset_s = float(reactor.ask("status")["Plant/Time"])
            said = _watch(attached, onset_s + lasts_s)
            now, written = attached.status, reactor.commands[before:]
            leased = reactor.ask("status")
            attached.interrupt()
        wall_s = time.monotonic() - began
    found = [decode(record) for record in read_events(live) if record.at_s >= onset_s - 60.0]
    released = [e for e in found if isinstance(e, hs.events.ReleasedActions)]
    return {
        "onset_s": onset_s,
        "wall_s": round(wall_s),
        "written": written,
        "heartbeat": leased["Guard/Heartbeat"],
        "states": [e.state for e in found if isinstance(e, hs.events.StateEntered)],
        "released": [[[c.tag, c.value] for c in e.commands] for e in released],
        "offered": [e.request for e in found if isinstance(e, hs.events.RequestAnswered) and e.status == "advised"],
        "diagnosed": [e.hypotheses[0].name for e in found if isinstance(e, hs.events.Diagnosed) and e.hypotheses][:3],
        "fallbacks": sum(isinstance(e, hs.events.FallbackActivated) for e in found),
        "why": [e.reason for e in found if isinstance(e, hs.events.FallbackActivated)],
        "approved": said,
        "mode": now["mode"]["actual"],
        "state": now["state"],
        "missed": now["link"]["missed"],
        "hottest": _hottest(Path(f"{live}.history"), onset_s),
        "complete": verify(live).complete,
    }


def _watch(attached: Attached, until_s: float) -> int:
    """Say yes to whatever is offered, until process time ``until_s``; how often that was."""
    said = 0
    while (now := attached.status) and now["now_s"] < until_s:
        for request, digest in now["offered"].items():
            said += _order(attached.directory, Verb.APPROVE, request, digest)
        time.sleep(0.2)
    return said


def _order(live: Path, verb: Verb, subject: str, digest: str = "") -> bool:
    """Whether the guard did what a person ordered."""
    command = PersonCommand(secrets.token_hex(8), "Ada", Role.ENGINEER, verb, subject, digest, "study")
    try:
        return order(live, command).done
    except OrderError:
        return False


def _hottest(folder: Path, onset_s: float) -> float:
    """Mean of the ten hottest readings from the onset on [K]: one alone is noise."""
    found = EmbeddedHistory(folder).read(["T1", PROCESS_TIME], ALWAYS)
    value = found["T1"].value[-len(found[PROCESS_TIME].value) :]
    return round(float(sorted(value[found[PROCESS_TIME].value >= onset_s])[-10:][0]), 2)


def in_one_process(fault: str, onset_s: float) -> dict[str, Any]:
    """The same plant and fault in one process, whose thinking costs what it takes at that scale."""
    severity, lasts_s = FAULTS[fault]
    done = hs.run(
        "cstr", hs.Fault(fault, severity, onset_s), seed=1, end_s=onset_s + lasts_s, thinking=hs.declared(SCALE)
    )
    released = done.events(hs.events.ReleasedActions)
    return {
        "outcome": str(done.outcome),
        "states": [e.state for e in done.events(hs.events.StateEntered)],
        "released": [[[c.tag, c.value] for c in e.commands] for e in released],
    }


def farthest(one: Sequence[Sequence[Any]], other: Sequence[Sequence[Any]]) -> float | None:
    """The largest difference of two sets of commands, as a share of the tag's range; None where they command others."""
    tags, theirs = guard_rules(hs.load_plant("cstr")).tags, dict(map(tuple, other))
    if {tag for tag, *_ in one} != theirs.keys() or any((v is None) != (theirs[tag] is None) for tag, v, *_ in one):
        return None
    return max((abs(v - theirs[tag]) / tags[tag].range.span for tag, v, *_ in one if v is not None), default=0.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=names, default=list(FAULTS))
    parser.add_argument("--modes", type=names, default=list(MODES))
    parser.add_argument("--at-once", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/attached/recovered.jsonl"))
    options = parser.parse_args()
    rows, taking = Rows(options.out), threading.Lock()
    done = {(row["fault"], row["mode_ordered"]) for row in rows.all()}
    jobs = [(f, m) for m in options.modes for f in options.faults if (f, m) not in done]

    def work() -> None:
        while True:
            with taking:
                if not jobs:
                    return
                fault, mode = jobs.pop(0)
            with tempfile.TemporaryDirectory(prefix="recovered") as folder:
                row = {"commit": commit(), "fault": fault, "mode_ordered": mode}
                try:
                    row |= over_the_wire(fault, mode, Path(folder))
                    row["beside"] = in_one_process(fault, row["onset_s"])
                    pairs = zip(row["released"], row["beside"]["released"], strict=False)
                    row["apart"] = [farthest(*pair) for pair in pairs][:1]
                except AssertionError as never:
                    print(fault, mode, str(never)[:3000], flush=True)
                    row["never"] = str(never)[:200]
                rows.add(row | {"load": round(os.getloadavg()[0], 1)})

    workers = [threading.Thread(target=work, daemon=True) for _ in range(options.at_once)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


if __name__ == "__main__":
    main()
