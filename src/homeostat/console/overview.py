"""One line that says where a plant stands."""

from dataclasses import dataclass

from homeostat.console.card.card import Card
from homeostat.console.card.proposal import ADVISED, state_label
from homeostat.console.situation import Situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.mode import Mode
from homeostat.domain.plant.description import PlantDescription
from homeostat.guard.settings import GuardSettings

_ORDER = tuple(Priority)
_NOBODY_WRITES = frozenset(mode.value for mode in Mode if not mode.writes)
_THINKS_S = 60.0
"""After the last sign that recovery works on an answer, how long it is said to do so [s]."""


@dataclass(frozen=True, slots=True)
class RaisedAlarm:
    """One alarm that stands."""

    alarm: str
    """Identifier."""
    cause: str
    """One sentence."""
    priority: str
    """How soon a person must respond."""
    since_s: float
    """When it was raised [s]."""
    acknowledged: bool
    """Whether a person has seen it."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A request that waits for a person's yes."""

    request: str
    """Identifier."""
    digest: str
    """Digest of what would be written."""
    proposer: str
    """Who proposed it."""
    since_s: float
    """Since when it waits [s]."""
    void_s: float
    """When it is void at the latest [s]."""


@dataclass(frozen=True, slots=True)
class Overview:
    """What an operator reads first."""

    mode: str
    """Mode that is in force."""
    requested: str
    """Mode that was asked for."""
    shed: str
    """Why the plant does not take commands; empty where it does."""
    state: str
    """State of the machine, in the operator's words."""
    level: str
    """How abnormal it is: ``normal``, ``low``, ``medium``, ``high`` or ``critical``."""
    alarm: str
    """The alarm of the episode in one line; empty where nothing is wrong."""
    alarm_s: float | None
    """Since when it stands [s]."""
    folded: tuple[RaisedAlarm, ...]
    """The alarms beneath it, the most urgent first."""
    act_by_s: float | None
    """When a fallback acts unless something was released [s]; None for no such time."""
    fallback: str
    """The fallback that would act; empty for none."""
    waiting: str
    """What is waited for."""
    latched: str
    """Why a person must reset the latch; empty where it is not latched."""
    out_of_service: tuple[tuple[str, str], ...]
    """Tags that may not be written, each with why."""
    shelved: int
    """Number of alarms that are out of sight."""
    finished: str
    """How the run ended; empty while it goes on."""
    offers: tuple[Offer, ...]
    """Requests that wait for a person, the oldest first."""


def overview(now: Situation, card: Card | None, plant: PlantDescription, at_s: float) -> Overview:
    """The line at ``at_s`` [s], from where the run stands and its card."""
    folded = sorted(
        (
            RaisedAlarm(a.alarm, a.cause, a.priority.value, since_s, seen)
            for a, since_s, seen in now.alarms.values()
            if a.alarm not in now.shelved
        ),
        key=lambda raised: (-_ORDER.index(Priority(raised.priority)), raised.since_s),
    )
    open_card = card if card is not None and card.over_s is None else None
    return Overview(
        mode=now.mode,
        requested=now.requested,
        shed=now.lease_lost,
        state=state_label(now.state, plant) or state_label(plant.machine.initial.name, plant),
        level=_level(now, open_card, folded),
        alarm=_alarm(open_card, folded),
        alarm_s=open_card.since_s if open_card else folded[0].since_s if folded else None,
        folded=tuple(folded),
        act_by_s=now.act_by_s,
        fallback=now.armed[0] if now.armed and not now.latched else "",
        waiting=_waiting(now, open_card, at_s),
        latched=now.latched,
        out_of_service=tuple(sorted(now.out_of_service.items())),
        shelved=len(now.shelved & now.alarms.keys()),
        finished=now.finished.replace("_", " "),
        offers=tuple(
            Offer(request, said.digest, said.proposer, since_s, void_s(said, since_s, plant))
            for request, (said, since_s) in now.offered.items()
        ),
    )


def void_s(offered: RequestAnswered, since_s: float, plant: PlantDescription) -> float:
    """When a request that was ``offered`` then is void [s]; as usual where the record is too old to say."""
    usual_s = since_s + GuardSettings().for_ticks(plant.timing.tick_s).person_s
    return usual_s if offered.void_s is None else offered.void_s


def _level(now: Situation, card: Card | None, folded: list[RaisedAlarm]) -> str:
    if now.latched or (card and card.acted):
        return Priority.CRITICAL.value
    least = [] if card is None else [Priority.HIGH if now.act_by_s is not None else Priority.MEDIUM]
    found = [*least, *(Priority(raised.priority) for raised in folded)]
    return max(found, key=_ORDER.index).value if found else "normal"


def _alarm(card: Card | None, folded: list[RaisedAlarm]) -> str:
    if card is not None:
        return card.headline
    return folded[0].cause if folded else ""


def _waiting(now: Situation, card: Card | None, at_s: float) -> str:
    """What happens next, and who has to do something for it."""
    if now.finished:
        return "nothing: the run has ended"
    if now.latched:
        return "a person: reset the latch"
    critical = any(alarm.priority is Priority.CRITICAL for alarm, _, _ in now.alarms.values())
    if critical and now.mode in _NOBODY_WRITES:
        return f"a person at the plant: in mode {now.mode!r} nothing is written"
    if now.offered:
        return "a person: approve or reject the proposal"
    if now.accepted:
        return "the plant: take what is being written"
    if now.waits is not None:
        waited, until_s = now.waits
        return f"{waited.follows} at {until_s:.0f} s: waiting costs less than acting now"
    if now.probe_s is not None and at_s < now.probe_s:
        return f"what the plant shows until {now.probe_s:.0f} s, which tells explanations apart"
    if now.thinking_s is not None and at_s - now.thinking_s <= _THINKS_S:
        return "recovery: it is working on an answer"
    proposal = None if card is None else card.proposal
    if proposal is not None and proposal.status == ADVISED and now.mode in _NOBODY_WRITES:
        return f"a person: in mode {now.mode!r} what is advised is not written"
    if proposal is not None and proposal.released_s is not None:
        return "the effect of what was released"
    return "nothing: the plant is watched"
