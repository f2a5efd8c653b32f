"""Trip limits: watched on what instruments say and on what else they may mean, by cumulative sums.

What else they may mean says a diagnosis, and a reading that has jumped as no process can.

A single noisy reading above its limit is no violation, a lasting one must not wait for a slow filter. So every limit
has a cumulative sum (Page, Biometrika 41, 1954) of its violation over time, S := max(0, S - margin dt), and trips when
S exceeds what the table allows [unit of the margin times s]. A violation lasts until S has come back to zero. A limit
that could not be kept otherwise is watched with a lead: its margin is that much less than it is.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from homeostat.domain.events.trips import TripLifted, TripLiftEnded
from homeostat.domain.plant.limits import Limit
from homeostat.domain.plant.rules import GuardRules, TripRule
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.trial import Trial
from homeostat.guard.watch.falls import Falls
from homeostat.guard.watch.jumps import Jumps
from homeostat.guard.watch.start_up import StartUpPhase
from homeostat.guard.watch.violations import Errors, Violation, corrected_margin, margin_of, unreadable, violation
from homeostat.guard.watch.watched import Watched, cumulated, used
from homeostat.stl.formula import Formula

NEAR = 0.5
"""Share of its allowance that a limit may have used up while something is still released [1]."""
LONGEST = 5.0
"""Ticks for which one reading counts in a sum at most, where they are further apart than they should be."""
REFUTED_S = 60.0
"""How long a carrier may say that a limit is violated while undoubted readings say that it is not, by the reference
[s]. What a balance tells ahead has begun to show by then; one that goes on saying so has an instrument that lies."""
SMOOTHED = 3.0
"""Time constant with which a corrected value is seen to come back, beside its noise, in ticks."""
COMES_BACK_S = 60.0
"""A violation comes back that would be over this time after it began if it went on so by the
reference [s]."""
MOST = 100
"""Most explanations that a correction may have."""


class TripWatch:
    """Judges every hard limit once per tick, whether or not anything is latched."""

    def __init__(
        self, rules: GuardRules, note: Callable[[GuardEvent, float], None], jumps: Jumps | None = None
    ) -> None:
        """``note`` journals an event at a process time [s]; a limit without a rule trips at its first violation.

        ``jumps`` know which readings have jumped, and by how much.
        """
        self._rules, self._note = rules, note
        self._jumps = Jumps({}) if jumps is None else jumps
        self._tick_s = rules.timing.tick_s
        self._refuted_s, self._comes_back_s = rules.timing.times_s((REFUTED_S, COMES_BACK_S))
        self._limits = {limit.name: limit for limit in rules.limits.hard}
        self._trips = {name: rules.trips.get(name, TripRule(name)) for name in self._limits}
        self._watched = {name: Watched() for name in self._limits}
        self._falls = {name: Falls(trip.fastest, self._tick_s) for name, trip in self._trips.items()}
        self._errors: tuple[Errors, ...] = ({},)
        self._fresh = False
        self._at_s = math.inf
        self._starting: bool | None = None
        self.start_up = StartUpPhase(rules.start_up, rules.machine, note)
        """The phase in which some limits are others."""

    def correct(self, errors: tuple[Errors, ...]) -> None:
        """Take note of instrument errors, one mapping per likely explanation; what is not finite is none.

        ValueError where there are too many to be judged within a tick.
        """
        if len(errors) > MOST:
            raise ValueError(f"a correction has {len(errors)} explanations; at most {MOST} are judged")
        tags = len(self._rules.tags)
        if any(len(error) > tags for error in errors):
            raise ValueError(f"an explanation corrects more readings than there are tags ({tags})")
        clean = tuple({t: float(e) for t, e in error.items() if math.isfinite(e)} for error in errors)
        self._fresh = self._fresh or clean != self._errors
        self._errors = clean or ({},)
        self._jumps.correct(self._errors)

    def remember(self, trial: Trial, now_s: float) -> None:
        """Go on after a death: no trip may be lifted for longer than without it.

        A limit that was violated is so until its sum has come back to zero: it must not look as if it had come back.
        """
        self._jumps.remember(trial.jumped)
        for name, watched in self._watched.items():
            watched.lifted_s = trial.lifted_s(name, self._trips[name].lift_s, now_s)
            if name in trial.unseen:
                watched.blind_s = self._trips[name].grace_s  # the next tick without a reading is one too many
            elif name in trial.violated:
                watched.raw = watched.corrected = self._trips[name].cusum
                watched.violated = True

    def judge(self, now_s: float, readings: Snapshot | None, state: str) -> tuple[Violation, ...]:
        """Every violated hard limit at ``now_s`` [s] in ``state``; ``readings`` are judged for quality already."""
        dt_s = max(now_s - self._at_s, 0.0) or self._tick_s  # a tick counts, should the clock stand
        self._at_s = now_s
        self._change(self.start_up.holds(now_s, readings, state))
        found = [self._judge(name, readings, now_s, dt_s) for name in self._limits]
        self._fresh = False
        return tuple(v for v in found if v is not None)

    def near(self, readings: Snapshot) -> tuple[Violation, ...]:
        """Hard limits that forbid a release on these ``readings``: undecided, or half way to a trip."""
        found = []
        for name, watched in self._watched.items():
            limit = self._in_force(name)
            margin = margin_of(limit.watched, readings.values)
            most = max(watched.raw, 0.0 if watched.disputed else watched.corrected)
            if math.isnan(margin) or (not watched.lifting and most > NEAR * self._trips[name].cusum):
                found.append(violation(limit, margin, readings.values))
        return tuple(found)

    def above(self, readings: Snapshot) -> tuple[Violation, ...]:
        """Hard limits that are violated on the very ``readings``, as they are or corrected, if only by noise."""
        found = []
        for name, watched in self._watched.items():
            limit = self._in_force(name)
            values = readings.values
            explained = () if watched.disputed else self._explained(limit, values)
            margin = min([margin_of(limit.watched, values), *explained, *self._unjumped(limit, values)])
            if margin < 0.0 and not watched.lifting:
                found.append(violation(limit, margin, values))
        return tuple(found)

    def _change(self, starting: bool) -> None:
        """Start-up begins or ends: a sum that was made against one limit says nothing about another.

        While a plant fills, readings move as they never do in operation: what has jumped then is forgotten.
        """
        if starting:
            self._jumps.forget()
        if self._starting is not None and starting is not self._starting:
            for name in self._rules.start_up.limits.keys() & self._watched.keys():
                watched = self._watched[name]
                watched.raw, watched.borne, watched.corrected, watched.violated = 0.0, 0.0, 0.0, False
                watched.disputed, watched.said, watched.said_s = False, 0.0, 0.0
                self._falls[name].forget()
        self._starting = starting

    def _in_force(self, name: str) -> Limit:
        return self._rules.start_up.limits.get(name, self._limits[name]) if self._starting else self._limits[name]

    def _judge(self, name: str, readings: Snapshot | None, now_s: float, dt_s: float) -> Violation | None:
        watched, rule, limit = self._watched[name], self._trips[name], self._in_force(name)
        values = {} if readings is None else readings.values
        said = margin_of(limit.watched, values)
        blind = _blind(limit, rule, watched, said, dt_s, readings)
        uncertain = not math.isnan(said) and readings is not None and bool(limit.formula.tags & readings.uncertain)
        unbelieved = uncertain or self._has_fallen(watched, rule, said, values, now_s)
        watched.doubted_s = used(watched.doubted_s, dt_s, rule.grace_s, unbelieved)
        if unbelieved and said < 0.0:  # and has been since the reading first violated the limit
            watched.doubted_s = max(watched.doubted_s, watched.said_s + dt_s)
        doubted = math.isnan(said) or (unbelieved and watched.doubted_s <= rule.grace_s)
        if not doubted:
            if said < 0.0:  # what was not believed and has stayed was true all the time
                watched.raw = max(watched.raw, watched.said)
            contradicted = said > 0.0 and rule.carrier is not None and margin_of(rule.carrier, values) < 0.0
            watched.refute(contradicted, dt_s, self._refuted_s)
            watched.borne = 0.0
        # What carries a limit takes back nothing that its readings have shown.
        carried = self._carried(rule, watched, readings) if doubted and not watched.refuted else None
        counted_s = min(dt_s, LONGEST * self._tick_s)
        raw = said if carried is None else min(carried, 0.0)
        added = raw if carried is None or watched.violated else watched.bear(carried, counted_s, rule.cusum)
        watched.hear(said, dt_s, counted_s, rule.cusum)
        if math.isnan(raw):  # a violated limit has not come back because nobody sees it any more
            return blind or (violation(limit, raw, values) if watched.violated else None)
        refuting = self._explained(limit, values)
        explained = refuting or (raw,)
        told, unjumped = min(explained), min(self._unjumped(limit, values), default=math.inf)
        if self._fresh and watched.lifting and not watched.violated and min(said, told, unjumped) >= 0.0:
            # What a correction showed alone, and the carrier refuted, goes with it.
            watched.corrected = min(watched.corrected, watched.raw)
        corrected = min(told, unjumped)
        watched.raw = cumulated(watched.raw, added, counted_s, rule.cusum)
        self._dispute(rule, watched, said, told, dt_s, uncertain)
        # A jump is no correction that somebody made.
        counted = unjumped if watched.disputed else min(told if refuting else added, unjumped)
        if math.isfinite(counted):
            watched.corrected = cumulated(watched.corrected, counted, counted_s, rule.cusum)
        size = max(explained) - (raw if math.isnan(said) else said)
        carries = self._carries(rule, watched, readings, dt_s)
        lifted = carries and watched.raw > rule.cusum and self._may_lift(rule, watched, size, explained, said)
        held = carries and watched.corrected > rule.cusum and unjumped >= 0.0
        held = held and watched.uncarried == 0.0 and self._may_hold(rule, watched, said - told, said)
        if lifted or held:
            self._lift(rule, watched, now_s, dt_s)
        trips = (watched.corrected > rule.cusum and not held) or (watched.raw > rule.cusum and not lifted)
        over = max(watched.raw, watched.corrected) > 0.0
        watched.violated = trips or (watched.violated and over and not lifted)
        watched.fell = watched.fell and (over or now_s < watched.fell_until_s)
        if watched.lifting and not over:
            watched.lifting = False
            self._note(TripLiftEnded(name, watched.lifted_s), now_s)
        return self._told(limit, raw, corrected, values) if watched.violated else blind

    def _told(self, limit: Limit, raw: float, corrected: float, values: Mapping[str, float]) -> Violation:
        """The violation, and which reading has jumped where it is violated only if that was right before."""
        found = violation(limit, min(raw, corrected), values)
        unjumped = min(self._unjumped(limit, values), default=math.inf)
        if not unjumped < 0.0 <= min((raw, *self._explained(limit, values))):
            return self._taken(found, limit, raw, values)
        jumped = ", ".join(f"{t!r} by {e:+.4g}" for t, e in self._jumps.errors.items() if t in limit.formula.tags)
        return replace(
            found, reason=f"{found.reason}, if {jumped} has jumped for no reason in the process", jumped=True
        )

    def _taken(self, found: Violation, limit: Limit, raw: float, values: Mapping[str, float]) -> Violation:
        """``found``, with what its readings are taken to be where an explanation alone says that it is violated."""
        if not raw >= 0.0:
            return found
        margins = {k: corrected_margin(limit.watched, values, errors) for k, errors in enumerate(self._errors)}
        worst = min((k for k, m in margins.items() if m < 0.0), key=margins.__getitem__, default=None)
        errors = {} if worst is None else self._errors[worst]
        taken = [f"{t!r} reads {values[t]:.4g} and is taken to be {values[t] - e:.4g}" for t, e in errors.items()
                 if e and t in limit.formula.tags]  # fmt: skip
        if not taken:
            return found
        before, name, after = found.reason.rpartition(f" ({limit.name})")
        return replace(found, reason=f"{before}; {', '.join(taken)}{name}{after}")

    def _dispute(
        self, rule: TripRule, watched: Watched, said: float, corrected: float, dt_s: float, steps: bool
    ) -> None:
        """Whether it is open who is right about a violation that a correction alone shows, for the grace time.

        So it is where the violation comes with the correction, as it then was there before anybody knew and recovery
        answers next, and where the reading ``steps`` to where the correction that was made before no longer fits. One
        that develops under a correction that stands is none. While the corrected value comes back no time is used.
        """
        begins = said >= 0.0 > corrected and not (watched.disputed or watched.violated or watched.corrected > 0.0)
        begins = begins and (self._fresh or steps)
        if begins or self._fresh:
            watched.smooth = corrected
        else:
            watched.smooth += (1.0 - math.exp(-dt_s / (SMOOTHED * self._tick_s))) * (corrected - watched.smooth)
        if begins:
            watched.begun = watched.best = corrected
        watched.disputed = begins or (watched.disputed and said >= 0.0 > watched.smooth)
        comes_back = watched.disputed and watched.smooth > watched.best - watched.begun * dt_s / self._comes_back_s
        if comes_back:
            watched.best = watched.smooth
        if not comes_back:
            watched.disputed_s = used(watched.disputed_s, dt_s, rule.grace_s, watched.disputed)
        watched.disputed = watched.disputed and watched.disputed_s <= rule.grace_s

    def _explained(self, limit: Limit, values: Mapping[str, float]) -> tuple[float, ...]:
        """Margin of ``limit`` under every explanation that refutes a reading, where it can be judged."""
        margins = (corrected_margin(limit.watched, values, errors) for errors in self._errors if errors)
        return tuple(m for m in margins if not math.isnan(m))

    def _unjumped(self, limit: Limit, values: Mapping[str, float]) -> tuple[float, ...]:
        """Margin of ``limit`` if what has jumped had not; empty where nothing in it has, or nobody can judge it."""
        jumped = self._jumps.errors
        if jumped.keys().isdisjoint(limit.formula.tags):
            return ()
        margin = corrected_margin(limit.watched, values, jumped)
        return () if math.isnan(margin) else (margin,)

    def _has_fallen(
        self, watched: Watched, rule: TripRule, said: float, values: Mapping[str, float], now_s: float
    ) -> bool:
        """Whether a violation came faster than the process can, and what carries the limit says that there is none."""
        if self._falls[rule.limit].take(said, values):
            watched.fell, watched.fell_until_s = True, now_s + rule.grace_s
        carrier = _carrier(rule, watched)
        came = said < 0.0 and now_s < watched.fell_until_s
        return came and carrier is not None and margin_of(carrier, values) >= 0.0

    def _carried(self, rule: TripRule, watched: Watched, readings: Snapshot | None) -> float | None:
        """Least margin of what carries the limit under any explanation; None where nothing does, or not now."""
        carrier = _carrier(rule, watched)
        if self._starting or carrier is None or readings is None or carrier.tags & readings.uncertain:
            return None
        margins = [corrected_margin(carrier, readings.values, errors) for errors in ({}, *self._errors)]
        return None if any(map(math.isnan, margins)) else min(margins)

    def _carries(self, rule: TripRule, watched: Watched, readings: Snapshot | None, dt_s: float) -> bool:
        """Whether something carries the limit, so that a trip may be lifted or go on being so.

        While one is, a noisy reading of what carries the limit ends that as little as one of the limit's own trips: it
        may be blind for the grace time, and its violations add up as those of the limit do.
        """
        carried = self._carried(rule, watched, readings)
        watched.uncarried_s = used(watched.uncarried_s, dt_s, rule.grace_s, watched.lifting and carried is None)
        if not watched.lifting:
            watched.uncarried = 0.0
            return carried is not None and carried >= 0.0
        if carried is not None:
            counted_s = min(dt_s, LONGEST * self._tick_s)
            watched.uncarried = cumulated(watched.uncarried, carried, counted_s, rule.cusum)
        return watched.uncarried_s <= rule.grace_s and watched.uncarried <= rule.cusum

    def _may_lift(
        self, rule: TripRule, watched: Watched, size: float, explained: tuple[float, ...], said: float
    ) -> bool:
        """Whether a correction of this ``size`` may keep a reading from tripping while something carries its limit.

        Its own violations add up as those of the limit do: a noisy one neither ends nor forbids that. Under every
        explanation there must be less of one than is ``said``; of a reading that nobody sees that is open.
        """
        refuted = all(self._errors) and not min(explained) <= said  # an empty one: they may be right
        bounded = size <= rule.lift and watched.lifted_s < rule.lift_s
        return refuted and bounded and watched.corrected <= rule.cusum

    def _may_hold(self, rule: TripRule, watched: Watched, size: float, said: float) -> bool:
        """Whether a violation that a correction of this ``size`` alone shows may wait: reading and carrier refute it.

        An error that has ended is corrected for until recovery has noticed. What has tripped waits for nothing.
        """
        bounded = size <= rule.lift and watched.lifted_s < rule.lift_s
        return not watched.violated and said >= 0.0 and watched.raw <= rule.cusum and bounded

    def _lift(self, rule: TripRule, watched: Watched, now_s: float, dt_s: float) -> None:
        carrier = _carrier(rule, watched)
        if not watched.lifting and carrier is not None:
            watched.lifting = True
            self._note(TripLifted(rule.limit, carrier.text, now_s + rule.lift_s - watched.lifted_s), now_s)
        watched.lifted_s += dt_s


def _carrier(rule: TripRule, watched: Watched) -> Formula | None:
    """What carries the limit, as its margin came down."""
    return rule.fallen if watched.fell and rule.fallen is not None else rule.carrier


def _blind(
    limit: Limit, rule: TripRule, watched: Watched, said: float, dt_s: float, readings: Snapshot | None
) -> Violation | None:
    """A limit that cannot be judged is violated after its grace time; counted in ticks, should the clock stand.

    It is seen to be violated where it was so, or on its way to a trip, when its reading was lost.
    """
    watched.blind_s = used(watched.blind_s, dt_s, rule.grace_s, math.isnan(said))
    if watched.blind_s <= rule.grace_s:
        return None
    text = f"{limit.formula.text!r} could not be judged for {watched.blind_s:g} s; {rule.grace_s:g} s are allowed"
    text = f"{text}: {unreadable(limit.formula, readings)} ({rule.limit})"
    seen = watched.violated or watched.said > 0.0
    return Violation(rule.limit, math.nan, limit.formula.unit, text, seen)
