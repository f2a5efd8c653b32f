"""Doubts: what is told of symptoms while nothing is held to be wrong, and one alarm where nothing explains them."""

import math
from collections.abc import Sequence

from homeostat.domain.alarm import Priority
from homeostat.domain.diagnosis import (
    AS_LIKELY_AS_NOT,
    SOMETHING_ELSE,
    Diagnosis,
    Symptom,
    by_fault_set,
    with_a_twin,
)
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.recovery import Doubted, SymptomsCleared
from homeostat.domain.verdict import FallbackNeeded, Released, Resolution
from homeostat.recovery.look.prospect import Prospect
from homeostat.recovery.plant_rules import PlantRules
from homeostat.recovery.scene import Scene

ALARM = "unexplained"
"""Name of the alarm."""
SURE = 0.9
"""From this probability on that nothing is wrong is explanation enough: what is measured moves what is seen [1]."""
LEAST = 0.1
"""What is told only to say more than before must be this likely [1]."""
GONE_S = 60.0
"""Symptoms that have been gone for so long, by the reference, do not stand any more [s]."""
AGAIN_S = 600.0
"""Where the alarm comes back within this time, they must be gone twice as long, up to this, by the reference [s]."""
SOON_S = 60.0
"""A hard limit that may trip sooner than this, by the reference, is not waited for until the second look [s]."""
_MOST = 3
"""Most explanations that an alarm names."""
_WHEN = ("if nothing is done", "if one of these is wrong and nothing is done")
_FAR = "no hard limit is in sight"


def explained(diagnosis: Diagnosis) -> bool:
    """Whether an answer explains the symptoms: faults that are as likely as not, or nothing, where that is sure.

    What is only likelier than not is no reason to think of nothing any more; where something else is as likely as not,
    nothing that can be named fits the readings.
    """
    held = with_a_twin(diagnosis.hypotheses)
    nothing = sum(h.probability for h in held if not h.faults)
    other = sum(h.probability for h in held if h.something_else)
    faults = sum(h.probability for h in held) - nothing - other
    return other < AS_LIKELY_AS_NOT and (faults >= AS_LIKELY_AS_NOT or nothing >= SURE)


class Doubts:
    """Follows symptoms from when they are noticed until they are gone; tells doubts once, and holds one alarm."""

    def __init__(self, scene: Scene, prospect: Prospect, rules: PlantRules) -> None:
        """``prospect`` says what follows; ``rules`` how fast the plant is, and what its hard limits are."""
        self._scene, self._prospect = scene, prospect
        self._hard = frozenset(limit.name for limit in rules.limits.hard)
        self._least_s, self._longest_s = rules.timing.time_s(GONE_S), rules.timing.time_s(AGAIN_S)
        self._gone_s, self._returned_s = self._least_s, -math.inf
        self._soon_s = rules.timing.time_s(SOON_S)
        self._raised: Priority | None = None
        self._begun = False
        self._open: frozenset[str] = frozenset()
        self._noticed: dict[str, None] = {}
        self._rules: frozenset[str] = frozenset()
        self._said: set[frozenset[str]] = set()
        self._held = False
        self._quiet_s: float | None = None

    def notice(self, symptoms: Sequence[Symptom]) -> None:
        """The plant is looked at with ``symptoms``."""
        self._noticed.update(dict.fromkeys(s.rule for s in symptoms))

    def follow(self, symptoms: Sequence[Symptom]) -> None:
        """One more tick; ``symptoms`` are those that there are. Where they are gone for long enough, that is told."""
        at_s = self._scene.seen_s
        if symptoms:
            self._quiet_s = None
            return
        self._quiet_s = at_s if self._quiet_s is None else self._quiet_s
        if at_s - self._quiet_s < self._gone_s:
            return
        self._settle()
        if self._noticed and not self._held:
            self._scene.record(SymptomsCleared(tuple(self._noticed), self._quiet_s))
            self._forget()

    def tell(self, diagnosis: Diagnosis) -> None:
        """Record what is in doubt, unless it was said of as many symptoms before; note what is held to be wrong."""
        if diagnosis.ended_s is not None:
            self._settle()
            self._forget()
        if diagnosis.faulty:
            self._held = self._held or any(h.faults and not h.something_else for h in diagnosis.hypotheses)
        elif diagnosis.symptoms or diagnosis.ended_s is not None:
            self._held = False
        if not diagnosis.doubts or not (diagnosis.symptoms or diagnosis.ended_s is not None):
            return
        rules = frozenset(s.rule for s in diagnosis.symptoms)
        said = frozenset(b.name for b in by_fault_set(diagnosis.hypotheses) if b.probability >= LEAST)
        if rules <= self._rules and said in self._said:
            return
        self._rules |= rules
        self._said.add(said)
        self._scene.record(Doubted(diagnosis.symptoms, diagnosis.hypotheses, explained(diagnosis)), diagnosis.at_s)

    async def escalate(self, diagnosis: Diagnosis, outcome: Resolution, symptoms: Sequence[Symptom]) -> None:
        """Call a person where a second look has not explained what stands, or may come too late.

        ``outcome``: what was done about it; ``symptoms`` are those that there are. It is one alarm as long as they
        stand, raised again once where a hard limit comes into sight, and over when they are explained.
        """
        standing = [s for s in diagnosis.symptoms if s.rule in {each.rule for each in symptoms}]
        if not standing:
            return
        if explained(diagnosis):
            self._open = frozenset()
            return self._settle()
        rules = frozenset(s.rule for s in standing)
        again, self._open = bool(rules & self._open), rules
        if self._raised is Priority.HIGH:
            return
        supposed = diagnosis.doubts and not isinstance(outcome, Released)  # what was released is not to be overtaken
        every = (self._prospect.foreseen, await self._prospect.if_it_is(diagnosis) if supposed else None)
        in_sight = [(told, when) for told, when in zip(every, _WHEN, strict=True) if told and told.first]
        if self._raised is None and not again and all(self._nearest(told)[1] >= self._soon_s for told, _ in in_sight):
            return
        near = [self._told(*each) for each in in_sight]
        urgent = bool(near) or isinstance(outcome, FallbackNeeded)
        priority = Priority.HIGH if urgent else Priority.LOW
        if priority is not self._raised:
            self._raise(priority, f"{_cause(diagnosis, standing, outcome)}; {near[0] if near else _FAR}")

    def _nearest(self, told: Foreseen) -> tuple[str, float]:
        """The hard limit that is reached first, and how soon at the soonest [s]."""
        first = next(r for r in told.reached if r.limit in self._hard)
        return first.limit, max(first.earliest_s - (self._scene.seen_s - told.from_s), 0.0)

    def _told(self, told: Foreseen, when: str) -> str:
        limit, left_s = self._nearest(told)
        return f"{when}, {limit} trips in {left_s:.0f} s at the soonest"

    def _raise(self, priority: Priority, cause: str) -> None:
        now_s = self._scene.seen_s
        self._inherit()
        if self._raised is not None:
            self._scene.settle(ALARM)
        elif now_s - self._returned_s < self._longest_s:
            self._gone_s = min(2.0 * self._gone_s, self._longest_s)
        else:
            self._gone_s = self._least_s
        self._raised = priority
        self._scene.alarm(ALARM, cause, priority)

    def _settle(self) -> None:
        self._inherit()
        if self._raised is not None:
            self._scene.settle(ALARM)
            self._raised, self._returned_s = None, self._scene.seen_s

    def _inherit(self) -> None:
        """Whoever thought before may have left an alarm behind, which would keep one of another priority from view."""
        if not self._begun:
            self._begun = True
            self._scene.settle(ALARM)

    def _forget(self) -> None:
        """Nothing stands any more: what comes next is told from its beginning."""
        self._noticed, self._rules, self._said = {}, frozenset(), set()
        self._open, self._held = frozenset(), False


def _cause(diagnosis: Diagnosis, standing: Sequence[Symptom], outcome: Resolution) -> str:
    """What the alarm says: which symptoms, since when, what it may be, and what is done."""
    since_s = min(s.at_s for s in standing)
    names = ", ".join(s.rule for s in standing)
    told = [f"{100.0 * b.probability:.0f} % {_name(b.name)}" for b in by_fault_set(diagnosis.hypotheses)[:_MOST]]
    done = "the plant is left as it is and looked at again"
    if isinstance(outcome, Released):
        done = "what was released is followed"
    elif isinstance(outcome, FallbackNeeded):
        done = "the fallback is asked for"
    return f"nothing explains {names} since {since_s:.10g} s; it may be {', '.join(told)}; {done}"


def _name(name: str) -> str:
    return {"none": "nothing", SOMETHING_ELSE: "something else"}.get(name, name)
