"""What was commanded by hand is handed back on the way to normal: after a fallback, and after a recovery by hand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import repaired, scenario
from homeostat.guard.sequence.sequencer import Sequencer, nominal_commands, what_follows
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.learning import learned
from homeostat.plants.wired.assembly import guard_rules, new_sequencer
from tests.evaluate.two_tanks import tanks

FALLS_BACK_S, STARTS_S, END_S = 700.0, 900.0, 1700.0
"""It starts up in some 400 s."""


class Restarted:
    """The recipe of a plant that a fallback stops once, and that is started again by what the tables say alone."""

    def __init__(self, plant: Plant, strategy: str) -> None:
        (self._actions,) = [f.actions for f in plant.description.fallback_strategies if f.name == strategy]
        self._machine, self._commands = plant.description.machine, nominal_commands(guard_rules(plant))
        self.sequencer: Sequencer = new_sequencer(plant)

    def __call__(self, seen: Snapshot) -> tuple[Command, ...]:
        if seen.at_s not in (FALLS_BACK_S, STARTS_S):
            return self.sequencer.sample(seen)
        actions, start = self._actions, self._machine.initial.name
        if seen.at_s == STARTS_S:
            onward = what_follows(self._machine, start, self._commands)
            actions = ActionSet(self._commands[start], start, onward)
        self.sequencer.load(actions, seen.at_s, aborting=seen.at_s == FALLS_BACK_S)
        return actions.commands


@pytest.mark.parametrize("strategy", ["stop", "flush"])
def test_after_a_fallback_and_a_start_the_heater_is_on_automatic_and_holds_the_temperature(
    strategy: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")  # compiling would take longer than what runs
    plant = load_plant(str(tanks(tmp_path)), learned=False, kept=False)
    configuration = PlantConfiguration(plant.true_parameters(1, spread=0.0), plant.start, (), END_S, 1, 0.0)
    recipe = Restarted(plant, strategy)
    link = SimulatedLink(TrueProcess(plant.model, plant.description, configuration), recipe=recipe)
    seen = []
    while not link.ended:
        seen.append(link.advance())
    assert {each.accepted["H1.man"] for each in seen if FALLS_BACK_S <= each.at_s < STARTS_S} == {0.0}
    assert recipe.sequencer.state == "normal"
    assert seen[-1].accepted["H1.man"] is None and math.isnan(seen[-1].values["H1.man"])
    assert seen[-1].values["T2"] == pytest.approx(50.0, abs=1.0)


@pytest.mark.slow
def test_back_from_a_recovery_by_hand_the_heater_is_on_automatic(tmp_path: Path) -> None:
    """It stands at 80 % and is mended: what it was commanded by hand meanwhile would heat for ever."""
    folder = tanks(tmp_path)
    (folder / "baseline.csv").write_bytes(learned(load_plant(str(folder), learned=False, kept=False)))
    plant, trace = load_plant(str(folder)), MemoryTrace()
    told = repaired(scenario(plant, "H1_stuck_open", 1, 2000.0, 0.8, 5000.0), 3500.0)
    back = run(plant, told, trace, DeclaredClock(1.0))
    written = [each for each in back.record.entries if isinstance(each.event, WriteIntended)]
    targets = [{c.tag: c.value for c in each.event.commands}.get("H1.man") for each in written]
    assert any(target is not None for target in targets) and targets[-1] is None
    assert back.record.states[-1][0] == "normal"
    assert float(back.truth.signals["T2"][0, -1]) == pytest.approx(50.0, abs=2.0)
