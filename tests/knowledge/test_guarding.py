"""What the guard needs of a plant comes out of its graph, with nothing missing."""

from __future__ import annotations

from functools import cache

import pytest

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import Command, Effect
from homeostat.knowledge.context.documents import documents
from tests.knowledge.tables import INSTALLED, reactor, store_of
from tests.plants.watching import described

PLANTS = ("cstr", "mixing_module")


@cache
def plant(name: str) -> PlantDescription:
    return described(INSTALLED / name)


@pytest.mark.parametrize("name", PLANTS)
def test_the_description_fills_the_rules_of_a_guard(name: str) -> None:
    d = plant(name)
    rules = GuardRules(
        plant=d.name, tags=d.tags_by_name, machine=d.machine, limits=d.limits, trips=d.trips, qualities=d.qualities,
        writables=d.writables, fallbacks=d.fallback_strategies, start_up=d.start_up,
    )  # fmt: skip
    assert {limit.name for limit in rules.limits.hard} == set(rules.trips)
    assert rules.start_up.states == {rules.machine.initial.name}
    assert rules.start_up.longest_s == {rules.machine.initial.name: {"cstr": 730.0, "mixing_module": 10.0}[name]}
    assert all(rules.trips[name].limit == name for name in rules.trips)
    assert all(rules.qualities[name].tag == name for name in rules.qualities)


@pytest.mark.parametrize("name", PLANTS)
def test_whatever_is_commanded_is_writable_and_admitted(name: str) -> None:
    d = plant(name)
    for strategy in d.fallback_strategies:
        target = d.machine.state(strategy.actions.target)
        for command in strategy.actions.commands:
            admitted = target.setpoint(command.tag)
            assert admitted is not None and command.value is not None
            assert admitted.low <= command.value <= admitted.high
    commanded = {r.tag for state in d.machine.states for r in state.setpoints}
    assert commanded == set(d.writables)


def test_only_the_permissive_that_pumping_out_violates_is_set_aside() -> None:
    waived = {s.name: set(s.waived) for name in PLANTS for s in plant(name).fallback_strategies if s.waived}
    assert waived == {"pump_out": {"PRM-DRAIN"}}
    assert all(reason for s in plant("mixing_module").fallback_strategies for reason in s.waived.values())


def test_every_hard_limit_is_brought_back_by_a_fallback_in_a_stated_time() -> None:
    for name in PLANTS:
        d = plant(name)
        served = {limit: s.name for s in d.fallback_strategies for limit in s.serves}
        assert served.keys() == {limit.name for limit in d.limits.hard}
    close, drain, pump_out = plant("mixing_module").fallback_strategies
    assert close.serves["LIM-B204-HIGH"] == Effect(30.0, rest=10.0)
    assert "LIM-B201-HIGH" in pump_out.serves and "LIM-B201-HIGH" not in drain.serves


def test_out_of_service_a_fallback_closes_and_stops_but_starts_nothing() -> None:
    for strategy in plant("mixing_module").fallback_strategies:
        forced = [c for c in strategy.actions.commands if c.tag in strategy.forced]
        assert forced and all(c.value == 0.0 for c in forced)
    for strategy in plant("cstr").fallback_strategies:
        assert strategy.forced == {"XV1.cmd", "F1.sp", "V2.man"}


@pytest.mark.parametrize("name", PLANTS)
def test_from_every_end_of_a_fallback_a_decision_leads_to_a_start(name: str) -> None:
    machine = plant(name).machine
    ends = {s.actions.target for s in plant(name).fallback_strategies}
    ends |= {t.target for t in machine.transitions if t.source in ends and not t.on_decision}
    restarts = {t.source: t for t in machine.transitions if t.event == "restart"}
    assert ends == set(restarts)
    assert all(t.on_decision and t.target == machine.initial.name for t in restarts.values())
    assert machine.initial.setpoints  # what a start is commanded


@pytest.mark.parametrize("name", PLANTS)
def test_no_recovery_is_planned_over_a_restart(name: str) -> None:
    machine = plant(name).machine
    values = {tag.name: tag.range.low for tag in plant(name).tags}
    for source in {t.source for t in machine.transitions if t.event == "restart"}:
        assert machine.is_end(source, "fault_diagnosed") or name == "mixing_module"
        assert all(
            t.event != "restart" for path in machine.paths(source, values, "fault_diagnosed", blocked=()) for t in path
        )


def test_a_start_hands_the_cooling_valve_back_to_its_loop() -> None:
    r = plant("cstr").machine.state("starting").setpoint("V2.man")
    assert r is not None and r.design is None and plant("cstr").writables["V2.man"].automatic
    assert Command("V2.man", r.design, None).value is None


def test_no_agent_is_told_what_the_guard_alone_needs() -> None:
    names = [d.name for d in documents(store_of(reactor()), "urn:homeostat:cstr#")]
    assert names and not [
        n for n in names if n.startswith(("quality_", "trip_", "writable_", "start_up_", "waiver_", "effect_"))
    ]
