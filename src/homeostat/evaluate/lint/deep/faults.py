"""Per fault: is it noticed and in what time, what else looks the same, which limit it violates, is there an answer?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from homeostat.domain.diagnosis import FaultMode, SymptomRule
from homeostat.domain.lasting import lasting
from homeostat.domain.plant.description import Relation
from homeostat.domain.plant.tag import Role
from homeostat.evaluate.lint.deep.alone import alone
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.beyond import beyond
from homeostat.evaluate.lint.deep.contract import of_model
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.deep.emptied import emptied
from homeostat.evaluate.lint.deep.following import batch_of, moments
from homeostat.evaluate.lint.deep.priced import unnoticed
from homeostat.evaluate.lint.deep.symptoms import Shown, first_symptoms
from homeostat.evaluate.lint.deep.thinking import too_little
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.process.batch import Batch, ProcessError, simulate
from homeostat.process.types import Table
from homeostat.twin.history import Window

TICKS: Final = 60
"""For how many ticks it is tried whether a fault does anything."""
ALIKE: Final = 1.0
"""Standard deviations of noise by which the courses of two faults differ that nobody tells apart [1]."""
NOISE: Final = 1.3
"""Multiple of what a symptom shows without a fault up to which it shows nothing of one [1]."""
_UNSEEN: Final = (
    "lower the threshold (symptoms.csv), state a symptom that shows it, or leave out a fault that does not matter "
    "(omitted.csv)"
)


@dataclass(frozen=True, slots=True)
class Outlook:
    """What comes of one fault at its nominal severity while nobody acts."""

    fault: str
    """Its name."""
    noticed_s: float | None
    """Seconds after its onset at which a symptom that indicates it is confirmed; None for never."""
    symptoms: tuple[str, ...]
    """Symptoms that it shows, in the order in which they come."""
    violates: str
    """Hard limit that it violates first; empty for none."""
    violated_s: float | None
    """Seconds after its onset at which it does."""
    alike: tuple[str, ...]
    """Faults that look the same at their nominal severities."""
    answers: tuple[str, ...]
    """States in which a recovery may end from where the plant is; without one there is the fallback alone."""


def faults(bench: Bench) -> Iterator[Finding | Outlook]:
    """Findings about faults and symptoms, and an outlook for each fault."""
    d, shown = bench.plant.description, dict[str, dict[str, Shown]]()
    for fault in d.faults:
        course = bench.faulty(fault, fault.severity_nominal)
        if finding := _acts(bench, fault, course):
            yield finding
            continue
        noisy = bench.faulty(fault, fault.severity_nominal, noise=1.0)
        shown[fault.name] = {rule.name: s for rule, s in first_symptoms(bench, noisy, bench.onset_s).items()}
        yield from _noticed(bench, fault, shown[fault.name])
    same = {pair: _apart(bench, *pair) <= ALIKE for pair in combinations(sorted(shown), 2)}
    for fault in d.faults:
        if fault.name in shown:
            alike = tuple(n for p, like in same.items() if like and fault.name in p for n in p if n != fault.name)
            outlook = _outlook(bench, fault, shown[fault.name], alike)
            yield outlook
            yield from too_little(bench, outlook)
    yield from (_torn(bench, *pair) for pair, like in same.items() if like and _answers_differ(bench, *pair))
    yield from _silent(bench, shown)
    yield from _dead_ends(bench)
    yield from emptied(bench)
    yield from alone(bench)
    yield from beyond(bench)
    yield from unnoticed(bench, shown)


def _acts(bench: Bench, fault: FaultMode, course: Course) -> Finding | None:
    """The fault changes something, and nothing before it begins."""
    length = min(course.truth.times_s.size, bench.quiet.truth.times_s.size)
    before = course.truth.times_s[:length] < bench.onset_s
    acts = False
    for name, values in course.truth.signals.items():
        off = values[0, :length] != bench.quiet.truth.signals[name][0, :length]
        off &= ~(np.isnan(values[0, :length]) & np.isnan(bench.quiet.truth.signals[name][0, :length]))
        if (off & before).any():
            what = f"{fault.name!r} changes {name!r} before it begins at {bench.onset_s:g} s"
            return of_model(bench, "faults", "kernel", what, "let it act from its onset on")
        acts = acts or bool(off.any()) or course.broke != ""
    read = any(_differs(course, bench.quiet, s.tag.name, length) for s in bench.plant.description.signals)
    if acts or read:
        return None
    place = bench.places.row("faults", id=fault.name)
    size = amount(fault.severity_nominal, fault.severity_unit, 6)
    what = f"{fault.name!r} at its nominal severity {size} changes nothing"
    if _can_act(bench, fault):
        what += f" in the plant's own course from {bench.onset_s:g} s on, so nobody can notice it there"
        return Finding(Severity.NOTE, "faults", place, what, "nothing, or begin it elsewhere (onset_s of [run])")
    return Finding(Severity.ERROR, "faults", place, what, "give the model its equation, or remove the fault")


def _can_act(bench: Bench, fault: FaultMode) -> bool:
    """Whether the fault changes the plant at some moment, whatever is commanded then."""
    model, d = bench.plant.model, bench.plant.description
    column = model.faults.index(fault.name)
    commanded = [s for s in d.signals if s.tag.role is Role.MV and s.variable in model.inputs]
    for moment in moments(bench):
        for end in ("low", "high", None):
            inputs = np.tile(moment.window.inputs[-1], (TICKS, 1))
            for signal in commanded if end else ():
                inputs[:, model.inputs.index(signal.variable)] = getattr(signal.tag.range, str(end))
            batch = batch_of(bench, Window(moment.window.end_s, {}, inputs), moment.state, moment.window.end_s)
            severity, onset_s = batch.severity.copy(), batch.onset_s.copy()
            severity[0, column], onset_s[0, column] = fault.severity_nominal, 0.0
            faulty = replace(batch, severity=severity, onset_s=onset_s)
            if not np.array_equal(_end(bench, batch), _end(bench, faulty), equal_nan=True):
                return True
    return False


def _end(bench: Bench, batch: Batch) -> Table:
    try:
        return simulate(bench.plant.model.kernel, batch).state
    except ProcessError:
        return np.full_like(batch.state, np.inf)


def _differs(course: Course, other: Course, tag: str, length: int) -> bool:
    return not np.array_equal(course.read(tag)[:length], other.read(tag)[:length], equal_nan=True)


def _noticed(bench: Bench, fault: FaultMode, shown: dict[str, Shown]) -> Iterator[Finding]:
    """Some symptom that indicates the fault is confirmed."""
    rules = {rule.name: rule for rule in bench.plant.description.symptom_rules}
    confirmed = [name for name, each in shown.items() if each.confirmed_s is not None]
    if any(fault.name in rules[name].faults for name in confirmed):
        return
    size = f"{fault.name!r} at its nominal severity {amount(fault.severity_nominal, fault.severity_unit, 6)}"
    own = [name for name in shown if fault.name in rules[name].faults]
    nearest = max(own, key=lambda name: shown[name].largest)
    if confirmed:
        what = f"{size} shows {', '.join(sorted(confirmed))}, and none of them indicates it"
        place = bench.places.row("symptom_faults", fault=fault.name)
        yield Finding(Severity.ERROR, "faults", place, what, "add a row for a symptom that it shows")
    else:
        most = shown[nearest].largest
        near = f"{nearest!r} comes to {most:.2g} times its threshold, {shown[nearest].threshold:.4g}"
        if most <= NOISE * _without(bench)[nearest]:
            near = f"none of the symptoms that indicate it shows more than without a fault, {', '.join(sorted(own))}"
        what = f"nothing notices {size} in {lasting(bench.plant.end_s - bench.onset_s)}: {near}"
        place = bench.places.row("faults", id=fault.name)
        yield Finding(Severity.ERROR, "faults", place, what, _UNSEEN)


def _without(bench: Bench) -> dict[str, float]:
    """Symptom -> how far it goes on a plant without a fault, in thresholds."""

    def make() -> dict[str, float]:
        found = first_symptoms(bench, bench.noisy[0], bench.onset_s)
        return {rule.name: shown.largest for rule, shown in found.items()}

    return bench.kept("symptoms without a fault", make)


def _outlook(bench: Bench, fault: FaultMode, shown: dict[str, Shown], alike: tuple[str, ...]) -> Outlook:
    rules = {rule.name: rule for rule in bench.plant.description.symptom_rules}
    confirmed = sorted((s.confirmed_s, name) for name, s in shown.items() if s.confirmed_s is not None)
    own = [at_s for at_s, name in confirmed if fault.name in rules[name].faults]
    course, found = bench.faulty(fault, fault.severity_nominal), list[tuple[float, str]]()
    for limit in bench.plant.description.limits.hard:
        outside = course.outside(limit) & course.after(bench.onset_s)
        if outside.any():
            found.append((float(course.truth.times_s[np.argmax(outside)]) - bench.onset_s, limit.name))
    violated_s, violates = min(found, default=(None, ""))
    return Outlook(
        fault=fault.name,
        noticed_s=own[0] - bench.onset_s if own else None,
        symptoms=tuple(name for _, name in confirmed),
        violates=violates,
        violated_s=violated_s,
        alike=alike,
        answers=open_targets(bench, fault),
    )


def open_targets(bench: Bench, fault: FaultMode) -> tuple[str, ...]:
    """Recovery targets to which some path leads from the state in which the fault begins, guards apart."""
    machine = bench.plant.description.machine
    blocked = () if fault.disables is None else (fault.disables,)
    return tuple(sorted(_targets(bench, blocked) - {""})) if machine.recovery_event else ()


def _targets(bench: Bench, blocked: tuple[str, ...]) -> set[str]:
    """Recovery targets that decisions lead to from where the plant is when a fault begins, whatever guards say."""
    machine, event = bench.plant.description.machine, bench.plant.description.machine.recovery_event
    reached, ends = {state_at(bench, bench.onset_s)}, set[str]()
    for _ in machine.states:
        for t in machine.transitions:
            target = machine.state(t.target)
            if t.source in reached and (t.event == event or not t.on_decision) and not target.requires & set(blocked):
                reached.add(t.target)
                if target.recovery_target and t.source != t.target:
                    ends.add(t.target)
    return ends


def state_at(bench: Bench, at_s: float) -> str:
    """State in which the fault-free plant is at ``at_s`` [s]."""
    entered = [name for name, from_s in bench.quiet.states if from_s <= at_s]
    return entered[-1] if entered else bench.plant.description.machine.initial.name


def _apart(bench: Bench, one: str, other: str) -> float:
    """By how much the readings of two faults differ at most, in standard deviations of their noise."""
    d, worst = bench.plant.description, 0.0
    first, second = d.fault(one), d.fault(other)
    courses = [bench.faulty(first, first.severity_nominal), bench.faulty(second, second.severity_nominal)]
    length = min(len(course.seen) for course in courses)
    for signal in d.signals:
        noise = bench.noise[signal.tag.name]
        if signal.relation is Relation.MEASURES and noise > 0.0:
            off = courses[0].read(signal.tag.name)[:length] - courses[1].read(signal.tag.name)[:length]
            worst = max(worst, float(np.nanmax(np.abs(off), initial=0.0)) / noise)
    return worst


def _answers_differ(bench: Bench, one: str, other: str) -> bool:
    d = bench.plant.description
    return open_targets(bench, d.fault(one)) != open_targets(bench, d.fault(other))


def _torn(bench: Bench, one: str, other: str) -> Finding:
    ways = [f"{name!r} {' or '.join(open_targets(bench, bench.plant.description.fault(name))) or 'the fallback alone'}"
            for name in (one, other)]  # fmt: skip
    what = (
        f"{one!r} and {other!r} cannot be told apart by any instrument at their nominal severities, and their answers "
        f"differ: {' and '.join(ways)}"
    )
    place = bench.places.row("faults", id=other)
    remedy = "give both the same 'disables' and state requirements, or add an instrument that tells them apart"
    return Finding(Severity.WARNING, "faults", place, what, remedy)


def _silent(bench: Bench, shown: dict[str, dict[str, Shown]]) -> Iterator[Finding]:
    """Symptoms that none of their faults shows at its nominal severity."""
    for rule in bench.plant.description.symptom_rules:
        known = [name for name in rule.faults if name in shown]
        if not known or any(shown[name][rule.name].confirmed_s is not None for name in known):
            continue
        yield _never(bench, rule, known, shown)


def _never(bench: Bench, rule: SymptomRule, known: list[str], shown: dict[str, dict[str, Shown]]) -> Finding:
    """What to say of a symptom that none of its faults shows."""
    place, side = bench.places.row("symptoms", id=rule.name), rule.direction.value
    rules = bench.plant.description.symptom_rules
    others = [r for r in rules if r.feature == rule.feature and r.direction != rule.direction]  # they see that side
    opposite = max(shown[name][rule.name].opposite for name in known)
    named = f"{', '.join(known[:3])}{' ...' if known[3:] else ''}"
    what = f"none of the faults that it indicates ({named}) shows it at its nominal severity"
    if opposite >= 1.0 and not others:
        what += f": its feature goes to {opposite:.2g} times the threshold, but not to the side {side!r}"
        return Finding(Severity.ERROR, "faults", place, what, "turn its direction round")
    most = max(shown[name][rule.name].largest for name in known)
    what += f": its feature comes to {most:.2g} times the threshold"
    return Finding(Severity.NOTE, "faults", place, what, "nothing, where it is there for what no table names")


def _dead_ends(bench: Bench) -> Iterator[Finding]:
    """From where faults begin there is some recovery, if any exists in the plant."""
    machine, state = bench.plant.description.machine, state_at(bench, bench.onset_s)
    if not machine.recovery_event or _targets(bench, ()):
        return
    place = bench.places.row("states", id=state)
    row = next((t.name for t in machine.transitions if t.source == state and t.on_decision), "")
    what = (
        f"no transition on {machine.recovery_event!r}, the event on which recoveries are decided, leads from {state!r} "
        f"to a recovery target, so every fault ends in the fallback, and {row!r} has another event"
    )
    remedy = f"give {row!r} the event ({bench.places.row('transitions', id=row)})"
    yield Finding(Severity.ERROR, "faults", place, what, remedy)
