"""People first: runs of the mixing module in every mode, with a scripted person, in virtual time."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import FunctionType, MethodType, ModuleType
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered, StateEntered
from homeostat.domain.events.people import ModeEntered, PersonHeard, ServiceChanged
from homeostat.domain.events.trips import LatchReset, Tripped
from homeostat.domain.events.writes import LeaseLost, LeaseTried, WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Side, Verb
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.reference.unsupervised import fault_free, open_process
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.journal import Event, MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink, SimulatedWire
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Arrangement, new_sequencer, wire
from tests.equipment.links.misbehaving.link import LostHeartbeat, Misbehaving, NoLease

FAULT, OFFERED_S = "stuck_closed_VI202", 90.0
"""A fault that the search has an answer to, and when that has been offered at the latest [s]."""
Wish = tuple[float, Verb, dict[str, Any]]


@dataclass
class Person:
    """Orders what was scripted once its time has come; may react to what is offered."""

    script: list[Wish] = field(default_factory=list)
    offered: Callable[[RequestAnswered], list[tuple[Verb, dict[str, Any]]]] = lambda event: []
    now_s: float = 0.0
    count: int = 0
    waiting: list[PersonCommand] = field(default_factory=list)
    seen: list[tuple[Event, float]] = field(default_factory=list)

    def __call__(self, event: Event, at_s: float) -> None:
        self.seen.append((event, at_s))
        if isinstance(event, RequestAnswered) and event.status == "offered":
            for verb, about in self.offered(event):
                self.order(verb, **about)

    def order(self, verb: Verb, subject: str = "", digest: str = "", reason: str = "", name: str = "Ada") -> None:
        self.count += 1
        role = Role.ENGINEER
        self.waiting.append(PersonCommand(f"order-{self.count}", name, role, verb, subject, digest, reason))

    def orders(self) -> Iterator[PersonCommand]:
        self.now_s += 1.0  # one tick
        while self.script and self.script[0][0] <= self.now_s:
            _, verb, about = self.script.pop(0)
            self.order(verb, **about)
        given, self.waiting = self.waiting, []
        yield from given

    def of(self, kind: type) -> list[Any]:
        return [event for event, _ in self.seen if isinstance(event, kind)]

    @property
    def statuses(self) -> list[str]:
        first = self.of(RequestAnswered)[0].request
        return [e.status for e in self.of(RequestAnswered) if e.request == first]


def plant() -> Plant:
    return load_plant("mixing_module")


def operated(mode: Mode, person: Person, fault: str = "none", end_s: float = 130.0, persons: int = 1) -> Run:
    trace = MemoryTrace()
    trace.subscribe(person)
    operation = Operation(mode, orders=person.orders, persons=persons)
    return run(plant(), scenario(plant(), fault, 1, end_s=end_s), trace, DeclaredClock(1.0), operation=operation)


@pytest.mark.slow
def test_what_is_offered_is_written_after_a_yes_to_its_digest() -> None:
    def yes(event: RequestAnswered) -> list[tuple[Verb, dict[str, Any]]]:
        wrong = {"subject": event.request, "digest": "0" * 64}
        return [(Verb.APPROVE, wrong), (Verb.APPROVE, {"subject": event.request, "digest": event.digest})]

    person = Person(offered=yes)
    result = operated(Mode.APPROVE, person, FAULT)
    assert [h.done for h in person.of(PersonHeard)] == [False, True]
    assert "digest" in person.of(PersonHeard)[0].reason
    assert person.statuses == ["authorised", "offered", "verified", "accepted", "confirmed"]
    assert result.actor == "search" and result.state == "held"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "about", "ended"),
    [
        (Verb.REJECT, {"reason": "the hand valve is shut"}, ("refused", "CHK-PERSON", "Ada: the hand valve is shut")),
        pytest.param(
            Verb.MODE,
            {"subject": "observe"},
            ("withdrawn", "CHK-OVERTAKEN", "Ada changed the mode to 'observe'"),
            marks=pytest.mark.wide,
        ),
        (Verb.FALL_BACK, {"reason": "smoke"}, ("withdrawn", "CHK-OVERTAKEN", "a person ordered the fallback")),
    ],
)
def test_what_a_person_does_not_want_is_not_written(verb: Verb, about: dict[str, str], ended: tuple[str, ...]) -> None:
    person = Person(offered=lambda event: [(verb, {"subject": event.request, **about})])
    operated(Mode.APPROVE, person, FAULT, end_s=OFFERED_S)
    assert next(e.done for e in person.of(PersonHeard))
    last = next(e for e in person.of(RequestAnswered) if e.status == ended[0])
    assert (last.status, last.check, last.reason) == ended
    assert [w for w in person.of(WriteIntended) if w.cause.value == "request"] == []


def test_a_tag_out_of_service_is_not_written_and_the_limit_holds_all_the_same() -> None:
    person = Person([
        (5.0, Verb.OUT_OF_SERVICE, {"subject": "VI202.cmd", "reason": "maintenance"}),
        (56.0, Verb.RESET, {"reason": "the valve is repaired"}), (57.0, Verb.IN_SERVICE, {"subject": "VI202.cmd"}),
    ])  # fmt: skip
    operated(Mode.CLOSED_LOOP, person, end_s=60.0)
    assert [(e.tag, e.in_service) for e in person.of(ServiceChanged)] == [("VI202.cmd", False), ("VI202.cmd", True)]
    assert [w.source for w in person.of(WriteIntended)] == ["t0", "close"]  # not the step that would write it
    assert [e.limit for e in person.of(Tripped) if e.acted] == ["LIM-B201-HIGH"]
    assert [e.done for e in person.of(PersonHeard)] == [True] * 3
    back = Person([
        (5.0, Verb.OUT_OF_SERVICE, {"subject": "VI202.cmd", "reason": "maintenance"}),
        (37.0, Verb.IN_SERVICE, {"subject": "VI202.cmd"}),
    ])  # fmt: skip
    operated(Mode.CLOSED_LOOP, back, end_s=60.0)
    assert [w.source for w in back.of(WriteIntended)] == ["t0", "t1"]


def test_after_a_fallback_people_reset_choose_a_mode_and_start_again() -> None:
    person = Person([
        (5.0, Verb.FALL_BACK, {"reason": "smoke"}), (8.0, Verb.MODE, {"subject": "closed-loop"}),
        (9.0, Verb.RESET, {"reason": "false alarm", "name": "Ada"}),
        (10.0, Verb.RESET, {"reason": "false alarm", "name": "Bob"}),
        (12.0, Verb.START, {"subject": "t_restart_aborted"}), (13.0, Verb.MODE, {"subject": "approve"}),
        (15.0, Verb.START, {"subject": "t_restart_aborted"}),
    ])  # fmt: skip
    operated(Mode.APPROVE, person, end_s=40.0, persons=2)
    heard = [(e.verb, e.done) for e in person.of(PersonHeard)]
    assert heard == [
        ("fall-back", True), ("mode", False), ("reset", False), ("reset", True), ("start", False), ("mode", True),
        ("start", True),
    ]  # fmt: skip
    assert [e.persons for e in person.of(LatchReset)] == [("Ada", "Bob")]
    assert [e.mode for e in person.of(ModeEntered)] == ["approve", "observe", "approve"]
    assert [e.state for e in person.of(StateEntered)] == ["filling_B201", "aborted", "idle", "filling_B201"]


@pytest.mark.slow
@pytest.mark.parametrize("mode", [Mode.OBSERVE, pytest.param(Mode.ADVISE, marks=pytest.mark.wide)])
def test_nobody_writes_where_nobody_may_while_the_guard_follows_the_plant(mode: Mode) -> None:
    person = Person([
        (5.0, Verb.MODE, {"subject": "closed-loop"}), (6.0, Verb.FALL_BACK, {"reason": "smoke"}),
        (7.0, Verb.START, {"subject": "t1"}),
    ])  # fmt: skip
    operated(mode, person, FAULT, end_s=120.0)
    assert [e.done for e in person.of(PersonHeard)] == [False, False, False]
    assert person.of(WriteIntended) == []
    assert person.statuses == ["authorised", "advised"]


def test_the_plant_runs_its_own_recipe_and_the_guard_is_in_the_same_states() -> None:
    person = Person()
    result = operated(Mode.OBSERVE, person, end_s=130.0)
    entered = tuple((e.state, at_s) for e, at_s in person.seen if isinstance(e, StateEntered))
    alone = fault_free(plant(), Scenario("mixing_module", (), 1, 130.0))
    assert entered == alone.states and len(entered) == 4
    assert all((result.truth.signals[name] == alone.truth.signals[name]).all() for name in ("B201.level", "B202.level"))


def test_what_only_observes_has_no_way_to_write() -> None:
    """Nothing that the guard holds leads to the plant's wire, its lease, or the plant."""
    process = open_process(plant(), scenario(plant(), "none", 1, end_s=30.0))
    link = SimulatedLink(process, LinkConfiguration(recipe_by=Side.PLANT), new_sequencer(plant()).sample)
    observing = wire(plant(), None, DeclaredClock(0.0), MemoryTrace(), 1, Arrangement(mode=Mode.OBSERVE))
    observing.run(link.source)
    assert link.ended and link.wire_log == ()
    assert link.now_s == 30.0 and process.accepted["VI201.cmd"] == 1.0
    assert not [
        thing for thing in reached(observing) if isinstance(thing, SimulatedLink | SimulatedWire) or thing is process
    ]
    writing = wire(plant(), link, DeclaredClock(0.0), MemoryTrace(), 1)
    assert [thing for thing in reached(writing) if thing is link]


@pytest.mark.parametrize(
    "refused",
    [pytest.param((), id="at once"), pytest.param((NoLease(28.0, 80.0),), id="later", marks=pytest.mark.wide)],
)
def test_a_batch_goes_on_where_the_plant_stands_after_the_lease_was_lost(refused: tuple[NoLease, ...]) -> None:
    """The plant's own recipe takes the step that is due meanwhile; the guard takes the ones that follow."""
    process = open_process(plant(), scenario(plant(), "none", 1, end_s=300.0))
    beneath = SimulatedLink(process, recipe=new_sequencer(plant()).sample)
    link = Misbehaving(beneath, (LostHeartbeat(23.0, 29.0), *refused))
    person, trace = Person(), MemoryTrace()
    trace.subscribe(person)
    batch = wire(plant(), link, DeclaredClock(0.0), trace, 1)
    batch.run(link.source)
    assert len(person.of(LeaseLost)) == 1 and person.of(LeaseTried)[-1].given
    assert [e for e in person.of(ServiceChanged) if not e.in_service] == [] and person.of(Tripped) == []
    alone = [state for state, _ in fault_free(plant(), Scenario("mixing_module", (), 1, 300.0)).states]
    entered = [e.state for e in person.of(StateEntered)]
    assert entered == [state for state in alone if state in entered] and entered[-1] == alone[-1]
    assert len(entered) == (len(alone) if not refused else len(alone) - 1)
    attempts = [e.commands for e in person.of(WriteIntended)]
    assert attempts == [a.commands for a in link.wire_log] and len(attempts) >= 3


def reached(root: object) -> Iterator[object]:
    """Everything that ``root`` refers to, but for modules, classes and what functions find in their module."""
    waiting, seen = [root], set()
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, ModuleType | type):
            continue
        seen.add(id(thing))
        yield thing
        if isinstance(thing, FunctionType):
            waiting += [*(thing.__closure__ or ()), *(thing.__defaults__ or ())]
        elif isinstance(thing, MethodType):
            waiting += [thing.__self__, thing.__func__]
        else:
            waiting += gc.get_referents(thing)
