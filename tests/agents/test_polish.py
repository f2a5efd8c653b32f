"""Polishing: somebody else's numbers are bettered where they stand, on their own path, and never made worse."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from homeostat.agents.checks import command_findings
from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Situation
from homeostat.agents.search import action
from homeostat.agents.search.cost import Cost
from homeostat.domain.advice import Advice
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.plants.plant import load_plant
from homeostat.twin.twin import Purpose
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, QUICK, now, search, stuck
from tests.twin.followed import follow, reactor

D = reactor().description
STATE = D.machine.state("reduced_load")
PATH = RecoveryPath(D.machine, (next(t for t in D.machine.transitions if t.name == "t_reduce"),))


def proposed(feed: float, temperature: float = 308.0) -> ActionSet:
    """Commands of somebody who knows what the state admits."""
    chosen = {"F1.sp": feed, "T1.sp": temperature}
    values = {r.tag: chosen.get(r.tag, r.design) for r in STATE.setpoints}
    rates = {tag: None if value is None else D.tags_by_name[tag].rate_limit for tag, value in values.items()}
    return ActionSet(tuple(Command(tag, value, rates[tag]) for tag, value in values.items()), STATE.name)


def polished(actions: ActionSet, path: RecoveryPath = PATH) -> ActionSet:
    return asyncio.run(search().polish(now(), path, actions))


def test_a_controller_of_a_stuck_actuator_is_held_by_hand_whoever_proposes_and_stays_there() -> None:
    """On automatic it would go to the end of its range, and the valve with it once it is mended."""
    mine = proposed(0.02)
    assert (order := mine.command("V2.man")) is not None and order.value is None
    found = asyncio.run(search().tracked(now(), PATH, mine))
    held = found.command("V2.man")
    assert held is not None and held.value is not None and 0.05 < held.value < 0.95
    assert [c for c in found.commands if c.tag != "V2.man"] == [c for c in mine.commands if c.tag != "V2.man"]
    assert command_findings(found, STATE, D.tags_by_name) == ()
    assert asyncio.run(search().tracked(now(), PATH, found)) is found, "nothing winds up behind it any more"
    better = polished(found)
    assert better.command("V2.man") == held and total(better) < total(mine)


def total(actions: ActionSet) -> float:
    """Cost with the penalties of what is missing, on the members that refinement uses."""
    twin = follow(stuck()[:NOW_S]).frozen()
    cost = Cost(D.limits, Pricing(reactor().prices, D.limits, D.scales), D.scales, slack=0.08)
    many = twin.ensemble(plausible(DIAGNOSIS), twin.settings.draws, Purpose.REFINE)
    signals = twin.try_many(many, twin.schedules([actions], twin.settings.horizon_s))
    return float(cost.of(*signals, many.weights, [actions])[0])


@pytest.mark.parametrize(("feed", "temperature"), [(0.01, 308.0), (0.033, 310.0)])
def test_too_little_and_too_much_are_both_bettered(feed: float, temperature: float) -> None:
    """Too little gives product away, too much is too hot with the valve stuck."""
    given = proposed(feed, temperature)
    better = polished(given)
    assert total(better) < total(given) - 0.01
    assert better.target == given.target and command_findings(better, STATE, D.tags_by_name) == ()


def test_what_is_bettered_already_stays_near_as_cheap() -> None:
    once = polished(proposed(0.01))
    twice = polished(once)
    assert total(twice) <= total(once) + 0.002


def test_a_search_begins_with_what_is_known_and_ends_no_worse() -> None:
    """With hardly any time for a look around, it keeps what was found before with all the time that it takes."""
    before = asyncio.run(search().act(now(), PATH, Advice()))
    asked: list[str] = []

    def known(situation: Situation, target: str) -> list[ActionSet]:
        asked.append(target)
        return [before]

    hasty = replace(QUICK, coarse=(), finalists=1, fine=())
    without = asyncio.run(search(hasty).act(now(), PATH, Advice()))
    found = asyncio.run(search(replace(hasty, known=known)).act(now(), PATH, Advice()))
    assert asked == [STATE.name] and total(found) <= total(before) + 1e-9 < total(without)


def test_what_does_not_say_everything_is_left_as_it_is() -> None:
    given = replace(proposed(0.01), commands=proposed(0.01).commands[:-1])
    assert polished(given) == given


def test_a_route_is_left_as_it_is() -> None:
    """Its numbers are a choice of a few values that the search has tried itself."""
    machine = load_plant("mixing_module").description.machine
    (transitions, *_) = (
        p for p in machine.paths("filling_B203", {}, machine.recovery_event, blocked=()) if not p[-1].on_decision
    )
    path = RecoveryPath(machine, transitions)
    given = ActionSet.along(path, lambda state: ())
    assert polished(given, path) == given


def test_what_is_simulated_in_parts_is_judged_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = polished(proposed(0.01))
    monkeypatch.setattr(action, "MOST_ROWS", 20_000)
    assert polished(proposed(0.01)) == whole
