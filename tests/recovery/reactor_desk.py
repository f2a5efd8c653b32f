"""Recovery of the reactor at a desk: its real twin, search, limits and release check; time passes as a test says."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field, replace
from functools import cache

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.language.proposer import language_proposer
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.twin_probing import TwinProbing
from homeostat.agents.roles import Agents, AskingProtocol, Probing
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.seal import Sealer
from homeostat.journal import MemoryTrace
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.llm.model import LanguageModel
from homeostat.plants.wired.assembly import Workbench, fallbacks
from homeostat.recovery.exchange.beside import DaemonExecutor
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import ReleaseCheck
from homeostat.recovery.supervisor import RecoveryLoop
from tests.agents.briefings import briefing
from tests.recovery.desk import ScriptedDesk, Watching
from tests.recovery.line import KEY
from tests.twin.followed import follow, reactor

TICKS = 8
"""Ticks that recovery sees before it is asked."""


@cache
def graph() -> Grounding:
    return Grounding(reactor().graph, reactor().namespace, MemoryArchive())


@dataclass
class ReactorRecovery:
    """Recovery is asked at the last of ``snapshots``; ``model`` proposes after the search.

    ``dear``: price of a state with changed setpoints, in EUR an hour, where it is not that of the tables.
    """

    snapshots: tuple[Snapshot, ...]
    hypotheses: tuple[Hypothesis, ...]
    model: LanguageModel | None = None
    state: str = "normal"
    bounds: Bounds = field(default_factory=Bounds)
    probes: bool = False
    dear: float | None = None

    def __post_init__(self) -> None:
        plant, d, seen = reactor(), reactor().description, self.snapshots[-TICKS:]
        twin, self.trace, now_s = follow(self.snapshots[:-TICKS]), MemoryTrace(), seen[-1].at_s
        prices = plant.prices
        if self.dear is not None:
            dear = dict.fromkeys(("compensated", "reduced_load"), self.dear)
            prices = replace(prices, states={**prices.states, **dear})
        rest = ActionSet((), self.state)
        ticks = (Observation(s.at_s, s, self.state, rest, None, None, (), None, Mode.CLOSED_LOOP, (), s) for s in seen)
        self.desk = ScriptedDesk(ticks)
        simulation = TwinSimulation(twin, d.tags_by_name, d.limits)
        priced = replace(plant, prices=prices)
        bench = Workbench(priced, twin, graph(), simulation, self.trace, MemoryArchive(), AskingProtocol.ROUTE, None)
        proposers = [bench.searching()]
        if self.model is not None:
            told = replace(briefing(self.model, plant, simulation, shown=graph()), prices=prices)
            proposers.append(language_proposer(told))
        probing: Probing | None = None
        if self.probes:
            probing = TwinProbing(twin, d, graph(), Pricing(plant.prices, d.limits, d.scales))
        monitoring = Watching(now_s, answer=lambda at_s: Diagnosis(at_s, (), self.hypotheses))
        validation = LimitValidation(d.limits, d.tags_by_name)
        agents = Agents(monitoring, tuple(proposers), simulation, validation, graph(), probing, bench.search())
        rules = PlantRules(d.machine, d.limits, prices, fallbacks(plant), d.scales, d.tags_by_name)
        check = ReleaseCheck(twin, d.limits, d.tags_by_name, Sealer("check", KEY).seal, risk=plant.risk)
        self.loop = RecoveryLoop(self.desk, agents, rules, check, self.bounds, self.trace)

    def run(self) -> ReactorRecovery:
        """Supervise until there is no further tick."""
        with asyncio.Runner() as runner:
            runner.get_loop().set_default_executor(DaemonExecutor())
            runner.run(self.loop.supervise())
        return self
