"""Probing on the twin: every probe's separation in one call of the engine, and what answers cost in another."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.hypotheses import PLAUSIBLE, plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.moves import Move, moves
from homeostat.agents.probing.stakes import Stakes
from homeostat.agents.roles import Probe, Situation
from homeostat.agents.search.candidates import SearchSpace, along_by_design
from homeostat.agents.search.cost import Cost
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Rollout
from homeostat.process.batch import ProcessError
from homeostat.process.types import Table
from homeostat.twin.twin import Interruption, Twin

CERTAIN = 1.0 - PLAUSIBLE
"""What is at least this probable is acted on alone, and nothing is done to learn more [1]."""
LEVELS, SCATTERED = 5, 8
"""Values of each setpoint, and points beside, that stand for what a state could be answered with."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """The hypotheses that accuse the same items."""

    hypotheses: tuple[Hypothesis, ...]
    """The hypotheses, the most probable first."""

    @property
    def probability(self) -> float:
        """What they come to [1]."""
        return sum(h.probability for h in self.hypotheses)


class TwinProbing:
    """Implements :class:`homeostat.agents.roles.Probing`; nothing is drawn that other agents draw from."""

    def __init__(self, twin: Twin, plant: PlantDescription, grounding: Grounding, pricing: Pricing) -> None:
        """``twin`` is shared with monitoring, which keeps it up to date."""
        self._twin, self._plant, self._grounding = twin, plant, grounding
        self._cost = Cost(plant.limits, pricing, plant.scales, slack=0.0)

    async def probes(self, situation: Situation, idle: ActionSet, seconds: float) -> tuple[Probe, ...]:
        """Probes of so many ``seconds`` that pay, the best first; none where every explanation asks for the same."""
        explanations = self._explanations(situation)
        if len(explanations) < 2 or explanations[0].probability >= CERTAIN:
            return ()
        opened = [self._paths(situation, e.hypotheses) for e in explanations]
        tried = self._paths(situation, situation.diagnosis.hypotheses)
        work = _Work(self._twin.frozen(), self._plant, self._cost, situation, explanations)
        return await asyncio.to_thread(work.probes, opened, tried, idle, seconds)

    async def try_out(self, probe: Probe, diagnosis: Diagnosis, ended: Interruption) -> Rollout:
        """What ``probe`` does until it is ``ended``, and what follows, under every plausible hypothesis."""
        return await asyncio.to_thread(self._twin.frozen().roll_out, probe.actions, plausible(diagnosis), ended)

    def _explanations(self, situation: Situation) -> list[Explanation]:
        """What is plausible, by the items that it accuses, the most probable first."""
        found: dict[frozenset[str], list[Hypothesis]] = {}
        for h in plausible(situation.diagnosis):
            found.setdefault(frozenset(self._plant.fault_mode(f.fault).component for f in h.faults), []).append(h)
        total = sum(h.probability for group in found.values() for h in group)
        grouped = [
            Explanation(tuple(replace(h, probability=h.probability / total) for h in group)) for group in found.values()
        ]
        return sorted(grouped, key=lambda e: -e.probability)

    def _paths(self, situation: Situation, hypotheses: Sequence[Hypothesis]) -> tuple[RecoveryPath, ...]:
        """The ways that are open where these are the hypotheses."""
        asked = replace(situation, diagnosis=replace(situation.diagnosis, hypotheses=tuple(hypotheses)))
        return tuple(open_paths(self._plant, self._grounding, asked, Advice()))


@dataclass(frozen=True, slots=True)
class _Work:
    """The computation, beside the event loop."""

    twin: Twin
    """The twin as it was when the question was asked."""
    plant: PlantDescription
    """What may be commanded, and how fast."""
    cost: Cost
    """What answers cost, as in a search."""
    situation: Situation
    """The plant now."""
    explanations: Sequence[Explanation]
    """What is plausible, the most probable first."""

    def probes(
        self, opened: Sequence[Sequence[RecoveryPath]], tried: Sequence[RecoveryPath], idle: ActionSet, seconds: float
    ) -> tuple[Probe, ...]:
        """Probes that pay, the best first; ``opened``: the ways that each explanation leaves open."""
        tags, values = self.plant.tags_by_name, self.situation.snapshot.values
        candidates = [Move(idle, None), *moves(tried, tags, values)]
        sets = [move.actions for move in candidates]
        try:
            costs, stakes = self._stakes(opened, sets)
            if not stakes.value > 0.0 or not stakes.opposed.any():
                return ()
            nats, still = self.twin.separation([e.hypotheses[0] for e in self.explanations], sets, seconds)
        except ProcessError:  # an explanation with which the model leaves the physical world says nothing
            return ()
        share, found = seconds / self.twin.settings.horizon_s, []
        for k, move in enumerate(candidates):
            if still[k]:
                apart, between = self._apart(stakes, nats[k])
                cost = move.once + share * (move.risk + stakes.regret(costs[k]))
                value = stakes.value * stakes.told_apart(nats[k])
                found.append(Probe(move.actions, move.path, apart, between, value, cost))
        return tuple(sorted((p for p in found if p.value > p.cost), key=lambda p: p.cost - p.value))

    def _stakes(self, opened: Sequence[Sequence[RecoveryPath]], also: Sequence[ActionSet]) -> tuple[Table, Stakes]:
        """Costs of every answer, those of ``also`` first, shape (answers, explanations), and what is at stake."""
        answers = {a.digest: (a, p) for paths in opened for p in paths for a in self._answers(p)}
        every = [*also, *(a for a, _ in answers.values())]
        costs = self._costs(every)
        open_to = np.ones(costs.shape, dtype=bool)
        for row, (_, path) in enumerate(answers.values(), start=len(also)):
            open_to[row] = [path in paths for paths in opened]
        probability = np.array([e.probability for e in self.explanations])
        judged = np.where(open_to, costs, np.inf)[len(also) :]
        return costs, Stakes.of(np.vstack([costs[:1], judged]), probability)

    def _answers(self, path: RecoveryPath) -> list[ActionSet]:
        """What stands for the ways to take ``path``."""
        tags = self.plant.tags_by_name
        if path.awaited:
            return [along_by_design(path, tags)]
        space = SearchSpace(path.machine.state(path.target), tags)
        present = space.present(self.situation.snapshot.values)
        return [space.actions(point) for point in space.first(present, LEVELS, SCATTERED)]

    def _costs(self, answers: Sequence[ActionSet]) -> Table:
        """Production that each answer loses under each explanation, and ten per scale of missing margin."""
        hypotheses = [h for e in self.explanations for h in e.hypotheses]
        ensemble = self.twin.ensemble(hypotheses, self.twin.settings.search_draws)
        group = np.array([k for k, e in enumerate(self.explanations) for _ in e.hypotheses])[ensemble.hypothesis]
        found = np.empty((len(answers), len(self.explanations)))
        for stepwise in (True, False):
            rows = [k for k, a in enumerate(answers) if bool(a.then) is stepwise]
            if not rows:
                continue
            own = [answers[k] for k in rows]
            if stepwise:
                signals, dt_s = self.twin.follow_many(ensemble, own)
            else:
                schedules = self.twin.schedules(own, self.twin.horizon)
                signals, dt_s = self.twin.try_many(ensemble, schedules)
            for j in range(len(self.explanations)):
                mine = np.tile(group == j, len(own))
                part = {tag: values[mine] for tag, values in signals.items()}
                found[rows, j] = self.cost.of(part, dt_s, ensemble.weights[group == j], own)
        return found

    def _apart(self, stakes: Stakes, nats: Table) -> tuple[tuple[str, str], float]:
        """The opposed explanations between which most is at stake, by name, and the evidence between them [nats]."""
        pairs = np.where(stakes.opposed, np.outer(stakes.probability, stakes.probability), 0.0)
        one, other = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
        names = [e.hypotheses[0].name for e in self.explanations]
        first, second = sorted((int(one), int(other)))
        return (names[first], names[second]), float(min(nats[one, other], nats[other, one]))
