"""An episode: from the first symptom to its end, read from the record of a run as it was at one moment."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

from homeostat.console.card.card import Acted, Card, Choice, Explanation, LetBe, Refusal, Seen
from homeostat.console.card.course import standings
from homeostat.console.card.foresight import alone
from homeostat.console.card.margins import predicted_margins
from homeostat.console.card.proposal import moves, proposal, state_label
from homeostat.console.card.standing import current, fallen
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultProbability, Symptom, by_fault_set
from homeostat.domain.events.deviations import Deviated, Missed, Strayed
from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.people import PersonHeard
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    Diagnosed,
    Doubted,
    FaultsEnded,
    GaveUp,
    NoActionTaken,
    NotAsked,
    Noticed,
    ReleasedActions,
    ReleaseRefused,
    Remarked,
    SymptomsCleared,
)
from homeostat.domain.events.trips import FallbackActivated, FallbackStands, Tripped
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.mode import Verb
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.remark import RemarkKind
from homeostat.domain.request import RequestStatus
from homeostat.journal.memory import Entry
from homeostat.record.run_record import RunRecord
from homeostat.record.story.apart import told_apart
from homeostat.record.story.plain import plainly
from homeostat.record.story.wording import every, lasting, who, worst

E = TypeVar("E")
_LEAST = 0.005
"""Explanations below this probability are not shown [1]."""
_SENT_S: Final = 5.0
"""How long before its event a fallback may have been sent [s]."""
_MOST = 6
"""Most refusals, fallbacks and notes that are shown."""


@dataclass(frozen=True, slots=True)
class Episode:
    """The events of one episode, and what came before."""

    before: tuple[Entry, ...]
    """Everything before it."""
    entries: tuple[Entry, ...]
    """Its own events, the first one first."""
    over_s: float | None
    """When it ended [s]; None while it lasts."""


def last_episode(entries: Sequence[Entry]) -> Episode | None:
    """The last episode in ``entries``; None where nothing was ever seen."""
    begin = end = None
    for number, entry in enumerate(entries):
        if isinstance(entry.event, FaultsEnded | SymptomsCleared):
            end = number if begin is not None and end is None else end
        elif _begins(entry) and (begin is None or end is not None):
            begin, end = number, None
    if begin is None:
        return None
    over_s = None if end is None else entries[end].at_s
    return Episode(tuple(entries[:begin]), tuple(entries[begin:]), over_s)


def first_seen_s(entries: Iterable[Entry]) -> float | None:
    """When the first episode began [s]; None where nothing was ever seen."""
    return next((entry.at_s for entry in entries if _begins(entry)), None)


def first_decided_s(entries: Iterable[Entry]) -> float | None:
    """When it was first decided what to do about what is wrong [s]; None where it never was.

    That nothing is done yet counts where nothing else was ever decided.
    """
    seen, alone_s = False, None
    for entry in entries:
        seen = seen or _begins(entry)
        match entry.event:
            case FallbackActivated():
                return entry.at_s
            case Compared(chosen=chosen) if seen and chosen:
                return entry.at_s
            case Compared() | NoActionTaken() if seen and alone_s is None:
                alone_s = entry.at_s
    return alone_s


def _begins(entry: Entry) -> bool:
    match entry.event:
        case Noticed(symptoms=symptoms):
            return bool(symptoms)
        case Diagnosed(hypotheses=hypotheses):
            return any(h.faults for h in hypotheses)
        case Deviated() | Strayed() | Missed() | Tripped() | FallbackActivated():
            return True
    return False


def card(record: RunRecord, plant: KnownPlant, readings: Readings | None, at_s: float) -> Card | None:
    """The card at ``at_s`` [s], up to which ``record`` goes; None where nothing was ever seen."""
    episode = last_episode(record.entries)
    if episode is None:
        return None
    known = plant.description
    diagnosed: tuple[float, Diagnosed | Doubted] | None = _last(episode, Diagnosed, Doubted)
    held = [] if diagnosed is None else [h for h in by_fault_set(diagnosed[1].hypotheses) if h.probability >= _LEAST]
    seen = _seen(episode, known)
    explanations = tuple(_explanation(h, seen, known) for h in held)
    compared, stood = _last(episode, Compared), standings(episode.entries)
    # Of a doubt the symptoms are what is sure: that probably nothing is wrong is no headline over what stands.
    best = None if diagnosed is None or isinstance(diagnosed[1], Doubted) else next(iter(explanations), None)
    return Card(
        since_s=episode.entries[0].at_s,
        over_s=episode.over_s,
        headline=best.text if best else "; ".join(s.text for s in seen) or _reason(episode),
        probability=best.probability if best else None,
        diagnosed_s=None if diagnosed is None else diagnosed[0],
        seen=seen,
        explanations=explanations,
        apart=told_apart(held, known),
        alone=_alone(compared, known),
        foresight=alone(episode.entries, known),
        proposal=proposal(current(stood), record, episode.entries, plant, (readings, at_s)),
        fallen=proposal(fallen(stood), record, episode.entries, plant, (readings, at_s)),
        released_s=max((one.released_s for one in stood if one.released_s is not None), default=None),
        let_be=_let_be(episode, known),
        currency="" if compared is None else compared[1].currency,
        compared_s=None if compared is None else compared[0],
        choices=() if compared is None else tuple(_choices(compared[1], known)),
        refused=tuple(_refusals(episode, known))[::-1][:_MOST],
        acted=tuple(_acted(episode, known))[::-1][:_MOST],
        notes=tuple(_notes(episode))[-_MOST:],
    )


def _last(episode: Episode, *kinds: type[E]) -> tuple[float, E] | None:
    """The last event of these classes, after its time [s]."""
    for entry in reversed(episode.entries):
        if isinstance(entry.event, kinds):
            return entry.at_s, entry.event
    return None


def _reason(episode: Episode) -> str:
    """What an episode without diagnosis and symptoms is about."""
    match episode.entries[0].event:
        case (
            Deviated(reason=reason)
            | Strayed(reason=reason)
            | Missed(reason=reason)
            | Tripped(reason=reason)
            | FallbackActivated(reason=reason)
        ):
            return plainly(reason)
    return "something is wrong"


def _seen(episode: Episode, plant: PlantDescription) -> tuple[Seen, ...]:
    """The symptoms of an episode, each once, as it was confirmed last."""
    rules = {rule.name: rule for rule in plant.symptom_rules}
    units = {feature.name: feature.unit for feature in plant.features}
    found: dict[str, Symptom | None] = {}
    for entry in episode.entries:
        match entry.event:
            case Noticed(symptoms=names):
                found = dict.fromkeys(names) | found
            case Diagnosed(symptoms=symptoms) | Doubted(symptoms=symptoms):
                found |= {symptom.rule: symptom for symptom in symptoms}
    shown = []
    for name, symptom in found.items():
        rule = rules.get(name)
        feature = "" if rule is None else rule.feature
        text = name if rule is None else rule.description
        one = Seen(name, text, None, None, None, None, units.get(feature, ""), feature)
        if symptom is not None:
            one = replace(one, at_s=symptom.at_s, value=symptom.value, threshold=symptom.threshold)
            one = replace(one, times=symptom.severity)
        shown.append(one)
    return tuple(shown)


def _explanation(held: FaultProbability, seen: Sequence[Seen], plant: PlantDescription) -> Explanation:
    """What speaks for an explanation and against it is what the tables say that symptoms indicate."""
    names, stands = {f.fault for f in held.faults}, {symptom.rule for symptom in seen}
    supports: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    if held.faults and SOMETHING_ELSE not in names and names <= {fault.name for fault in plant.faults}:
        indicating = [rule for rule in plant.symptom_rules if names & {*rule.faults}]
        supports = tuple(rule.description for rule in indicating if rule.name in stands)
        lacks = tuple(rule.description for rule in indicating if rule.name not in stands)
        others = tuple(s.text for s in seen if s.rule not in {rule.name for rule in indicating})
    modes = {mode.name: mode for mode in plant.fault_modes}
    components = {modes[name].component for name in names if name in modes}
    text, sized = worded(held, plant)
    where = ", ".join(sorted(components))
    return Explanation(held.name, text, sized, held.probability, where, supports, lacks, others)


def worded(held: FaultProbability, plant: PlantDescription) -> tuple[str, str]:
    """An explanation in the operator's words, and its size; by its names where the plant does not know them."""
    if not held.faults:
        return "Nothing is wrong", ""
    if held.faults[0].fault == SOMETHING_ELSE:
        return "Something else, which is in no table", ""
    modes = {mode.name: mode for mode in plant.fault_modes}
    if any(state.fault not in modes for state in held.faults):
        return held.name, ""
    labels = " + ".join(modes[state.fault].label or state.fault for state in held.faults)
    sized = [s for s in held.faults if not modes[s.fault].sizeless]
    sizes = [f"{s.severity:.3g}{_after(modes[s.fault].severity_unit)}{every(s)}" for s in sized]
    between = "" if held.between is None else f" ({held.between[0]:.3g} to {held.between[1]:.3g})"
    return labels, " + ".join(sizes) + between


def _after(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _alone(compared: tuple[float, Compared] | None, plant: PlantDescription) -> str:
    """What follows if nothing is done, as the comparison says."""
    if compared is None:
        return ""
    left = next((a for a in compared[1].alternatives if a.kind is AlternativeKind.LEAVE), None)
    if left is None:
        return ""
    return plainly(left.refused) or f"Every limit is kept in {state_label(left.name, plant)!r}."


def _let_be(episode: Episode, plant: PlantDescription) -> LetBe | None:
    """That the plant was left as it is, where that was judged last."""
    for entry in reversed(episode.entries):
        match entry.event:
            case NoActionTaken() as left:
                margins = predicted_margins(left.findings, plant)
                checks = len(left.findings) - len(margins)
                told = left.min_margin, left.members, margins, checks
                return LetBe(entry.at_s, state_label(left.state, plant), *told)
            case ReleasedActions() | FallbackActivated() | Compared() | GaveUp() | Tripped():
                return None
    return None


def _choices(compared: Compared, plant: PlantDescription) -> Iterator[Choice]:
    """The list; of those with the same commands the cheapest that may be done is what was chosen."""
    those = (a for a in compared.alternatives if compared.chosen and a.admitted and a.digest == compared.chosen)
    chosen = next(those, None)
    for each in compared.alternatives:
        yield _choice(each, each is chosen, plant)


def _choice(alternative: Alternative, chosen: bool, plant: PlantDescription) -> Choice:
    states = [state_label(name, plant) for name in alternative.name.split(" > ")]
    end, seconds = states[-1], f"{alternative.seconds:g} s"
    what = {
        AlternativeKind.LEAVE: "Leave alone",
        AlternativeKind.WAIT: f"Wait {seconds}, then {end}",
        AlternativeKind.HOLD: f"Hold {end} for {seconds}",
        AlternativeKind.TEST: f"Test {end} for {seconds}",
        AlternativeKind.FALLBACK: f"Fall back: {end}",
    }.get(alternative.kind, f"Go to {end}")
    by = who(alternative.proposer, alternative.polished) if alternative.proposer else ""
    counted = ((i.name, i.amount) for i in alternative.cost.items if abs(i.amount) > 0.05)
    items = sorted(counted, key=lambda i: -abs(i[1]))[:4]
    named = alternative.kind.value, by, alternative.cost.total, tuple(items), plainly(alternative.refused)
    return Choice(what, *named, chosen, alternative.certificate)


def _refusals(episode: Episode, plant: PlantDescription) -> Iterator[Refusal]:
    """What was refused in an episode, in order; what says the same again is left out."""
    told: set[tuple[str, str]] = set()
    for entry in episode.entries:
        match entry.event:
            case Attempted(approved=False) as tried:
                path = " > ".join(state_label(name, plant) for name in tried.path)
                what = f"{lasting(tried) or path or 'a proposal'}, by {who(tried.proposer, tried.polished)}"
                violated = [f for f in tried.findings if not f.satisfied]
                why = "; ".join(f.message for f in violated[:2]) or worst(tried.findings, plant.scales)
            case ReleaseRefused() as refused:
                what, why = f"the release of what {refused.proposer} proposed", refused.reason
            case RequestAnswered(status=status, check=check) as answered if status in _NOT:
                what = f"the request of {answered.proposer or 'recovery'}, by the guard"
                why = f"{answered.reason or status}{f' ({check})' if check else ''}"
            case GaveUp(proposer=proposer, reason=reason):
                what, why = f"{proposer} gave up", reason
            case NotAsked() as unasked:
                what, why = f"{unasked.proposer} was not waited for", unasked.reason
            case _:
                continue
        if (what, why) not in told:
            told.add((what, why))
            yield Refusal(entry.at_s, what, plainly(why))


_NOT = (RequestStatus.REFUSED, RequestStatus.FAILED, RequestStatus.WITHDRAWN)


def _acted(episode: Episode, plant: PlantDescription) -> Iterator[Acted]:
    """Fallbacks that acted in an episode, in order."""
    every = (*episode.before, *episode.entries)
    for number, entry in enumerate(episode.entries, 1):
        if isinstance(event := entry.event, FallbackActivated):
            written = moves(event.commands, _before_fallback(every, entry), plant)
            stands = _stood(event.strategy, episode.entries[number:])
            yield Acted(entry.at_s, event.strategy, plainly(event.reason), written, stands)


def _stood(strategy: str, later: Iterable[Entry]) -> bool:
    """Whether the plant was read to hold a fallback that has acted, ``later`` and before it acted once more."""
    for entry in later:
        match entry.event:
            case FallbackStands(strategy=told) if told == strategy:
                return True
            case FallbackActivated(strategy=told) if told == strategy:
                return False
    return False


def _before_fallback(entries: Sequence[Entry], acted: Entry) -> Sequence[Entry]:
    """Everything before a fallback was sent, of which its event tells afterwards."""
    end = next(n for n, entry in enumerate(entries) if entry is acted)
    while end and entries[end - 1].at_s >= acted.at_s - _SENT_S:
        end -= 1
    sent = (
        n
        for n, entry in enumerate(entries[end:], start=end)
        if entry is acted or (isinstance(entry.event, WriteIntended) and entry.event.cause is Cause.FALLBACK)
    )
    return entries[: next(sent)]


def _notes(episode: Episode) -> Iterator[str]:
    """What people noted for proposers, and what these said for people to read, each once."""
    heard = [e.event for e in episode.entries if isinstance(e.event, PersonHeard)]
    yield from (f"note of {h.person}: {h.reason}" for h in heard if h.done and h.verb == Verb.NOTE.value)
    said = [e.event for e in episode.entries if isinstance(e.event, Remarked)]
    notes = [r for r in said if r.remark is not RemarkKind.REASONING]
    about = (f"{r.remark.value} of {r.proposer}{f' about {r.about}' if r.about else ''}: {r.text}" for r in notes)
    yield from dict.fromkeys(about)
