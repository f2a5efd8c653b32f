"""The subject of the present: this code."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.observation import FallBack, Trouble
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import GuardRules, QualityRule, StartUp, TripRule, WriteRule
from homeostat.domain.ports import GuardEvent, Ticket
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import Request, RequestStatus, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.restart.memory import Memory
from homeostat.guard.sequence.sequencer import nominal_route
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Journal, MemoryTrace, Signature, Summary
from homeostat.journal.chain import digest
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.verify.verify import verify
from homeostat.knowledge.store.error import GraphError
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import wire
from homeostat.recovery.exchange.exchange import Exchange, ExchangeSettings
from homeostat.recovery.exchange.loop import Loop
from homeostat.recovery.exchange.worker import Worker
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring, ScriptedPlanning, diagnosis
from tests.plants.copies import Copy
from tests.recovery.line import DRAIN, GOOD, KEY, MACHINE, VENT, LineTwin, Stage
from tests.safety.attacks.forging import forge
from tests.safety.attacks.plant import Ask, Attack, AttackedPlant, Report
from tests.safety.world import CALM, FEED, HOT, TAGS, rule

LIMITS = Limits((HOT, FEED), (CALM,))
FALLBACKS = (DRAIN.actions.commands, VENT.actions.commands)
SCALE = 200.0
"""Process seconds per wall-clock second where something hangs."""
DELAY_S = 25.0
"""How much later an ask that is delayed reaches the guard [s]."""


class FailingTrace:
    """A trace in memory that fails as the attack says."""

    def __init__(self, attack: Attack) -> None:
        self.inner = MemoryTrace()
        self._attack, self._released = attack, threading.Event()
        if attack.journal == "subscriber":
            self.inner.subscribe(self._raise)

    def record(self, event: GuardEvent, at_s: float) -> None:
        self._fail(at_s, ("full", "hang"))
        self.inner.record(event, at_s)

    def sync(self) -> None:
        self._fail(self._at_s, ("sync",))

    def subscribe(self, subscriber: Callable[[Any, float], None]) -> None:
        self.inner.subscribe(subscriber)

    def let_go(self) -> None:
        """Whatever hangs goes on."""
        self._released.set()

    _at_s = 0.0

    def _fail(self, at_s: float, kinds: tuple[str, ...]) -> None:
        self._at_s = at_s
        if self._attack.journal in kinds and at_s >= self._attack.journal_s and not self._released.is_set():
            if self._attack.journal == "full":
                raise OSError(28, "No space left on device")
            self._released.wait()

    def _raise(self, event: object, at_s: float) -> None:
        if at_s >= self._attack.journal_s:
            raise RuntimeError("a subscriber is broken")


@dataclass
class Answer:
    """A ticket of the attacked plant's wire."""

    plant: AttackedPlant
    done_s: float
    error: str = ""

    @property
    def done(self) -> bool:
        return self.plant.now_s >= self.done_s


class Link:
    """Lease and source of the attacked plant."""

    never_blocks = True

    def __init__(self, plant: AttackedPlant, trace: MemoryTrace, until_s: float) -> None:
        self.plant, self._trace, self._until_s = plant, trace, until_s

    @property
    def now_s(self) -> float:
        return self.plant.now_s

    @property
    def ended(self) -> bool:
        return self.plant.now_s >= min(self.plant.attack.end_s, self._until_s)

    def advance(self) -> Snapshot | None:
        if self.plant.now_s >= self.plant.attack.stops_s:
            raise KeyboardInterrupt
        for _ in range(int(self.plant.attack.step_s)):
            self.plant.second()
        seen = self.plant.sample()
        if seen is None:
            return None
        return Snapshot(
            seen["at_s"], seen["values"], frozenset(seen["bad"]), taken_s=seen["taken_s"], accepted=self.plant.read_back
        )

    def take(self) -> Link:
        return self

    def beat(self) -> None:
        """Nothing sheds here."""

    def give_back(self) -> None:
        """Nothing sheds here."""

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        intended = any(isinstance(e.event, WriteIntended) and e.event.commands == commands for e in self._trace.entries)
        at_once = self.plant.send([(c.tag, c.value) for c in commands], intended, commands in FALLBACKS)
        hangs = not at_once and self.plant.busy_until_s < self.plant.now_s
        return Answer(self.plant, float("inf") if hangs else self.plant.busy_until_s if not at_once else 0.0)


class Attacked(Stage):
    """A guard, and recovery beside it, on the attacked plant."""

    def __init__(self, plant: AttackedPlant, trace: FailingTrace, until_s: float, memory: Memory | None = None) -> None:
        self.attacked, self.failing, self.memory = plant, trace, memory
        self.link, self.stop = Link(plant, trace.inner, until_s), threading.Event()
        attack = plant.attack
        notices = tuple(t for t in attack.notices_s if t > plant.now_s)
        measured = attack.hangs or attack.journal == "hang"
        answer = self._never if attack.hangs == "diagnosis" else diagnosis
        super().__init__(
            self._action(attack.hangs), monitoring=ScriptedMonitoring(*notices, answer=answer), limits=LIMITS,
            clock=ThinkingClock(SCALE) if measured else DeclaredClock(attack.thinking_s),  # type: ignore[arg-type]
            heating=attack.heating,
        )  # fmt: skip
        if attack.error:
            self.twin.instrument_errors = lambda hypotheses: ({"T": attack.error},)  # type: ignore[method-assign]

    def __post_init__(self) -> None:
        self.twin = LineTwin(self.heating)
        self.trace, self.shared = self.failing.inner, self.failing  # type: ignore[assignment]
        self.planning = ScriptedPlanning(MACHINE, ("reduce",))
        attachment = Attachment(self.shared, self.link, keys={"check": KEY}, memory=self.memory)
        # A busy machine is no part of an attack: only a journal that is attacked is given up after a short while.
        settings = GuardSettings() if self.attacked.attack.journal else GuardSettings(sync_s=10.0)
        self.guard = Guard(self._rules(), attachment, settings)
        settings = ExchangeSettings(tick_s=self.attacked.attack.step_s)
        self.exchange = Exchange(self.clock, self.guard.mailbox.put, self._trouble, settings)

    def run(self) -> Attacked:
        """Run to the end, to a stop, or to the moment at which the process is killed."""
        worker = Worker(self.exchange, self._recovery().supervise, self._trouble)
        worker.start()
        try:
            Loop(self.guard, self.link, self.exchange).run_virtual()
        except KeyboardInterrupt:
            self.attacked.report.ended = "stopped"
        finally:
            self.stop.set()
            self.failing.let_go()
            worker.join(2.0)
            if self.attacked.ended or self.attacked.report.ended:
                self.guard.stop("the run is over")
        return self

    def _rules(self) -> GuardRules:
        route = nominal_route(self.machine, {state.name: () for state in self.machine.states})
        hotter = replace(rule("LIM-HOT", HOT.kind, "T <= 350", hard=True))
        return GuardRules(
            "line", TAGS, self.machine, self.limits, {"LIM-HOT": TripRule("LIM-HOT", 0.5, 6.0)},
            {"T": QualityRule("T", 5.0, noise=0.02, frozen_s=10.0), "L": QualityRule("L", 5.0)},
            {"F.sp": WriteRule("F.sp", 0.0005, 3.0), "V.man": WriteRule("V.man", 0.01, 3.0, automatic=True)},
            tuple(replace(s, waived=frozenset({"PRM-FEED"})) for s in (DRAIN, VENT)), route,
            StartUp(frozenset({"starting"}), {"LIM-HOT": hotter}),
        )  # fmt: skip

    def _trouble(self, cause: str) -> None:
        self.guard.mailbox.put(Trouble("recovery", cause))

    def _never(self, at_s: float) -> Any:
        """A diagnosis that never lets go of its thread."""
        while not self.stop.is_set():
            time.sleep(0.002)
        return diagnosis(at_s)

    def _action(self, hangs: str) -> ScriptedAction:
        stop = self.stop

        class Hanging(ScriptedAction):
            """Action that answers never: it waits, or never lets go."""

            async def act(self, situation: Any, path: Any, advice: Any) -> Any:
                while hangs == "action" and not stop.is_set():
                    time.sleep(0.002)
                if hangs == "planning":
                    await asyncio.Event().wait()
                return await super().act(situation, path, advice)

        return Hanging(GOOD)


class Present:
    """Implements :class:`tests.safety.attacks.adapter.Subject` over this code."""

    def __init__(self, folder: Path) -> None:
        """``folder`` is empty."""
        self._folder, self._copies = folder, 0

    def supervise(self, attack: Attack) -> Report:
        plant, trace = AttackedPlant(attack), FailingTrace(attack)
        stage = Attacked(plant, trace, attack.dies_s).run()
        if attack.dies_s < attack.end_s:
            stage = Attacked(plant, trace, attack.end_s, Memory.of(trace.inner.records())).run()
        return _report(plant, stage)

    def request(self, attack: Attack) -> Report:
        plant, trace = AttackedPlant(attack), FailingTrace(attack)
        stage = Attacked(plant, trace, attack.end_s)
        guard, link, kept = stage.guard, stage.link, list[Request]()
        while not link.ended:
            snapshot = link.advance()
            for ask in attack.asks:
                for asked in _asked(ask, plant.now_s):
                    guard.mailbox.put(asked)
                    kept += [asked] if ask.forged == "altered-later" else []
            if plant.now_s == attack.trip_s:
                guard.mailbox.put(FallBack("ordered"))
            seen = guard.tick(plant.now_s, snapshot)
            for asked in kept:
                for command in asked.actions.commands:
                    object.__setattr__(command, "value", 0.05)
            plant.report.refused += [a.reason for a in seen.answers if a.status is RequestStatus.REFUSED]
        guard.stop("the run is over")
        return _report(plant, stage)

    def batch(self, end_s: float) -> dict[str, Any]:
        case, trace = load_plant("mixing_module"), MemoryTrace()
        link = SimulatedLink(open_process(case, Scenario(case.name, (), 3, end_s)))
        wire(case, link, DeclaredClock(1.0), trace, seed=3).run(link.source)
        sent = [[a.at_s, [[c.tag, c.value] for c in a.commands]] for a in link.wire_log]
        intended = [
            [e.at_s, [[c.tag, c.value] for c in e.event.commands]]
            for e in trace.entries
            if isinstance(e.event, WriteIntended)
        ]
        return {"wire": sent, "written": len(sent), "intended": intended}

    def loads(self, plant: str, file: str, before: str, after: str) -> str:
        self._copies += 1
        copy = Copy.of(plant, self._folder / str(self._copies))
        copy.replace(file, before, after)
        try:
            case = copy.load()
        except (PlantError, GraphError) as refused:
            return str(refused)
        return f"made again: {', '.join(case.remade)}" if case.remade else ""

    def verifies(self, forgery: str) -> bool:
        self._copies += 1
        key, folder = SigningKey(bytes(32)), self._folder / str(self._copies)
        actions = ActionSet((Command("F.sp", 0.015, 0.005),), "reduced")
        with Journal(folder, key) as journal:
            journal.record(StateEntered("running"), 1.0)
            journal.record(ReleasedActions.of("search", actions, 0.5), 2.0)
            journal.record(StateEntered("reduced"), 3.0)
            journal.close(Summary(1, "recovered"))
        assert verify(folder, {key.public}).complete
        forge(folder, forgery, digest)
        report = verify(folder, {key.public})
        return report.complete and report.vouched.signature is Signature.TRUSTED


def _asked(ask: Ask, now_s: float) -> list[Request]:
    """What reaches the guard's mailbox at ``now_s`` [s]."""
    forged, made_s = ask.forged, now_s - (DELAY_S if ask.forged == "delayed" else 0.0)
    if made_s != ask.at_s:
        return []
    commands = [Command(t, v if v is None or math.isfinite(v) else 0.0, rate) for t, v, rate in ask.commands]
    actions = ActionSet(tuple(commands), "reduced")
    name = f"r{ask.at_s:g}-{len(ask.commands)}"
    configuration = "another" if forged == "configuration" else ""
    plain = Request(name, "x", "running", actions, ("reduce",), "d", configuration, Seal("", 0.0, 0.0, "", ""))
    sealed_s = made_s + {"old": -1e6, "future": 100.0, "nan": float("nan")}.get(forged, 0.0)
    request = Sealer("check", b"own" if forged == "self-made" else KEY).seal(plain, sealed_s)
    if forged == "altered":
        request = replace(request, actions=replace(actions, commands=(Command("F.sp", 0.05, 0.005),)))
    for command, (_, value, _) in zip(commands, ask.commands, strict=True):
        object.__setattr__(command, "value", value)  # what the class itself refuses
    return [request, request] if forged == "replayed" else [request]


def _report(plant: AttackedPlant, stage: Attacked) -> Report:
    found, guard = plant.report, stage.guard
    found.accepted, found.latched = plant.accepted, guard.latched
    found.journal = [[e.event.kind, e.at_s] for e in stage.trace.entries]
    found.alarms = [a.id for a in guard.alarms]
    return found
