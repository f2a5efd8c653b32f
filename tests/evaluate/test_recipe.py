"""Who runs the nominal sequence: the plant's own recipe or the guard, changed during a run of the batch plant."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from homeostat.domain.events.guard import GuardStarted, SequenceLoaded, StateEntered
from homeostat.domain.events.people import AlarmRaised, ModeEntered, ServiceChanged
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.reference.unsupervised import Unsupervised, fault_free, open_process
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.guard.sequence.recognition import Evidence, followed
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.links.truth.process import TrueProcess
from homeostat.plants.plant import Plant, load_plant
from tests.evaluate.test_operation import FAULT, Person

END_S = 350.0
"""A batch takes some 320 s."""


@cache
def case(recipe: Side = Side.GUARD) -> Plant:
    return replace(load_plant("mixing_module"), recipe=recipe)


def operated(
    person: Person, recipe: Side = Side.GUARD, mode: Mode = Mode.CLOSED_LOOP, fault: str = "none", end_s: float = END_S
) -> Run:
    trace = MemoryTrace()
    trace.subscribe(person)
    operation = Operation(mode, orders=person.orders)
    plant = case(recipe)
    return run(plant, scenario(plant, fault, 1, end_s=end_s), trace, DeclaredClock(1.0), operation=operation)


def states(person: Person) -> list[str]:
    return [e.state for e in person.of(StateEntered)]


def causes(person: Person) -> list[str]:
    return [w.cause.value for w in person.of(WriteIntended)]


def alone() -> Unsupervised:
    return fault_free(case(), Scenario("mixing_module", (), 1, END_S))


def test_brought_to_observe_the_plant_carries_its_recipe_on_from_where_it_stands() -> None:
    person = Person([(100.0, Verb.MODE, {"subject": "observe", "reason": "a look"})])
    result = operated(person)
    assert states(person) == [state for state, _ in alone().states] and result.state == "complete"
    assert max(at_s for e, at_s in person.seen if isinstance(e, WriteIntended)) <= 101.0
    assert person.of(ServiceChanged) == [], "the plant's own recipe is nobody's hand"


def test_brought_back_the_guard_goes_on_where_the_plants_recipe_stands() -> None:
    person = Person([
        (60.0, Verb.MODE, {"subject": "observe", "reason": "a look"}),
        (150.0, Verb.MODE, {"subject": "closed-loop", "reason": "seen"}),
    ])  # fmt: skip
    result = operated(person)
    assert states(person) == [state for state, _ in alone().states] and result.state == "complete"
    sources = [(w.source, at_s) for w, at_s in person.seen if isinstance(w, WriteIntended)]
    assert [s for s, at_s in sources if at_s < 60.0] == ["t0", "t1"]
    assert [s for s, at_s in sources if at_s > 60.0] == ["t5", "t6", "t7"], "what the plant has done is not done again"
    assert [e.mode for e in person.of(ModeEntered)] == ["closed-loop", "observe", "closed-loop"]


def test_with_the_recipe_at_the_plant_the_guard_writes_no_step_of_it_and_is_in_its_states() -> None:
    person = Person()
    result = operated(person, Side.PLANT)
    entered = tuple((e.state, at_s) for e, at_s in person.seen if isinstance(e, StateEntered))
    assert person.of(WriteIntended) == [] and entered == alone().states and result.state == "complete"
    assert person.of(GuardStarted)[0].recipe == "plant" and person.of(ServiceChanged) == []


@pytest.mark.slow
def test_requests_go_all_the_same_and_the_plants_recipe_waits_for_their_steps() -> None:
    person = Person()
    result = operated(person, Side.PLANT, fault=FAULT, end_s=200.0)
    beside = Person()
    again = operated(beside, Side.GUARD, fault=FAULT, end_s=200.0)
    assert result.actor == again.actor == "search" and result.state == again.state
    assert "request" in causes(person)
    first = causes(person).index("request")
    assert set(causes(person)[:first]) == set(), "what is nominal is the plant's"
    assert person.of(ServiceChanged) == []


@pytest.mark.slow
def test_what_was_released_ends_in_observe_and_the_batch_goes_on_by_the_recipe_from_where_it_stands() -> None:
    person = Person([(145.0, Verb.MODE, {"subject": "observe"}), (150.0, Verb.MODE, {"subject": "closed-loop"})])
    trace = MemoryTrace()
    trace.subscribe(person)
    what = scenario(case(), "clogging", 3, onset_s=100.0, severity=0.98, end_s=400.0, location="main")
    result = run(case(), what, trace, DeclaredClock(1.0), operation=Operation(orders=person.orders))
    assert result.state == "complete" and result.actor == "search"
    (cause,) = [e.cause for e in person.of(AlarmRaised) if e.alarm == "withdrawn"]
    assert "'t5_bypass', 't6_bypass', 't7'" in cause
    speeds = [(c.value, at_s) for w, at_s in person.seen if isinstance(w, WriteIntended) for c in w.commands
              if c.tag == "P102.cmd" and c.value]  # fmt: skip
    assert {v for v, at_s in speeds if at_s < 145.0} == {1.0}
    loaded = next(e for e, at_s in person.seen if isinstance(e, SequenceLoaded) and at_s > 145.0)
    ahead = {c.value for step in loaded.steps for c in step.commands if c.tag == "P102.cmd" and c.value}
    assert ahead == {0.9}, "by the recipe, until something costs less"
    assert person.of(ServiceChanged) == []


def test_a_fallback_acts_and_the_recipe_stands_until_a_person_starts_again() -> None:
    person = Person([
        (60.0, Verb.FALL_BACK, {"reason": "smoke"}), (90.0, Verb.RESET, {"reason": "none"}),
        (120.0, Verb.MODE, {"subject": "closed-loop"}), (125.0, Verb.START, {"subject": "t_restart_aborted"}),
    ])  # fmt: skip
    operated(person, Side.PLANT, end_s=180.0)
    entered = [(e.state, at_s) for e, at_s in person.seen if isinstance(e, StateEntered)]
    assert [s for s, _ in entered][:5] == ["filling_B201", "filling_B202", "aborted", "idle", "filling_B201"]
    assert entered[3][1] > 125.0 and causes(person) == ["fallback", "person"]


def locally_controlled(process: TrueProcess) -> tuple[SimulatedLink, LocalControl]:
    local = LocalControl(case(), guarded=True, leased=lambda: link.leased)
    link = SimulatedLink(process, LinkConfiguration(), local.sample)
    return link, local


def test_a_held_batch_is_not_begun_again_by_local_control() -> None:
    """Everything closed is idle, held and complete alike: what the guard said last tells them apart."""
    for said, begins in (("idle", True), ("held", False), ("complete", False), ("aborted", False)):
        process = open_process(case(), scenario(case(), "none", 1, end_s=30.0))
        link, local = locally_controlled(process)
        link.take()
        link.advance()
        local.tell(Told(said))
        link.give_back()
        for _ in range(3):
            link.advance()
        assert (process.accepted["VI201.cmd"] == 1.0) is begins


def test_local_control_begins_nothing_where_nobody_can_tell_where_the_plant_stands() -> None:
    process = open_process(case(), scenario(case(), "none", 1, end_s=30.0))
    link, local = locally_controlled(process)
    link.take()
    link.advance()
    local.tell(Told("filling_B201"))  # but its inlet is closed, as in every state at rest
    link.give_back()
    for _ in range(5):
        link.advance()
    assert set(process.accepted.values()) == {0.0}


def test_a_guard_that_dies_leaves_the_recipe_to_the_plant_unless_a_fallback_has_acted() -> None:
    for latched in (False, True):
        process = open_process(case(), scenario(case(), "none", 1, end_s=60.0))
        link, local = locally_controlled(process)
        link.take()
        link.beat()
        link.advance()
        local.tell(Told("idle", latched))
        for _ in range(8):  # no heartbeat any more
            link.advance()
        assert link.shed and (process.accepted["VI201.cmd"] == 1.0) is not latched


def test_a_state_out_of_turn_is_recognised_where_only_one_fits() -> None:
    machine, rules = case().description.machine, case().description.writables
    closed = dict.fromkeys(rules, 0.0)

    def where(believed: str, accepted: dict[str, float], **values: float) -> str | None:
        readings = Snapshot(1.0, {tag.replace("_", "."): value for tag, value in values.items()}, accepted=accepted)
        return followed(machine, Evidence(readings, rules), believed)

    assert where("complete", closed | {"VI202.cmd": 1.0}) == "filling_B202"
    assert where("filling_B202", closed | {"VI202.cmd": 0.99}) == "filling_B202"
    assert where("held", closed) == "held"
    assert where("filling_B202", closed, P101_speed=0.0, P102_speed=0.0) is None
