"""One line that says where a plant stands."""

from collections.abc import Collection
from dataclasses import dataclass

from homeostat.console.card.card import Card
from homeostat.console.card.proposal import state_label
from homeostat.console.outlook import NOTHING, Outlook, TimeLeft, Until, outlook, person_s, requested
from homeostat.console.situation import Situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.plant.description import PlantDescription
from homeostat.record.story.plain import plainly

_ORDER = tuple(Priority)


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
    left: TimeLeft
    """How long is left, and until what."""
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


def overview(
    now: Situation, card: Card | None, plant: PlantDescription, at_s: float, beyond: Collection[str] = ()
) -> Overview:
    """The line at ``at_s`` [s], from where the run stands, its card, and the limits ``beyond`` which readings are."""
    folded = sorted(
        (
            RaisedAlarm(a.alarm, plainly(a.cause), a.priority.value, since_s, seen)
            for a, since_s, seen in now.alarms.values()
            if a.alarm not in now.shelved
        ),
        key=lambda raised: (-_ORDER.index(Priority(raised.priority)), raised.since_s),
    )
    open_card = card if card is not None and card.over_s is None else None
    ahead = outlook(now, at_s, beyond, open_card is not None, plant)
    return Overview(
        mode=now.mode,
        requested=requested(now, at_s, plant),
        shed=now.lease_lost,
        state=state_label(now.state, plant) or state_label(plant.machine.initial.name, plant),
        level=ahead.level,
        alarm=_alarm(open_card, folded, ahead),
        alarm_s=open_card.since_s if open_card else folded[0].since_s if folded else None,
        folded=tuple(folded),
        left=ahead.left,
        fallback=now.armed[0] if now.armed and not now.latched else "",
        waiting=ahead.waiting,
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
    return since_s + person_s(plant) if offered.void_s is None else offered.void_s


def _alarm(card: Card | None, folded: list[RaisedAlarm], ahead: Outlook) -> str:
    if card is not None:
        return card.headline
    if folded:
        return folded[0].cause
    at_a_limit = ahead.left.until in (Until.BEYOND, Until.FALLBACK, Until.LIMIT, Until.PASSED)
    if at_a_limit:
        return "A hard limit is violated or foreseen to be"
    return "" if ahead.level == NOTHING else "What follows is not known"
