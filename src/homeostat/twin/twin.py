"""The twin as the agents use it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.production import MADE
from homeostat.domain.plant.timing import Timing
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult, StepBand
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel, column
from homeostat.process.schedule import InputRamp
from homeostat.process.seeds import Stream, generator
from homeostat.process.sequence import Guard, InputSequence
from homeostat.process.types import Cube, Flags, Indices, Table, Vec
from homeostat.stl.formula import Formula
from homeostat.twin.calibration import Posterior, Present, calibrate, prior
from homeostat.twin.carried import Carrier, FaultSet, shares
from homeostat.twin.forecast import Ensemble, Forecast, Past, after, follow, forecast, synchronise
from homeostat.twin.history import History, Window
from homeostat.twin.instrument_errors import instrument_errors
from homeostat.twin.isolation.beginnings import before_onsets
from homeostat.twin.isolation.ended import STRETCHES, Ended
from homeostat.twin.isolation.evidence import Accuracy, Fit
from homeostat.twin.isolation.isolation import FaultIsolation, Question
from homeostat.twin.isolation.prechecks import flat_lines
from homeostat.twin.looking_back import looked_back_s
from homeostat.twin.resting import Resting, resting
from homeostat.twin.separation import separation
from homeostat.twin.settings import TwinSettings
from homeostat.twin.unseen import UnseenStates


class Purpose(StrEnum):
    """What an ensemble is drawn for; each purpose has its own random stream."""

    REFINE = Stream.TWIN_REFINE
    """Choosing among a search's finalists."""
    EXPLORE = Stream.TWIN_EXPLORE
    """Everything that is only looked at roughly."""
    JUDGE = Stream.TWIN_JUDGE
    """Rollouts that are judged, and how their margins would change; no search looks at it."""


@dataclass(frozen=True, slots=True)
class Interruption:
    """What takes the place of an action set after a while."""

    after_s: float
    """Seconds after the release [s]."""
    actions: ActionSet
    """What is commanded then, and what follows."""


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """Ensembles of one moment."""

    end_s: float
    """Process time of the last snapshot [s]."""
    posterior: Posterior
    """The posterior of the parameters."""
    ensembles: dict[tuple[tuple[Hypothesis, ...], int, Purpose], Ensemble]
    """(Hypotheses, draws, purpose) -> ensemble."""


class Twin:
    """Follows the plant, learns its parameters while it is healthy, explains faults, and rolls actions out."""

    def __init__(self, model: ProcessModel, description: PlantDescription, settings: TwinSettings, seed: int) -> None:
        """``seed`` seeds the parameter draws and the noise of the rollouts."""
        self._model, self._description = model, description
        self._carrier = Carrier(model, description)
        self._isolation = FaultIsolation(model, description, self._carrier, settings, seed)
        self._parameters, self._timing = description.parameters, description.timing
        self.settings, self._seed = settings, seed
        self._posterior = self._healthy = prior(model, self._parameters)
        self._beside, self._over_s = set[str](), -np.inf
        tick_s, sampled = description.timing.tick_s, description.sampled
        self._history = History(
            description.variables, model.inputs, settings.settle_rows, tick_s=tick_s, sampled=sampled
        )
        self._unseen = UnseenStates(model, self._carrier, settings.corrected)
        self._drawn = _Drawn(-np.inf, self._posterior, {})

    @property
    def horizon(self) -> int:
        """Length of a rollout, in ticks."""
        return self._timing.ticks(self.settings.horizon_s)

    @property
    def timing(self) -> Timing:
        """How fast the plant is."""
        return self._timing

    @property
    def resting(self) -> tuple[Resting, ...]:
        """Actuators that are at rest and that nobody has seen move."""
        return resting(self._description, self._history.reached)

    def _last(self, seconds: float) -> Window:
        """The readings of the last ``seconds`` [s], one at least."""
        return self._history.window(max(self._timing.whole_ticks(seconds), 1))

    def observe(self, snapshot: Snapshot) -> None:
        """Take one more snapshot of the plant."""
        self._history.append(snapshot)
        self._unseen.follow(self._history, self._posterior.mean)

    def believe(self, known: FaultSet, over_s: float = -np.inf) -> None:
        """From now on ``known`` is taken to be wrong, and to have moved what no instrument shows since it began.

        ``over_s``: when something else ended [s].
        """
        if over_s != self._over_s:  # nothing that was drawn for this moment holds
            self._over_s, self._drawn = over_s, replace(self._drawn, end_s=-np.inf)
        if {fault.fault for fault in known} != self._beside:  # what was sharpened holds beside those faults
            self._posterior = self._healthy
        self._unseen.believe(known, self._history, self._posterior.mean + self._posterior.change(known))

    def frozen(self) -> Twin:
        """This twin as it is now: who computes for long beside the event loop computes on that.

        What is observed or learned meanwhile does not reach it, and work that was given up and goes on changes nothing
        for others. Ensembles that are drawn for this moment are shared: they are the same for everybody.
        """
        if self._history.length:
            self._at_present()
        still = copy(self)
        still._history, still._unseen = self._history.copy(), copy(self._unseen)
        return still

    def calibrate(self, seconds: float) -> None:
        """Learn the parameters from the last ``seconds``, in which the plant was healthy."""
        self._posterior = self._healthy = self._learned(prior(self._model, self._parameters), seconds, [()])

    def recalibrate(self, seconds: float, hypotheses: Sequence[Hypothesis]) -> None:
        """Sharpen the posterior of the parameters by the last ``seconds``, in which one of ``hypotheses`` was true.

        All are of the same faults; what their sizes may explain as well is left to them. What was sharpened before is
        replaced: the model errs in the same way for minutes, and many such looks would make it sure of an error.
        """
        first = max(hypotheses, key=lambda h: h.probability)
        self._beside = {fault.fault for fault in first.faults}
        self._posterior = self._learned(self._healthy, seconds, [first.faults, *self._carrier.off_by_one_sd(first)])

    def _learned(self, posterior: Posterior, seconds: float, faults: Sequence[FaultSet]) -> Posterior:
        window, now = self._last(seconds), self._history.window(1)
        present = [Present(own, self._carrier.carry([own], now)) for own in faults]
        return calibrate(self._model, window, posterior, present, self.settings.errors, self.settings.initial)

    def explain(
        self,
        candidates: Sequence[str],
        known: Sequence[FaultState],
        dense: bool = False,
        since_s: float = np.inf,
        before: tuple[Hypothesis, ...] = (),
        news: bool = False,
        from_s: float = -np.inf,
        whole: bool = False,
    ) -> tuple[Hypothesis, ...]:
        """What explains the last readings: one of ``candidates``, something that no table names, or nothing.

        ``known`` is what was probable before. ``dense``: onsets are tried more closely, for what may have gone
        unnoticed for a while. ``since_s``: when the first symptom of it was seen [s]; now where it is infinite.
        ``before``: what was said last; if it was certain and holds, and there is no ``news`` since, it is said again.
        ``from_s``: what was read before is not looked at; something was wrong then that is over [s]. ``whole``: but for
        what instruments and controllers show by themselves.
        """
        settings, end_s, tick_s = self.settings, self._history.window(1).end_s, self._timing.tick_s
        longest = min(end_s - min(since_s, end_s) + settings.lead_s, settings.replay_s)
        onsets_s = (fault.onset_s for fault in known)
        longest = end_s - before_onsets(end_s - longest, onsets_s, settings.settle_rows, tick_s)
        seconds = min(longest, max(end_s - from_s + tick_s, 2.0 * tick_s))
        window, recent = self._last(seconds), self._last(min(settings.recent_s, seconds))
        past = partial(self._history.around, before_s=settings.lead_s, after_s=settings.replay_s)
        shown = self._last(longest) if whole else window
        question = Question(candidates, tuple(known), dense, since_s, before, news, past, shown)
        return self._isolation.explain(question, window, recent, self._posterior)

    def stuck(self) -> dict[str, float]:
        """Tag -> since when its instrument repeats itself although it has noise [s], as the last readings show."""
        return {f.tag: f.since_s for f in flat_lines(self._last(self.settings.lead_s), self._description)}

    def nothing(self, seconds: float) -> dict[str, Fit]:
        """How well nothing being wrong explains what each variable showed in the last ``seconds`` [s].

        ProcessError where the model leaves the physical world.
        """
        return self._isolation.nothing(self._last(seconds), self._posterior)

    def ended(self, known: Sequence[FaultSet], from_s: float = -np.inf, beside: FaultSet = ()) -> Ended | None:
        """That all that was ``known`` is over, where it is; None where it is not, or nobody can tell.

        What was read before ``from_s`` is not looked at [s]; ``beside``: instruments that are stuck all the same.
        """
        longest = min(self._history.length, (self._history.window(1).end_s - from_s) / self._timing.tick_s + 1.0)
        windows = (self._history.window(rows) for rows in STRETCHES if rows <= longest)
        return self._isolation.ended(known, windows, self._posterior, beside)

    def instrument_errors(self, hypotheses: Sequence[Hypothesis]) -> tuple[dict[str, float], ...]:
        """What each hypothesis says the instruments show beyond the truth: tag -> error in the tag's unit."""
        read, e = self._history.window(1).at(-1), self.ensemble(hypotheses, draws=1)
        return instrument_errors(self._model, self._carrier, e, read, self._description.variables)

    def ensemble(self, hypotheses: Sequence[Hypothesis], draws: int, purpose: Purpose = Purpose.EXPLORE) -> Ensemble:
        """Members for every hypothesis, synchronised with the last snapshot; ``purpose`` picks the random stream.

        Asked again before the next snapshot, the same object: what was tried on it holds on.
        """
        ensembles, key = self._at_present().ensembles, (tuple(hypotheses), draws, purpose)
        if key not in ensembles:
            ensembles[key] = self._draw(hypotheses, draws, purpose)
        return ensembles[key]

    def _at_present(self) -> _Drawn:
        """What was drawn since the last snapshot under the present posterior."""
        end_s = self._history.window(1).end_s
        if self._drawn.end_s != end_s or self._drawn.posterior is not self._posterior:
            self._drawn = _Drawn(end_s, self._posterior, {})
        return self._drawn

    def _draw(self, hypotheses: Sequence[Hypothesis], draws: int, purpose: Purpose) -> Ensemble:
        own = self._posterior.draws(draws, generator(self._seed, purpose))
        parameters = np.vstack([own + self._posterior.change(h.faults) for h in hypotheses])
        follows = np.repeat(np.arange(len(hypotheses)), draws)
        return self._synchronised(parameters, hypotheses, follows, generator(self._seed, Stream.TWIN_NOISE, purpose))

    def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> Ensemble:
        """``count`` members, each with a hypothesis drawn by its probability and parameters of its own.

        ``name`` is that of the draw: another one is independent of it.
        """
        chance = generator(self._seed, Stream.TWIN_CERTIFY, name)
        follows = chance.choice(len(hypotheses), size=count, p=shares(hypotheses))
        changes = np.vstack(
            [self._posterior.change(h.faults) + np.zeros(len(self._posterior.mean)) for h in hypotheses]
        )
        parameters = self._posterior.draws(count, chance) + changes[follows]
        return self._synchronised(parameters, hypotheses, follows, chance)

    def _synchronised(
        self, parameters: Table, hypotheses: Sequence[Hypothesis], follows: Indices, noise: np.random.Generator
    ) -> Ensemble:
        when = self._history.window(1).end_s, self._over_s, self._timing.tick_s
        window = self._last(looked_back_s(hypotheses, self._carrier, self.settings, *when))
        past, corrected = Past(window, self._history.whole), self.settings.corrected
        return synchronise(self._model, self._carrier, past, parameters, hypotheses, follows, corrected, noise)

    def schedules(self, sets: Sequence[ActionSet], steps: int) -> Cube:
        """The inputs of the next ``steps`` ticks if each of ``sets`` were released now, (sets, steps, inputs)."""
        window = self._history.window(1)
        readings, found = window.at(-1), np.empty((len(sets), steps, len(self._model.inputs)))
        present = {manual: readings[command] for manual, command in self._description.automatic.items()}
        for schedule, actions in zip(found, sets, strict=True):
            ramp = InputRamp(self._model.inputs, window.inputs[-1], self._timing.tick_s)
            ramp.command(actions.commands, self._description.variables, present)
            schedule[:] = ramp.schedule(steps)
        return found

    def tag_signals(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Tag -> values, from variable -> values."""
        return {tag: values[v] for tag, v in self._description.variables.items()}

    def _signals(self, ensemble: Ensemble, result: Forecast) -> dict[str, np.ndarray]:
        """Tag -> values of a forecast of ``ensemble``, and where decisions are priced by it what was made so far."""
        signals, delivered = self.tag_signals(result.values), self.settings.delivered
        if delivered:
            present = np.broadcast_to(self._now(), (len(ensemble.states), 1, len(self._model.inputs)))
            now = self._model.truth(ensemble.states[:, None, : len(self._model.states)], present)
            total = np.sum([result.values[v] for v in delivered], axis=0)
            before = np.sum([now[v][:, 0] for v in delivered], axis=0)
            signals[MADE] = total - np.tile(before, len(total) // len(before))[:, None]
        return signals

    def try_many(
        self, ensemble: Ensemble, schedules: Cube, refuse: bool = True, every_tick: bool = False
    ) -> tuple[dict[str, np.ndarray], float]:
        """Tag -> true values, shape (K * members, times), of K schedules; and the sampling period [s].

        Where a member leaves the physical world, a ProcessError is raised, or, without ``refuse``, what is measured of
        it is NaN from then on, which breaks every limit.
        """
        stride = 1 if every_tick else max(self._timing.ticks(self.settings.stride), 1)
        result = forecast(self._model, ensemble, schedules, stride, sensor_noise=False, refuse=refuse)
        return self._signals(ensemble, result), result.dt_s

    def follow_many(
        self, ensemble: Ensemble, routes: Sequence[ActionSet], refuse: bool = True
    ) -> tuple[dict[str, np.ndarray], float]:
        """As :meth:`try_many`, of action sets that go on step by step: shape (K * members, times)."""
        sequences = [self._sequence(a) for a in routes]
        result = follow(self._model, ensemble, sequences, self._now(), self.horizon, refuse)
        return self._signals(ensemble, result), result.dt_s

    def separation(
        self, hypotheses: Sequence[Hypothesis], sets: Sequence[ActionSet], seconds: float
    ) -> tuple[Cube, Flags]:
        """Expected evidence for each hypothesis against each other one within ``seconds`` of each of ``sets`` [nats].

        Shape (sets, hypotheses, hypotheses), the true one first; and whether a set takes none of its later steps in
        that time, shape (sets,). ProcessError where one of them leaves the physical world.
        """
        ensemble = self.ensemble([*hypotheses, Hypothesis((), 0.0)], draws=1)
        accuracy = Accuracy(self.settings.errors, self.settings.gain_error)
        sequences = [self._sequence(actions) for actions in sets]
        seen = accuracy, self._history.window(1).per_sample
        return separation(self._model, ensemble, sequences, self._now(), self._timing.ticks(seconds), *seen)

    def roll_out(
        self,
        actions: ActionSet,
        hypotheses: Sequence[Hypothesis],
        ended: Interruption | None = None,
        members: Ensemble | None = None,
    ) -> Rollout:
        """What ``actions`` would do from the last snapshot on, over the ensemble, with noise.

        ``ended``: what takes their place after a while; none of their later steps is taken until then. ``members``:
        those that are rolled out, of these ``hypotheses``; the ensemble that is judged where None.

        Every action set meets the same draws: what differs between two rollouts is what was commanded, and asking again
        with a slightly different value is no second chance with other luck.
        """
        try:
            ensemble = members or self.ensemble(hypotheses, self.settings.judged_draws, Purpose.JUDGE)
            result = self._forecast(ensemble, actions) if ended is None else self._broken_off(ensemble, actions, ended)
        except ProcessError as broke:
            empty = Trajectory(self._history.window(1).end_s, self._timing.tick_s, {})
            return Rollout(actions.digest, empty, tuple(hypotheses), (), RolloutResult.BROKE_DOWN, str(broke))
        trajectory = Trajectory(
            ensemble.start_s + self._timing.tick_s, self._timing.tick_s, self._signals(ensemble, result)
        )
        weights, left = tuple(ensemble.weights.tolist()), result.steps_left
        told = Rollout(actions.digest, trajectory, tuple(hypotheses), weights, RolloutResult.COMPLETED)
        return replace(told, steps_left=left, bands=_bands(result))

    def _forecast(self, ensemble: Ensemble, actions: ActionSet) -> Forecast:
        """Tick by tick, with sensor noise: along a schedule, or step by step where there is more than one."""
        steps = self.horizon
        if not actions.then:
            return forecast(self._model, ensemble, self.schedules([actions], steps), stride=1)
        return follow(self._model, ensemble, [self._sequence(actions)], self._now(), steps)

    def _broken_off(self, ensemble: Ensemble, actions: ActionSet, ended: Interruption) -> Forecast:
        """Tick by tick: ``actions`` for a while, and then what ends them."""
        first, then = self._sequence(replace(actions, then=())), self._sequence(ended.actions)
        guards = (after(math.ceil(ended.after_s / self._timing.tick_s)), *then.guards)
        targets, rates = np.vstack([first.targets, then.targets]), np.vstack([first.rates, then.rates])
        sequence = InputSequence(targets, rates, guards, then.outputs)
        return follow(self._model, ensemble, [sequence], self._now(), self.horizon)

    def _now(self) -> Vec:
        """The inputs of the last tick, shape (inputs,)."""
        return np.asarray(self._history.window(1).inputs[-1])

    def _sequence(self, actions: ActionSet) -> InputSequence:
        """The steps of ``actions`` as the engine carries them out."""
        variables, parts = self._description.variables, [actions.commands, *(s.commands for s in actions.then)]
        targets = np.full((len(parts), len(self._model.inputs)), np.nan)
        rates = np.full_like(targets, np.inf)
        for k, commands in enumerate(parts):
            for c in commands:
                i = column(self._model.inputs, variables[c.tag])
                targets[k, i] = np.inf if c.value is None else c.value
                rates[k, i] = np.inf if c.rate is None else c.rate
        outputs = {column(self._model.inputs, manual): shown for manual, shown in self._description.automatic.items()}
        return InputSequence(targets, rates, tuple(self._guard(s.transition.guard) for s in actions.then), outputs)

    def _guard(self, formula: Formula) -> Guard:
        variables = {tag: self._description.variables[tag] for tag in formula.tags}

        def holds(shown: Mapping[str, Vec]) -> NDArray[np.bool_]:
            return formula.holds_each({tag: shown[v] for tag, v in variables.items()})

        return holds


def _bands(result: Forecast) -> tuple[StepBand, ...]:
    """When the first and the last member take each later step."""
    if result.taken_s is None:
        return ()
    return tuple(StepBand(float(t.min()), float(t.max())) for t in result.taken_s.T)
