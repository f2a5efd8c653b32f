"""What was released and is not done: seen at once, told apart from an actuator that is on its way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.monitoring.followed import Followed
from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from tests.twin.followed import reactor

PLANT = reactor()
RULES = {rule.name: rule for rule in PLANT.description.symptom_rules}
RULE = "S-V2-OFF"
TRAVEL_S = 3.0  # its on-delay: the valve strokes within two seconds


class Valve:
    """A valve that is watched second by second, from when it has stood at half for a while."""

    def __init__(self, travel_s: float | None = None) -> None:
        d = PLANT.description
        if travel_s is not None:
            slow = tuple(replace(p, value=travel_s / 5.0) if p.symbol == "tau_V2" else p for p in d.parameters)
            d = replace(d, parameters=slow)
        self.watch = SymptomWatch(RULES[RULE], PLANT.baselines[RULES[RULE].feature])
        self.followed, self.at_s = Followed(d, [self.watch]), 100.0
        self.see(lambda _: 0.5, lambda _: 0.5, 50)

    def see(self, command: Callable[[float], float], position: Callable[[float], float], seconds: int) -> float | None:
        """When the valve is first said to disobey, in seconds from now; ``command`` and ``position`` over these [1]."""
        began_s, told = self.at_s, None
        for _ in range(seconds):
            self.at_s += 1.0
            after_s = self.at_s - began_s
            values = {"V2.cmd": command(after_s), "V2.pos": position(after_s)}
            self.watch.update(values["V2.pos"] - values["V2.cmd"], self.at_s)
            self.followed.take(Snapshot(self.at_s, values))
            if told is None and self.followed.disobeyed(RULE):
                told = after_s
        return told


def test_one_that_does_not_move_is_told_after_its_travel_and_the_delay_of_its_symptom() -> None:
    told = Valve().see(lambda _: 0.9, lambda _: 0.5, 60)
    assert told is not None and told <= 2.0 * TRAVEL_S + 3.0


def test_one_that_obeys_is_not_told() -> None:
    assert Valve().see(lambda _: 0.9, lambda after_s: 0.5 if after_s < 2.0 else 0.9, 60) is None


@pytest.mark.parametrize("travel_s", [20.0, 60.0])
def test_one_that_is_slow_by_the_tables_is_on_its_way(travel_s: float) -> None:
    def on_its_way(after_s: float) -> float:
        return 0.5 + 0.4 * min(after_s / travel_s, 1.0)

    assert Valve(travel_s).see(lambda _: 0.9, on_its_way, 200) is None
    assert Valve().see(lambda _: 0.9, on_its_way, 200) is not None, "and of a fast one that is told"


def test_one_that_is_ramped_by_the_plant_is_on_its_way_as_long_as_its_ramp_takes() -> None:
    """Its command is shown as the target at once."""
    valve = Valve()
    valve.followed.released([Command("V2.man", 0.9, 0.01)], valve.at_s)
    assert valve.see(lambda _: 0.9, lambda after_s: min(0.5 + 0.01 * after_s, 0.9), 60) is None
    stuck = Valve()
    stuck.followed.released([Command("V2.man", 0.9, 0.01)], stuck.at_s)
    told = stuck.see(lambda _: 0.9, lambda _: 0.5, 80)
    assert told is not None and 40.0 < told < 60.0


@pytest.mark.parametrize("command", [
    Command("V2.man", None, None), Command("V2.man", 0.9, None), Command("T1.sp", 300.0, 0.1), Command("X", 1.0, 1.0),
])  # fmt: skip
def test_a_command_without_a_ramp_of_an_actuator_puts_nothing_off(command: Command) -> None:
    valve = Valve()
    valve.followed.released([command], valve.at_s)
    assert valve.see(lambda _: 0.9, lambda _: 0.5, 60) is not None


def test_one_that_gives_in_is_told_no_more() -> None:
    valve = Valve()
    assert valve.see(lambda _: 0.9, lambda _: 0.5, 40) is not None
    valve.see(lambda _: 0.9, lambda _: 0.9, 10)
    assert not valve.followed.disobeyed(RULE)


@pytest.mark.parametrize("values", [{}, {"V2.cmd": 0.9}, {"V2.pos": 0.5}, {"V2.cmd": float("nan"), "V2.pos": 0.5}])
def test_what_is_not_known_is_no_disobedience(values: dict[str, float]) -> None:
    valve = Valve()
    for _ in range(30):
        valve.at_s += 1.0
        valve.watch.update(-0.4, valve.at_s)
        valve.followed.take(Snapshot(valve.at_s, values))
    assert not valve.followed.disobeyed(RULE)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_whatever_a_lagging_valve_is_told_it_does_not_disobey(told: list[float]) -> None:
    valve, stands = Valve(10.0), [0.5]
    for command in told:

        def at(after_s: float, command: float = command) -> float:
            stands[0] += (command - stands[0]) / 2.5
            return stands[0]

        assert valve.see(lambda _, command=command: command, at, 4) is None  # type: ignore[misc]


def test_only_what_reads_positions_and_commands_alone_says_it() -> None:
    d = PLANT.description
    every = [SymptomWatch(rule, PLANT.baselines[rule.feature]) for rule in d.symptom_rules]
    assert sorted(Followed(d, every)._told) == ["S-P1-OFF", "S-V1-OFF", "S-V2-OFF"]
