"""Simulation: action sets on the twin, under every plausible hypothesis."""

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence

from homeostat.agents.certificates import Course, counted
from homeostat.agents.checks import rollout_findings, target_finding, target_name
from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.reliance import Bench, Relying, relied_on
from homeostat.domain.advice import COST, Sensitivity
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.plant.tag import Tag, scales_of
from homeostat.domain.recovery import ActionSet, open_setpoints
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Finding, Rollout, RolloutResult
from homeostat.process.batch import ProcessError
from homeostat.twin.twin import Interruption, Purpose, Twin

STEP = 0.02
"""Step of a finite difference as a fraction of the command's range [1]."""


class TwinSimulation:
    """Implements :class:`homeostat.agents.roles.Simulation` over the twin."""

    def __init__(self, twin: Twin, tags: Mapping[str, Tag], limits: Limits, pricing: Pricing | None = None) -> None:
        """``twin`` is shared with monitoring, which keeps it up to date; without ``pricing`` no cost is told."""
        self._pricing = pricing
        self._asked = 0
        self._twin = twin
        self._limits = limits
        self._scales = {name: tag.scale for name, tag in tags.items()}
        self._units = scales_of(tags.values())

    def observe(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Bring the twin up to the present."""
        for snapshot in snapshots:
            self._twin.observe(snapshot)

    def instrument_errors(self, diagnosis: Diagnosis) -> tuple[Mapping[str, float], ...]:
        """Errors of at least one scale of the tag, under every hypothesis that is not all but ruled out.

        None where the twin cannot say, as with readings that are no state of the model: they are taken as they are.
        """
        scale = self._scales
        try:
            found = self._twin.instrument_errors(plausible(diagnosis))
        except ProcessError:
            return ()
        return tuple({t: e for t, e in errors.items() if abs(e) >= scale[t]} for errors in found)

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet, ended: Interruption | None = None) -> Rollout:
        """What ``actions`` would do until they are ``ended``; beside the event loop, so that deadlines are kept."""
        return await asyncio.to_thread(self._twin.frozen().roll_out, actions, plausible(diagnosis), ended)

    async def relied_on(self, diagnosis: Diagnosis, asked: Relying, rollout: Rollout) -> tuple[Finding, ...]:
        """Why what is ``asked`` counts on actuators that nobody has seen move; over the members of ``rollout``."""
        twin, hypotheses = self._twin.frozen(), plausible(diagnosis)
        bench = Bench.of(twin, hypotheses, self._limits, self._units)
        return (await asyncio.to_thread(relied_on, asked, rollout, bench)).findings

    async def violations(
        self, diagnosis: Diagnosis, courses: Sequence[Course], draws: int
    ) -> AsyncIterator[int | None]:
        """Over hypotheses and parameters that are drawn for this question alone."""
        self._asked += 1
        twin, hypotheses, name = self._twin.frozen(), plausible(diagnosis), f"list/{self._asked}"
        try:
            members = await asyncio.to_thread(twin.sampled, hypotheses, draws, name)
        except ProcessError:
            members = None
        bench = Bench.of(twin, hypotheses, self._limits, self._units, members)
        for course in courses:
            yield None if members is None else await asyncio.to_thread(_violations, course, bench)

    async def sensitivities(
        self, diagnosis: Diagnosis, actions: ActionSet, states: Sequence[State], criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        """Central differences of the margins that are judged, every variation in one call of the engine.

        Over the same hypotheses and draws as a rollout, and, without later steps, without sensor noise and sampled as
        in a search. None where the twin breaks down beside ``actions``.
        """
        return await asyncio.to_thread(self._differences, self._twin.frozen(), diagnosis, actions, states, criteria)

    def _differences(
        self, twin: Twin, diagnosis: Diagnosis, actions: ActionSet, states: Sequence[State], criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        chosen = actions.choices(states)
        pairs = [
            (r, *_neighbours(value, r)) for r in open_setpoints(states) if (value := chosen.get(r.tag)) is not None
        ]
        if not pairs or not criteria:
            return ()
        varied = [actions.changed(states, r.tag, value) for r, low, high in pairs for value in (low, high)]
        try:
            rollouts = _roll_out_varied(twin, plausible(diagnosis), varied)
            judged = [self._margins(a, r, states[-1], criteria) for a, r in zip(varied, rollouts, strict=True)]
        except ProcessError:
            return ()
        return tuple(
            Sensitivity(name, r.tag, (above[name] - below[name]) / (high - low), low, high)
            for name in judged[0]
            for (r, low, high), below, above in zip(pairs, judged[::2], judged[1::2], strict=True)
        )

    def _margins(self, actions: ActionSet, rollout: Rollout, target: State, wanted: Sequence[str]) -> dict[str, float]:
        """Margins of those of the ``wanted`` criteria that a rollout is judged by."""
        criteria = [c for c in self._limits.criteria if c.name in wanted]
        limits = [x for x in self._limits.limits if x.name in wanted]
        found: list[Finding] = [*rollout_findings(rollout, criteria, limits, actions)]
        if target_name(target) in wanted and not actions.then:  # whether every step is taken is no matter of degree
            found.append(target_finding(rollout, target))
        margins = {f.criterion: f.margin for f in found}
        if COST in wanted and self._pricing is not None:
            margins[COST] = self._pricing.of(rollout, actions.states, releases=1).total
        return margins


def _violations(course: Course, bench: Bench) -> int | None:
    """In how many members ``course`` counts as a violation; None where its rollout does not come to its end."""
    rollout = bench.roll_out(course.actions, course.ended)
    return int(counted(course, rollout, bench).sum()) if rollout.result is RolloutResult.COMPLETED else None


def _neighbours(value: float, admitted: SetpointRange) -> tuple[float, float]:
    """Values a step below and above the proposal's, inside the range."""
    step = STEP * (admitted.high - admitted.low)
    inside = min(max(value, admitted.low), admitted.high)
    return max(inside - step, admitted.low), min(inside + step, admitted.high)


def _roll_out_varied(twin: Twin, hypotheses: tuple[Hypothesis, ...], varied: Sequence[ActionSet]) -> list[Rollout]:
    """A rollout of each action set, all over the same members; ProcessError where one leaves the physical world."""
    ensemble = twin.ensemble(hypotheses, twin.settings.judged_draws, Purpose.JUDGE)
    if varied[0].then:
        signals, dt_s = twin.follow_many(ensemble, varied)
    else:
        schedules = twin.schedules(varied, twin.horizon)
        signals, dt_s = twin.try_many(ensemble, schedules)
    count, weights = len(ensemble.states), tuple(ensemble.weights.tolist())
    found = []
    for k, actions in enumerate(varied):
        own = {tag: values[k * count : (k + 1) * count] for tag, values in signals.items()}
        trajectory = Trajectory(ensemble.start_s, dt_s, own)
        found.append(Rollout(actions.digest, trajectory, hypotheses, weights, RolloutResult.COMPLETED))
    return found
