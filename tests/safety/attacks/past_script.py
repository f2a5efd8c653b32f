# mypy: ignore-errors
"""Attacks on commit 170fbcd: run with that commit's ``src`` and ``tests`` on the path; JSON lines in, JSON lines out.

It knows nothing of the present code. A line is ``{"call": name, ...}``; the answer is the report as plain data.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import shutil
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from homeostat.agents.rehearsal import TwinRehearsal
from homeostat.assurance.executive import Executive, nominal_route
from homeostat.assurance.gate import Gate, Refused
from homeostat.domain.limits import Limits
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve
from homeostat.plant.clock import DeclaredClock
from homeostat.trace import MemoryTrace
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring, ScriptedPlanning
from tests.safety.attacks.plant import AttackedPlant, from_data
from tests.safety.world import CALM, DRAIN, FEED, HOT, TAGS, VENT, Says
from tests.supervisor.line import GOOD, MACHINE, LineTwin, Stage

LIMITS = Limits((HOT, FEED), (CALM,))
FALLBACKS = (DRAIN.actions.commands, VENT.actions.commands)
PATIENCE_S = 1.0
"""Wall-clock time after which something waits for ever [s]."""


class Trace(MemoryTrace):
    """A trace that fails as the attack says."""

    def __init__(self, attack):
        super().__init__()
        self.attack = attack

    def record(self, event, at_s):
        if self.attack.journal and at_s >= self.attack.journal_s:
            raise OSError(28, f"No space left on device ({self.attack.journal})")
        super().record(event, at_s)


class PastPlant:
    """Implements the plant's port of that time."""

    def __init__(self, plant, clock, trace, driven, until_s):
        self.plant, self.clock, self.trace, self.driven, self.until_s = plant, clock, trace, driven, until_s
        self.sample = lambda snapshot: ()
        self.seen, self.owed_s = [], 0.0

    async def snapshots(self):
        given = 0
        while True:
            while given == len(self.seen):
                if self.plant.now_s >= min(self.plant.attack.end_s, self.until_s):
                    return
                if self.plant.now_s >= self.plant.attack.stops_s:
                    raise asyncio.CancelledError
                self.second()
            yield self.seen[given]
            given += 1

    async def since(self, at_s):
        self.catch_up()
        return tuple(s for s in self.seen if s.at_s > at_s) or (self.seen[-1],)

    async def write(self, commands):
        self.catch_up()
        kinds = ("released", "fell-back")
        events = [e.event.commands for e in self.trace.entries if e.event.kind in kinds]
        plain = [(c.tag, c.value) for c in commands]
        if not self.plant.send(plain, commands in events, commands in FALLBACKS):
            if self.plant.busy_until_s < self.plant.now_s:
                await asyncio.Event().wait()
            while self.plant.now_s < self.plant.busy_until_s:
                await asyncio.sleep(0)
                if not self.driven:
                    self.second()

    def catch_up(self):
        self.owed_s += self.clock.collect_s()
        while self.owed_s >= 1.0 and not self.plant.ended:
            self.owed_s -= 1.0
            self.second()

    def second(self):
        self.plant.second()
        if self.plant.now_s % self.plant.attack.step_s:
            return
        seen = self.plant.sample()
        if seen is not None:
            snapshot = Snapshot(seen["at_s"], seen["values"], frozenset(seen["bad"]))
            self.seen.append(snapshot)
            self.sample(snapshot)


class Attacked(Stage):
    """A supervisor on the attacked plant."""

    def __init__(self, plant, trace, until_s=math.inf, driven=False):
        attack = plant.attack
        self.attacked, self.until_s, self.driven, self.kept = plant, until_s, driven, trace
        error = attack.error

        class Hanging(ScriptedAction):
            async def act(self, situation, path, advice):
                if attack.hangs:
                    await asyncio.Event().wait()
                return await super().act(situation, path, advice)

        notices = tuple(t for t in attack.notices_s if t > plant.now_s)
        super().__init__(
            Hanging(GOOD),
            monitoring=ScriptedMonitoring(*notices),
            clock=DeclaredClock(attack.thinking_s),
            limits=LIMITS,
        )
        if error:
            self.twin.instrument_errors = lambda hypotheses: ({"T": error},)

    def __post_init__(self):
        attack = self.attacked.attack
        route = nominal_route(self.machine, {state.name: () for state in self.machine.states})
        self.executive = Executive(self.machine, self.limits, route)
        self.trace = self.kept
        self.plant = PastPlant(self.attacked, self.clock, self.trace, self.driven, self.until_s)
        self.plant.sample = self.executive.sample
        self.twin = LineTwin(attack.heating)
        self.rehearsal = TwinRehearsal(self.twin, self.limits, TAGS)
        self.gate = Gate(self.plant, self.limits, DRAIN, self.rehearsal, self.executive)
        self.planning = ScriptedPlanning(MACHINE, ("reduce",))


def supervise(attack):
    plant, trace = AttackedPlant(attack), Trace(attack)
    stage = Attacked(plant, trace, min(attack.dies_s, attack.end_s))
    ended = ended_by(stage.supervisor().supervise())
    if attack.dies_s < attack.end_s:
        stage = Attacked(plant, trace)
        ended = ended_by(stage.supervisor().supervise())
    return report(plant, stage, ended)


def ended_by(coroutine):
    """Why it ended; empty where it came to its end."""
    try:
        asyncio.run(asyncio.wait_for(coroutine, PATIENCE_S))
    except TimeoutError:
        return "waits for ever"
    except asyncio.CancelledError:
        return "stopped"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return ""


def request(attack):
    """Asks straight to the gate, whose rehearsal says yes to everything."""
    plant, trace = AttackedPlant(attack), Trace(attack)
    stage = Attacked(plant, trace, driven=True)
    gate, port, refused = stage.gate, stage.plant, plant.report.refused
    gate._rehearsal = Says()

    class Slow(Says):
        def rehearse(self, fresh, actions):
            port.owed_s += 25.0
            return super().rehearse(fresh, actions)

    async def ask(one):
        actions = ActionSet(tuple(Command(*c) for c in one.commands), "reduced")
        digest = "0" if one.forged == "altered" else actions.digest
        if one.forged == "delayed":
            gate._rehearsal = Slow()
        try:
            await gate.release(actions, Approve(digest, ()), plant.now_s)
            if one.forged == "replayed":
                await gate.release(actions, Approve(digest, ()), plant.now_s)
        except Refused as reason:
            refused.append(str(reason))

    async def drive():
        tasks = []
        while not plant.ended:
            port.second()
            if port.seen:
                tasks += [asyncio.create_task(ask(one)) for one in attack.asks if one.at_s == plant.now_s]
                if plant.now_s == attack.trip_s:
                    tasks.append(asyncio.create_task(gate.fall_back("ordered")))
            for _ in range(3):
                await asyncio.sleep(0)
        await asyncio.gather(*tasks)

    return report(plant, stage, ended_by(drive()))


def report(plant, stage, ended):
    found = plant.report
    found.accepted, found.latched, found.ended = plant.accepted, stage.gate.latched, ended
    found.journal = [[e.event.kind, e.at_s] for e in stage.trace.entries]
    return asdict(found)


def batch(end_s):
    """The nominal batch of the mixing module: what reached its ramps, what came by its port, what was recorded."""
    from homeostat.campaign.runner import run
    from homeostat.campaign.scenario import Scenario
    from homeostat.cases.case import load_case
    from homeostat.plant.simulated import SimulatedPlant

    taken, written = [], []
    command, write = SimulatedPlant._command, SimulatedPlant.write

    def noted(self, commands):
        taken.append([self._now_s, [[c.tag, c.value] for c in commands]])
        command(self, commands)

    async def counted(self, commands):
        written.append(commands)
        await write(self, commands)

    SimulatedPlant._command, SimulatedPlant.write = noted, counted
    trace = MemoryTrace()
    try:
        run(load_case("mixing_module"), Scenario("mixing_module", (), 3, end_s), trace, DeclaredClock(1.0))
    finally:
        SimulatedPlant._command, SimulatedPlant.write = command, write
    intended = [[e.at_s, e.event.kind] for e in trace.entries if getattr(e.event, "commands", ())]
    healthy = len(taken) // 2  # the fault-free run that the score is relative to is the same plant once more
    return {"wire": taken[:healthy], "written": len(written), "intended": intended}


def loads(plant, file, before, after):
    """Why a shipped plant does not load with one text in one of its files replaced; empty where it does."""
    from homeostat.cases import case as module
    from homeostat.cases.error import CaseError
    from homeostat.knowledge.graph_error import GraphError

    cases = Path(module.__file__).parent
    copy = cases / f"{plant}_{os.getpid()}"
    shutil.copytree(cases / plant, copy, ignore=shutil.ignore_patterns("__pycache__"))
    try:
        path = copy / file
        text = path.read_text(encoding="utf-8")
        assert before in text, f"{before!r} is not in {path}"
        path.write_text(text.replace(before, after, 1), encoding="utf-8")
        module.load_case(copy.name)
    except (CaseError, GraphError) as refused:
        return f"{refused}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    finally:
        shutil.rmtree(copy)
    return ""


def verifies(forgery):
    """Whether a run that was forged and chained again is called complete."""
    from homeostat.trace import Journal, Summary, verify
    from homeostat.trace.decisions import ReleasedActions, StateEntered
    from homeostat.trace.verify import digest
    from tests.safety.attacks.forging import forge

    folder = Path(tempfile.mkdtemp())
    try:
        commands = (Command("F.sp", 0.015, 0.005),)
        with Journal(folder / "run") as journal:
            journal.record(StateEntered("running"), 1.0)
            actions = ActionSet(commands, "reduced")
            event = ReleasedActions("search", commands, actions.digest, "reduced", 0.5)
            journal.record(event, 2.0)
            journal.record(StateEntered("reduced"), 3.0)
            journal.close(Summary(1, "recovered"))
        forge(folder / "run", forgery, digest)
        return verify(folder / "run").complete
    finally:
        shutil.rmtree(folder)


def answer(line):
    call = json.loads(line)
    match call.pop("call"):
        case "supervise":
            return supervise(from_data(call["attack"]))
        case "request":
            return request(from_data(call["attack"]))
        case "batch":
            return batch(**call)
        case "loads":
            return loads(**call)
        case "verifies":
            return verifies(**call)


if __name__ == "__main__":
    out, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        try:
            said = {"answer": answer(line)}
        except Exception as error:
            said = {"error": f"{type(error).__name__}: {error}"}
        out.write(json.dumps(said) + "\n")
        out.flush()
