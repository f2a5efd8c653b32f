"""Monitoring: from snapshots to symptoms, from symptoms through the graph to hypotheses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.hypotheses import probabilities
from homeostat.agents.monitoring.clearing import Clearing, may_return
from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.agents.monitoring.followed import Followed
from homeostat.agents.monitoring.recurring import Recurring
from homeostat.agents.monitoring.settings import MonitoringSettings
from homeostat.agents.monitoring.sharpening import Sharpening, calibrated
from homeostat.agents.monitoring.stepped import Stepped
from homeostat.agents.monitoring.still import Picture, Still
from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.agents.monitoring.unexplained import Unexplained, nothing_fits
from homeostat.domain.diagnosis import (
    AS_LIKELY_AS_NOT,
    Diagnosis,
    EffectKind,
    FaultState,
    Hypothesis,
    Symptom,
    with_a_twin,
)
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Released, Resolution
from homeostat.process.batch import ProcessError
from homeostat.stl.formula import Formula
from homeostat.twin.isolation.ended import left_open
from homeostat.twin.twin import Twin


class TwinMonitoring:
    """Implements :class:`homeostat.agents.roles.Monitoring` with reference values and the twin's explanations."""

    def __init__(
        self,
        twin: Twin,
        grounding: Grounding,
        description: PlantDescription,
        baselines: Mapping[str, Baseline],
        started: Formula,
        settings: MonitoringSettings | None = None,
    ) -> None:
        """``started`` holds once the plant has left start-up."""
        self._twin = twin
        self._grounding = grounding
        self._started_formula = started
        self._settings = settings or MonitoringSettings()
        self._timing = description.timing
        self._still, self._picture = Still(description, twin.stuck), Picture(description)
        self._filters = [FeatureFilter(f, description.timing.tick_s) for f in description.features]
        self._watches = [SymptomWatch(r, baselines[r.feature]) for r in description.symptom_rules]
        self._held = frozenset(loop.process_variable for loop in description.loops)
        self._followed = Followed(description, self._watches)
        spans = {tag: description.tag(tag).range.span for tag in description.writables}
        self._recurring = Recurring(self._watches, spans, self._timing.tick_s)
        self._every = tuple(fault.name for fault in description.faults)
        self._sums = {f.name: 0.0 for f in description.features}
        self._counted = 0
        self._started_s: float | None = None
        self._centred, self._adapted_s = False, math.inf
        self._acknowledged: dict[str, float] = {}
        self._sharpening = Sharpening(twin, self._timing, self._settings.review_s)
        self._first_s: float | None = None
        self._quiet_until_s = self._gathers_until_s = 0.0
        self._review_at_s: float | None = None
        self._known: tuple[FaultState, ...] = ()
        self._last: tuple[Symptom, ...] = ()
        self._stopped = False
        self._situation = Unexplained(self._settings.repeat_s, self._settings.review_s)
        self._said: tuple[Hypothesis, ...] = ()
        self._doubts: tuple[Hypothesis, ...] = ()
        self._returns_until_s = math.inf
        self._told: frozenset[str] = frozenset()
        self._forgot = False
        self._clearing, self._checks = Clearing(description.timing), False
        self._stepped = Stepped(description)
        self._unseen = {m.name for m in description.fault_modes if m.effect and m.effect.kind is EffectKind.UNSEEN}
        self._growing = {m.name for m in description.fault_modes if m.effect is not None and m.effect.grows}
        self._indicates = {r.name: frozenset(r.faults) for r in description.symptom_rules}
        reads = {f.name: f.tags for f in description.features}
        self._reads = {r.name: reads[r.feature] for r in description.symptom_rules}
        self._open, self._again = frozenset[str](), False
        self._from_s = self._beside_s = self._at_s = -math.inf
        self._symptoms: tuple[Symptom, ...] = ()

    def notices(self, snapshot: Snapshot) -> bool:
        """Take a snapshot; whether something needs explaining now. A snapshot that repeats the last one is ignored."""
        if snapshot.at_s <= self._at_s:
            return False
        if self._picture.repeats(snapshot):
            self._still.passed_over(snapshot)
            return False
        self._twin.observe(snapshot)
        self._at_s = snapshot.at_s
        self._symptoms = self._update(snapshot)
        if (until_s := self._stepped.take(snapshot, self._known)) is not None:
            self._clearing.look_at(until_s)
        return not self._stopped and self._attention(snapshot.at_s)

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """The symptoms that are active now."""
        return self._symptoms

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        """The diagnosis as of now; not faulty where evidence is missing or nothing is the best explanation.

        Where nothing is, it has the symptoms: what was measured explains them, or what nobody knows.

        That the batch ``deviates`` from its prediction is evidence enough: each fault is tried, and none is waited for.
        """
        found = self._diagnosed(deviates)
        led = [s.rule for s in self._last]
        return replace(found, recurs=self._recurring.of(self._at_s, bool(self._still.symptoms), self._known, led))

    def _diagnosed(self, deviates: bool) -> Diagnosis:
        ended, fits = self._ended()
        if ended is not None and (fits or not self._symptoms):
            return ended
        checks, self._checks = self._checks, False
        again, self._again = self._again, False
        if checks and self._said and not (deviates or self._forgot):
            return Diagnosis(self._at_s, self._last, self._said, news=False)
        try:
            hypotheses = self._explain(self._symptoms, deviates)
        except ProcessError:
            return self._no_state()
        nothing = Diagnosis(self._at_s, (), ())
        if not hypotheses:  # no symptom any more, and nothing known: what was thought of the last one is not forgotten
            if self._at_s >= self._returns_until_s:
                self._doubts, self._returns_until_s = (), math.inf
            return Diagnosis(self._at_s, (), self._doubts, doubts=bool(self._doubts))
        if not deviates and self._unsure(hypotheses) and self._waiting(self._at_s):
            return nothing
        if sum(h.probability for h in with_a_twin(hypotheses) if not h.faults) > AS_LIKELY_AS_NOT:
            if (ended or self._known) and not deviates:
                return ended or self._over(self._at_s)
            return nothing if deviates else self._unexplained(hypotheses)
        faulty = [h.faults for h in hypotheses if h.faults and not h.something_else]
        before, self._known = self._known, next(iter(faulty), ())
        self._said, self._doubts, self._last = hypotheses, (), self._symptoms or self._last
        self._clearing.explained([s.rule for s in self._symptoms])
        self._acknowledge()
        self._sharpening.learn(hypotheses, self._at_s, deviates)
        self._twin.believe(self._known, self._from_s)
        same = {f.fault for f in before} == {f.fault for f in self._known}
        return Diagnosis(self._at_s, self._last, hypotheses, news=not (again and same))

    def _acknowledge(self) -> None:
        """Symptoms are explained until the next review, but for those that nothing that is likeliest raises.

        A further fault may be behind those that cannot be told yet: they are looked at again, less and less often.
        """
        faults = frozenset(f.fault for f in self._known)
        told = faults <= frozenset(self._every)  # of what is generated nobody listed what it raises
        rules = frozenset(s.rule for s in self._symptoms)
        indicates = {rule: self._indicates.get(rule, frozenset()) for rule in rules}
        self._open = frozenset(r for r in rules if told and indicates[r] and not indicates[r] & faults)
        self._situation.explained(rules - self._open)
        wait_s = self._situation.left(self._open, self._at_s) if self._open else self._settings.review_s
        self._told = (self._told | rules) - self._open
        waits_s = {rule: wait_s if rule in self._open else self._settings.review_s for rule in rules}
        self._acknowledged.update({rule: self._at_s + for_s for rule, for_s in waits_s.items()})

    def _ended(self) -> tuple[Diagnosis | None, bool]:
        """That all that was known to be wrong is over, where it is, and whether nothing else is wrong since then."""
        said = [h for h in self._said if h.faults and not h.something_else]
        shown_by = self._still.shown_by
        every = (*self._known, *(f for h in said for f in h.faults))
        stuck = {f.fault: f.onset_s for f in every if f.fault in shown_by}
        moves = {fault: self._still.moves_since(shown_by[fault], at_s) for fault, at_s in stuck.items()}
        since_s = {fault: at_s for fault, at_s in moves.items() if at_s is not None}
        if since_s:
            return self._forget(since_s)
        stands = {fault for fault, at_s in stuck.items() if self._still.stands(shown_by[fault], at_s)}
        beside = {f.fault: f for f in reversed(every) if f.fault in stands or f.fault in self._unseen}
        if beside and any(f.fault not in self._unseen for f in self._known):
            return self._ended_beside(beside, said)
        ended = self._twin.frozen().ended(left_open(said), self._from_s) if self._known else None
        if ended is None:
            return None, True
        self._from_s = ended.since_s
        return self._over(ended.since_s), ended.fits

    def _ended_beside(
        self, beside: Mapping[str, FaultState], said: Sequence[Hypothesis]
    ) -> tuple[Diagnosis | None, bool]:
        """The same ``beside`` what is wrong by its own evidence, which no twin is asked about: name -> fault.

        What is over is forgotten, and what is left is explained anew, by what was read since then.
        """
        others = [replace(h, faults=tuple(f for f in h.faults if f.fault not in beside)) for h in said]
        others = [h for h in others if h.faults]
        if not others or all(f.fault in beside for f in self._known):
            return None, True
        wrong = tuple(beside.values())
        ended = self._twin.frozen().ended(left_open(others), self._from_s, wrong)
        if ended is not None:
            self._from_s = self._beside_s = ended.since_s
            if not any(f.fault in beside for f in self._known):
                return self._over(ended.since_s), ended.fits
            self._known = tuple(f for f in self._known if f.fault in beside)
            self._said, self._forgot = tuple(Hypothesis(f, 1.0) for f in (self._known,) if f), True
            self._twin.believe(self._known, self._from_s)
        return None, True

    def _forget(self, since_s: Mapping[str, float]) -> tuple[Diagnosis | None, bool]:
        """That instruments which were stuck move again, as of :meth:`_ended`: fault -> since when [s].

        What else was known is explained anew, without them. A loop that was held by one of them comes back to where it
        should be, and that transient is awaited as one of a release is.
        """
        if all(f.fault in since_s for f in self._known):
            self._from_s = max(since_s.values())
            if any(self._still.shown_by[fault] in self._held for fault in since_s):
                self._quiet_until_s = self._at_s + self._settings.transient_s
            return self._over(self._from_s), not self._symptoms
        self._known = tuple(f for f in self._known if f.fault not in since_s)
        self._twin.believe(self._known, self._from_s)
        left = [replace(h, faults=tuple(f for f in h.faults if f.fault not in since_s)) for h in self._said]
        self._said, self._forgot = tuple(left), True
        return None, True

    def _over(self, since_s: float) -> Diagnosis:
        """That what was known is over since ``since_s`` [s]: its transient is awaited.

        Nobody is known to have mended it, so that it may come back: for the time of a review that is doubted, and told.
        """
        self._doubts, self._returns_until_s = may_return(self._said), self._at_s + self._settings.review_s
        self._recurring.over(min((f.onset_s for f in self._known), default=math.inf))
        over, self._known, self._said, self._last, self._told = self._known, (), (), (), frozenset()
        self._twin.believe((), self._from_s)
        self._open = frozenset()
        self._review_at_s, self._first_s, self._beside_s = None, None, -math.inf
        self._clearing.over()
        self._situation.explained([s.rule for s in self._symptoms])
        self._acknowledged = self._still.unseen(self._acknowledged)
        self._acknowledged.update({s.rule: self._at_s + self._settings.transient_s for s in self._symptoms})
        return Diagnosis(self._at_s, (), self._doubts, over, since_s, doubts=bool(self._doubts))

    def _unexplained(self, hypotheses: tuple[Hypothesis, ...]) -> Diagnosis:
        """Symptoms of which nothing is the best explanation; they are looked at again after longer and longer times,
        and at once where another joins them or one has grown."""
        self._doubts, self._returns_until_s = hypotheses, math.inf
        wait_s, self._first_s = self._situation.left([s.rule for s in self._symptoms], self._at_s), None
        self._acknowledged.update({s.rule: self._at_s + wait_s for s in self._symptoms})
        return Diagnosis(self._at_s, self._symptoms, hypotheses, doubts=True)

    def _no_state(self) -> Diagnosis:
        """The readings are no state of the model, whatever is wrong: what was said stands, or nothing explains them."""
        if not self._said:
            return self._unexplained(nothing_fits(self._symptoms, self._at_s))
        self._acknowledged.update({s.rule: self._at_s + self._settings.repeat_s for s in self._symptoms})
        return Diagnosis(self._at_s, self._last, self._said, news=False)

    def follow(self, outcome: Resolution) -> None:
        """Take note of what was done: an expected transient is not a new fault, and reviews are scheduled."""
        self._first_s = None
        self._stopped = isinstance(outcome, FallbackNeeded)
        match outcome:
            case Released(actions=actions, at_s=at_s):
                self._sharpening.released_s = self._recurring.released_s = at_s
                self._followed.released(actions.commands, at_s)
                self._quiet_until_s = at_s + self._settings.transient_s
                self._review_at_s = at_s + self._review_in_s(at_s)
            case NoActionNeeded(at_s=at_s, late=late):
                self._review_at_s = at_s + (self._settings.repeat_s if late else self._review_in_s(at_s))
            case FallbackNeeded():
                self._review_at_s = None

    def _review_in_s(self, at_s: float) -> float:
        """When the situation is judged again, counted from ``at_s`` [s]: what grows, before its forecast has an end."""
        settings = self._settings
        grew_s = [at_s - f.onset_s for f in self._known if f.fault in self._growing]
        return min(settings.review_s, max(min(grew_s, default=settings.review_s), settings.repeat_s))

    def _update(self, snapshot: Snapshot) -> tuple[Symptom, ...]:
        """Confirmed symptoms; learns the plant's own means on the way."""
        values = {f.feature.name: f.update(snapshot) for f in self._filters}
        self._still.take(snapshot)
        if self._started_s is None:
            if self._started_formula.holds(snapshot.values):
                self._started_s = snapshot.at_s
            return ()
        if snapshot.at_s - self._started_s < self._settings.settle_s:
            return ()
        for watch in self._watches:
            value = values[watch.rule.feature]
            if value is not None:  # what is not known neither begins a symptom nor ends one
                watch.update(value, snapshot.at_s)
        self._recurring.take(snapshot, values)
        self._still.judge(snapshot.at_s)
        self._followed.take(snapshot)
        active = (*(w.active for w in self._watches if w.active is not None), *self._still.symptoms)
        sizes = {w.rule.name: w.size for w in self._watches if w.active is not None}
        self._situation.take({s.rule: s.severity for s in self._still.symptoms} | sizes, snapshot.at_s)
        known = {k: v for k, v in values.items() if v is not None}
        if self._known:
            self._adapted_s, self._counted = snapshot.at_s, 0
        elif len(known) == len(values):
            if self._centred:
                self._adapt(known, snapshot.at_s, healthy=not active)
            else:
                self._learn(known, healthy=not active)
        return active

    def _learn(self, values: Mapping[str, float], healthy: bool) -> None:
        """Accumulate means over an unbroken healthy stretch; after ``centre_s`` use them and calibrate the twin."""
        if not healthy:
            self._sums = dict.fromkeys(self._sums, 0.0)
            self._counted = 0
            return
        for name, value in values.items():
            self._sums[name] += value
        self._counted += 1
        if self._counted * self._timing.tick_s >= self._settings.centre_s:
            if not calibrated(self._twin, self._settings.centre_s):
                return self._learn(values, healthy=False)
            for watch in self._watches:
                watch.centre(self._sums[watch.rule.feature] / self._counted)
            self._centred, self._counted, self._adapted_s = True, 0, self._at_s

    def _adapt(self, values: Mapping[str, float], at_s: float, healthy: bool) -> None:
        """Follow a plant in which nothing is known to be wrong; calibrate anew after a long healthy stretch."""
        share = 1.0 - math.exp(-(at_s - self._adapted_s) / self._settings.adapt_s)
        self._adapted_s = at_s
        for watch in self._watches:
            watch.follow(values[watch.rule.feature], share)
        self._counted = self._counted + 1 if healthy else 0
        if self._counted * self._timing.tick_s >= self._settings.adapt_s:
            calibrated(self._twin, self._settings.centre_s)
            self._counted = 0

    def _attention(self, at_s: float) -> bool:
        """Whether something new was seen, or a review is due."""
        waiting = self._stepped.waiting(at_s)
        if self._review_at_s is not None and at_s >= self._review_at_s and not waiting:
            self._review_at_s = at_s + self._settings.review_s
            return True
        active = {s.rule for s in self._symptoms}
        if self._recurring.outgrew:  # it was let be, whatever explained it: that explains nothing now
            self._acknowledged = {rule: until_s for rule, until_s in self._acknowledged.items() if rule not in active}
        clears = at_s >= self._quiet_until_s and self._clearing.due(active, at_s)
        fresh = {
            s.rule
            for s in self._symptoms
            if (self._acknowledged.get(s.rule, 0.0) <= at_s or self._situation.grew(s.rule))
            and not self._reads.get(s.rule, frozenset()) & waiting
            and (at_s >= self._quiet_until_s or self._in_any_transient(s))
        }
        found = bool(fresh)
        self._checks = clears and not found
        self._again = found and fresh <= self._open and not any(map(self._situation.grew, fresh))
        return found or clears

    def _in_any_transient(self, symptom: Symptom) -> bool:
        """Whether no transient of the process raises ``symptom``: what it is about has another cause."""
        gathers = self._at_s < self._gathers_until_s
        return not gathers and (symptom in self._still.symptoms or self._followed.disobeyed(symptom.rule))

    def _explain(self, symptoms: tuple[Symptom, ...], deviates: bool) -> tuple[Hypothesis, ...]:
        """Candidate faults from the graph and the last diagnosis, explained by the twin; all where ``deviates``."""
        seen = [s.rule for s in symptoms]
        indicated = [rule for rule in seen if rule in self._indicates]
        candidates = self._grounding.candidate_faults(indicated) if indicated else ()
        others = self._every if deviates else ()
        ordered = list(dict.fromkeys([*candidates, *(f.fault for f in self._known), *others]))
        if not (ordered or seen):
            return ()
        since_s = min((*(s.at_s for s in symptoms), *(f.onset_s for f in self._known)), default=self._at_s)
        news = deviates or self._forgot or any(rule not in self._told for rule in seen)
        self._forgot = False
        asked = ordered, self._known, deviates, since_s, self._said, news
        if math.isfinite(self._beside_s):  # how it scattered before says that it is stuck
            return self._twin.frozen().explain(*asked, self._from_s, True)
        return self._twin.frozen().explain(*asked, -math.inf if self._still.symptoms else self._from_s)

    def _unsure(self, hypotheses: tuple[Hypothesis, ...]) -> bool:
        """Whether no explanation stands out."""
        return max(probabilities(with_a_twin(hypotheses)).values()) < self._settings.sure

    def _waiting(self, at_s: float) -> bool:
        """Whether there is still time to gather evidence; starts the wait."""
        if self._review_at_s is not None:
            return False
        if self._first_s is None:
            self._first_s = at_s
        if at_s - self._first_s < self._settings.evidence_s:
            until_s = min(self._first_s + self._settings.evidence_s, at_s + self._settings.again_s)
            self._quiet_until_s = self._gathers_until_s = until_s
            return True
        return False
