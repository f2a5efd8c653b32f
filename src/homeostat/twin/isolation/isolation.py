"""Fault isolation: named causes, unknown disturbances and nothing compete for the readings.

The readings before and after the first symptom are compared with replays. Faults of the tables are tried over a grid,
everything that is generated is estimated in one linear pass and settled by replays. Several items at once are tried
where one does not explain everything. The best of each competes with the others and with nothing being wrong.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState, Hypothesis, with_a_twin
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel
from homeostat.twin.calibration import Posterior
from homeostat.twin.carried import Carrier, FaultSet
from homeostat.twin.history import Window
from homeostat.twin.isolation.alike import with_doubt
from homeostat.twin.isolation.claims import Claims, Past, forgotten
from homeostat.twin.isolation.classes import SPREAD_NATS, hypotheses
from homeostat.twin.isolation.course import continues, lasting, stopped, turned_back
from homeostat.twin.isolation.ended import Ended, ended
from homeostat.twin.isolation.established import Established, established
from homeostat.twin.isolation.estimate import Estimate, Estimation
from homeostat.twin.isolation.evidence import Accuracy, Evidence, Fit
from homeostat.twin.isolation.jumped import jumped
from homeostat.twin.isolation.memory import Memory, Remembered, remembered, sizes
from homeostat.twin.isolation.names import Names
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.responses import FIRST_ROW
from homeostat.twin.isolation.search import SECOND_FAULT_NATS, Scored, Search, charged
from homeostat.twin.isolation.sizes import SizeError, stated
from homeostat.twin.isolation.standing import standing
from homeostat.twin.isolation.wandering import paths
from homeostat.twin.settings import TwinSettings

SHORTEST = 8
"""Readings from which on disturbances are estimated."""
COURSES = 2
"""Items whose disturbance may have changed several times."""
CHANGES = 2
"""How often, after it began."""
CHANGE_NATS = 2.0
"""What each of these changes costs, besides its size: an unknown cause has any course [nats]."""
DOUBT = 1.3
"""By how much every difference of explanations is made smaller: what fits may still be wrong [1]."""
UNEXPLAINED_NATS = 4.0
"""What is left unexplained that adds one to that [nats]."""
CERTAIN = 0.98
"""What was said with this probability is only checked while nothing new is seen: nothing else binds a release [1]."""
RESIZED = 0.1
"""Share by which a size must not be better when it is checked [1]."""
LAGS = (2, 4, 6, 9, 13, 18, 25, 35, 50, 70, 100, 140, 190, 250, 320, 400, 490, 590)
"""Onsets that are tried first, in ticks before the last reading."""
DENSE_LAGS = (*range(2, 30, 2), *range(30, 121, 3))
"""The same where a fault may have gone unnoticed for a while: its onset is a narrow valley between coarse ones."""

NEAR = 16
"""Ticks before the first symptom, each of which is tried as an onset: where what shows at once began, and a right one
explains as much within a tick only where actuators are fast."""


@dataclass(frozen=True, slots=True)
class Question:
    """What is to be isolated."""

    candidates: Sequence[str]
    """Faults of the tables that the symptoms indicate."""
    known: FaultSet
    """What was probable before; it is not forgotten without a reason."""
    dense: bool = False
    """Whether onsets are tried more closely, for what may have gone unnoticed for a while."""
    since_s: float = np.inf
    """When the first symptom of it was seen [s]; infinite where there is none."""
    before: tuple[Hypothesis, ...] = ()
    """What was said before."""
    news: bool = False
    """Whether anything new was seen since."""
    past: Past = forgotten
    """The readings around a beginning before those that are looked at."""
    shown: Window | None = None
    """What says which instruments and controllers are wrong by themselves; None for the readings that are looked at."""


class FaultIsolation:
    """Isolates faults for one plant."""

    def __init__(
        self, model: ProcessModel, plant: PlantDescription, carrier: Carrier, settings: TwinSettings, seed: int
    ) -> None:
        """``seed`` is that of the twin: what wanders in it is drawn from it, once and for all."""
        self._model, self._plant, self._carrier, self._settings = model, plant, carrier, settings
        told = settings.errors, settings.gain_error, settings.lag_error_s, settings.damping
        self._accuracy = Accuracy(*told, paths(seed), settings.initial)
        self._size_error = SizeError(settings.size_error, settings.least_size_error)
        sensors = {s.component: s.variable for s in plant.signals if s.relation is Relation.MEASURES}
        self._calibrated = {p.symbol: sensors[p.component] for p in plant.parameters if p.component in sensors}
        self._names, self._stuck = Names(plant.faults), frozenset[str]()
        self._further = 0.0

    def explain(
        self, question: Question, window: Window, recent: Window, posterior: Posterior
    ) -> tuple[Hypothesis, ...]:
        """Explanations of the readings of ``window``, most probable first; a second fault is looked for in ``recent``.

        What was known and began in the window competes as everything else does: all that spoke for it is seen again.
        What began before it is not forgotten. Where readings or controllers speak for themselves, the twin is asked
        what else is wrong only if that does not explain all others. Where the best explanation does not fit, a cause
        that nobody listed is as likely as all of them.
        """
        parts = self._plant, self._model, self._carrier
        wrong = established(question.shown or window, *parts, question.since_s, question.known)
        evidence, search = self._on(window, posterior, question.known, question.before)
        if (
            not question.news
            and _certain(question.before)
            and wrong.told(question.before)
            and self._still_holds(evidence, search, question.before[0].faults)
        ):
            return question.before
        if not wrong.faults:
            return self._found(evidence, search, question, recent)
        known, before = wrong.others(question.known), wrong.without(question.before)
        alone = wrong.alone(evidence, search, known, self._settings.misled)
        alone = stated(alone, {}, evidence, self._size_error, DOUBT)
        asked = replace(question, known=known, before=before)
        further = wrong.leave_open(known, question.before)
        if not further and not wrong.hide(evidence.variables) and wrong.explain(evidence, wrong.faults):
            return alone
        found = self._beside_them(wrong, asked, evidence, recent, further)
        every = wrong.joined(found, wrong.as_named(alone[0].faults), question.known)
        others = further or any(wrong.others(h.faults) for h in every if not h.something_else)
        return every if others else alone

    def _beside_them(
        self, wrong: Established, question: Question, evidence: Evidence, recent: Window, further: bool
    ) -> tuple[Hypothesis, ...]:
        """What explains the readings of ``evidence`` beside what is ``wrong`` by itself; none where nothing need.

        ``further``: whether it is looked for also where they alone would do.
        """
        posterior, other = evidence.posterior, copy(self)
        other._accuracy, other._calibrated = wrong.accuracy(self._accuracy), wrong.calibrated(self._calibrated)
        other._stuck = wrong.unseen(evidence.variables)
        other._further = 0.0 if question.known else SECOND_FAULT_NATS

        def seen(window: Window) -> Window:
            return wrong.seen(window, posterior, self._accuracy, question.known)

        def past(onset_s: float) -> Window | None:
            then = question.past(onset_s)
            return None if then is None else seen(then)

        late, search = other._on(seen(evidence.window), posterior, question.known, question.before)
        if not further and wrong.explain(late, ()):
            return ()
        return other._found(late, search, replace(question, past=past), seen(recent))

    def _found(self, evidence: Evidence, search: Search, question: Question, recent: Window) -> tuple[Hypothesis, ...]:
        """What explains the readings of ``evidence``, or the ``recent`` ones as well, of all that a twin knows of."""
        window, posterior = evidence.window, evidence.posterior
        said = remembered(question.known, question.before, window.at_s(FIRST_ROW), DOUBT)
        claims = Claims(said[0].old, [s.old for s in said], evidence, window.at_s(FIRST_ROW), question.past)
        memory = Memory(said, self._carrier.modes, search.prior, window.end_s, claims)
        (nothing,) = memory.told([Scored((), float(search.score([()])[0]) + self._further)])
        named, unknown = self._named(search, question, window), self._estimated(evidence, search, (), question.since_s)
        again = self._again(search, question.known, said, window)
        scored, none = memory.told([*named, *unknown, *again]), nothing.score
        best, fit = _best(scored, evidence, none)
        if best.faults and (fit.strained or not self._keeps(best, question.known)):  # what changed is likelier than two
            for each in (unknown, again[:1]) if fit.strained else (again[:1],):
                scored += memory.told(self._courses(evidence, search, each))
            best, fit = _best(scored, evidence, none)
        forgets = bool(said[0].old) and not self._keeps(best, said[0].old)  # what fits alone may fit better beside it
        if best.faults and (forgets or not fit.good or (question.news and fit.strained) or question.dense):
            scored += memory.told(charged(search.joined(question.known, named), question.known))
            scored += self._beside(evidence, search, question.known, said[0].old)
            if len(question.known) <= 1:
                scored += memory.told(self._second(search, best, recent, posterior, question.known))
            best, fit = _best(scored, evidence, none)
        modes, since_s = self._carrier.modes, min(question.since_s, window.end_s)
        scored, none = _spread(with_doubt(scored, evidence, modes, self._settings.gain_error), none, best, fit)
        found = hypotheses(scored, none, modes, fit.good, since_s, self._settings.misled)
        courses = {s.faults: s.course for s in sorted(scored, key=lambda s: s.score) if s.course}
        return stated(found, courses, evidence, self._size_error, _divisor(fit))

    def _named(self, search: Search, question: Question, window: Window) -> list[Scored]:
        """Single faults of the tables: those that the symptoms indicate, and those that were said before.

        Symptoms clear while a fault is still there, and what was as likely as what was called the best still is.
        """
        lags = [window.end_s - lag * window.tick_s for lag in {*LAGS, *(DENSE_LAGS if question.dense else ())}]
        said = _said(question.before)
        names = dict.fromkeys([*question.candidates, *(f.fault for f in said)])
        tables = [name for name in names if self._carrier.modes[name].effect is None]
        near = [question.since_s - k * window.tick_s for k in range(NEAR)] if question.since_s <= window.end_s else []
        return search.singles(tables, sorted({*lags, *near, *(f.onset_s for f in (*question.known, *said))}))

    def _beside(self, evidence: Evidence, search: Search, known: FaultSet, old: FaultSet) -> list[Scored]:
        """Generated fault modes beside what was ``known``, and beside that of it that is ``old``."""
        found: list[Scored] = []
        for beside in dict.fromkeys(each for each in (old, known) if each):
            young = search.cost_of([f for f in beside if f not in old])
            found += [Scored(s.faults, s.score + young) for s in self._estimated(evidence, search, beside)]
        return found

    def _again(self, search: Search, known: FaultSet, said: Sequence[Remembered], window: Window) -> list[Scored]:
        """What was known, or is old, with other sizes, and with what is old and grew at rest: growth has an end."""
        found, first_s = list[Scored](), window.at_s(FIRST_ROW)
        for faults in dict.fromkeys((known, *(each.faults for each in said if each.old))):
            found += search.variations(faults)
            old = tuple(fault for fault in faults if fault.onset_s < first_s)
            found += search.at_rest(stopped(faults, old, self._carrier.modes, first_s, window.end_s), CHANGE_NATS)
        return self._names.given(found, self._carrier.modes, search.prior)

    def _keeps(self, scored: Scored, known: FaultSet) -> bool:
        modes = self._carrier.modes
        return all(any(continues(fault, before, modes) for fault in scored.faults) for before in known)

    def _still_holds(self, evidence: Evidence, search: Search, faults: FaultSet) -> bool:
        """Whether ``faults`` explain the readings of now as well, no other size of one does so better, nor nothing."""
        sets: list[FaultSet] = [faults, ()]
        for k, fault in enumerate(faults):
            sizes = (fault.severity * factor for factor in (1.0 - RESIZED, 1.0 + RESIZED))
            sets += [(*faults[:k], replace(fault, severity=size), *faults[k + 1 :]) for size in sizes]
        first_s, end_s = evidence.window.at_s(FIRST_ROW), evidence.window.end_s
        old = tuple(fault for fault in faults if fault.onset_s < first_s)
        sets += [replayed for _, replayed in stopped(faults, old, self._carrier.modes, first_s, end_s)]
        nats = evidence.likelihoods(sets)
        if np.isinf(nats[0]):  # with what was said the model leaves the physical world now
            return False
        fit = evidence.fit_of(faults)
        return not fit.strained and bool(np.all(nats[1:] <= nats[0] + 1.0))

    def nothing(self, window: Window, posterior: Posterior) -> dict[str, Fit]:
        """How well nothing being wrong explains each variable.

        ProcessError where the model leaves the physical world.
        """
        evidence = Evidence(self._model, self._carrier, window, posterior, self._accuracy)
        return evidence.fits(evidence.left(evidence.residuals([()]))[0])

    def ended(
        self, known: Sequence[FaultSet], windows: Iterable[Window], posterior: Posterior, beside: FaultSet = ()
    ) -> Ended | None:
        """That all that was ``known`` is over, by ``windows`` that end now, the shortest first; as :func:`ended`.

        ``beside``: what is wrong by itself all the same; of stuck instruments no reading is believed.
        """
        wrong = Established(beside, {}, self._plant, self._model, self._carrier)

        def compared(window: Window) -> Evidence:
            seen = wrong.seen(window, posterior, self._accuracy, known[0] if known else ())
            return Evidence(self._model, self._carrier, seen, posterior, self._accuracy)

        return ended(known, windows, compared, self._carrier.modes)

    def _on(
        self, window: Window, posterior: Posterior, known: FaultSet, before: Sequence[Hypothesis] = ()
    ) -> tuple[Evidence, Search]:
        evidence = Evidence(self._model, self._carrier, window, posterior, self._accuracy, known)
        leapt = jumped(window, self._plant, evidence.variables)
        prior = Prior(self._plant.faults, window, evidence.variables, self._calibrated, leapt, self._stuck)
        modes, first_s = self._carrier.modes, window.at_s(FIRST_ROW)
        had = sizes(known, before, first_s, modes, self._size_error)
        return evidence, Search(evidence, modes, prior, (*known, *_said(before)), had)

    def _estimated(self, evidence: Evidence, search: Search, beside: FaultSet, since_s: float = np.inf) -> list[Scored]:
        """Every generated fault mode of an item that is not accused ``beside``, at its best."""
        accused = {self._carrier.modes[f.fault].component for f in beside}
        modes = [mode for mode in self._plant.generated if mode.component not in accused]
        estimates = _estimates(evidence, modes, search, beside, since_s)
        found = [each for estimate in estimates for each in self._bounded(estimate, beside)]
        found += standing(evidence, modes, search.prior, beside)
        further = SECOND_FAULT_NATS if beside else 0.0
        found = [Scored(each.faults, each.score - further) for each in found]
        found += list(self._turned_back(found, search.known, evidence.window.at_s(FIRST_ROW)))
        return self._names.given(found, self._carrier.modes, search.prior)

    def _turned_back(self, found: Sequence[Scored], known: FaultSet, first_s: float) -> Iterator[Scored]:
        """Each of ``found`` that goes on swinging as was ``known``: these readings say again when it turns.

        Both swing alike in all readings that are looked at, so that both explain them as well.
        """
        for each in found:
            state = turned_back(each.faults[-1], known, first_s)
            if state is not None:
                yield replace(each, faults=(*each.faults[:-1], state))

    def _bounded(self, estimate: Estimate, beside: FaultSet) -> list[Scored]:
        """The estimate, and what bounds its size at two standard deviations; what is unknown may also grow."""
        state, found = estimate.state, [Scored((*beside, estimate.state), estimate.score)]
        unknown = self._carrier.modes[state.fault].unknown
        grown = self._settings.unknown_growth * abs(state.severity) if unknown else 0.0
        for size in (abs(state.severity) - 2.0 * estimate.sd, abs(state.severity) + max(2.0 * estimate.sd, grown)):
            if size > 0.0:
                near = replace(state, severity=math.copysign(size, state.severity))
                found.append(Scored((*beside, near), estimate.score - DOUBT * SPREAD_NATS))
        return found

    def _courses(self, evidence: Evidence, search: Search, unknown: Sequence[Scored]) -> list[Scored]:
        """The likeliest generated modes, each of another item, where they changed more than once."""
        modes, leaders = self._carrier.modes, dict[str, Scored]()
        for each in unknown:
            alone = modes[each.faults[0].fault] if len(each.faults) == 1 else None
            if alone is not None and not (alone.listed or alone.sizeless or each.faults[0].period_s):
                leaders.setdefault(alone.component, each)
        found = []
        for first in list(leaders.values())[:COURSES]:
            course = first
            for _ in range(CHANGES):
                course = self._changed_again(evidence, search, course) or course
            if course.course:
                found.append(replace(course, faults=(lasting(course.course, modes, evidence.window.end_s),)))
        return self._names.given(found, modes, search.prior)

    def _changed_again(self, evidence: Evidence, search: Search, before: Scored) -> Scored | None:
        """``before`` with one more change of the same quantity; None where that explains no more."""
        modes, replayed = self._carrier.modes, before.replayed
        effect = modes[replayed[0].fault].effect
        assert effect is not None, "courses are of generated modes"
        others = [m for m in self._plant.generated if m.effect is not None and not m.effect.swings]
        alike = [m for m in others if m.effect is not None and m.effect.quantity == effect.quantity]
        estimates = _estimates(evidence, alike, search, replayed)
        if not estimates:
            return None
        change = estimates[0]
        of_mode = search.prior.of_mode(modes[change.state.fault])
        before_nats = search.cost_of(replayed) - (len(replayed) - 1) * (of_mode + CHANGE_NATS)
        score = change.score - of_mode - CHANGE_NATS + before_nats
        return Scored((), score, (*replayed, change.state)) if score > before.score + 1.0 else None

    def _second(
        self, search: Search, best: Scored, recent: Window, posterior: Posterior, known: FaultSet
    ) -> list[Scored]:
        """Explanations with a fault of the tables besides the best one, where the end of the readings asks for it."""
        _, late = self._on(recent, posterior, known)
        every = [fault.name for fault in self._plant.faults]
        doubles = late.pairs(best.faults[0], every, [recent.end_s - lag * recent.tick_s for lag in LAGS[:12:2]])
        if not doubles or max(d.score for d in doubles) - float(late.score([best.faults])[0]) <= SECOND_FAULT_NATS:
            return []
        sets = [d.faults for d in doubles]
        found = [Scored(s, score) for s, score in zip(sets, search.score(sets).tolist(), strict=True)]
        return charged(found, best.faults)


def _best(scored: Sequence[Scored], evidence: Evidence, none: float) -> tuple[Scored, Fit]:
    """The best explanation and how well it fits."""
    best = max(scored, key=lambda s: s.score, default=Scored((), none))
    return best, evidence.fit_of(best.replayed)


def _spread(scored: Sequence[Scored], none: float, best: Scored, fit: Fit) -> tuple[list[Scored], float]:
    """``scored`` and ``none`` with their gaps to ``best`` made smaller by how much even that leaves unexplained.

    Where nothing explains everything, something is at work that no explanation has, and differences say less. That
    makes further faults no likelier than they were.
    """
    k, most = _divisor(fit), len(best.faults)
    gaps = [(s, (s.score - best.score) / (k if len(s.faults) <= most else DOUBT)) for s in scored]
    return [replace(s, score=best.score + gap) for s, gap in gaps], best.score + (none - best.score) / k


def _divisor(fit: Fit) -> float:
    """By how much smaller differences count than those of log-likelihoods where the best explanation fits so well."""
    return DOUBT + fit.unexplained / UNEXPLAINED_NATS


def _estimates(
    evidence: Evidence, modes: Sequence[FaultMode], search: Search, beside: FaultSet, since_s: float = np.inf
) -> list[Estimate]:
    """Each of ``modes`` at its best ``beside`` others, the best first; none where there is too little to go by."""
    if evidence.shape[0] < SHORTEST:
        return []
    try:
        return Estimation(evidence, modes, search.prior, beside).estimates(since_s)
    except ProcessError:  # what is beside, or the readings at the beginning, are no state of the model
        return []


def _said(before: Sequence[Hypothesis]) -> list[FaultState]:
    """Every fault that was said ``before``."""
    return [f for h in before if not h.something_else for f in h.faults]


def _certain(said: Sequence[Hypothesis]) -> bool:
    """Whether one set of faults was said with near certainty, of those that a twin can carry."""
    held = with_a_twin(said)
    return bool(held) and bool(held[0].faults) and sum(h.probability for h in held if h.name == held[0].name) >= CERTAIN
