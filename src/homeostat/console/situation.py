"""Where a run stands at one moment: mode, state, targets, alarms, quality, what is waited for; a fold of its events."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import (
    Armed,
    GuardStarted,
    QualityChanged,
    RequestAnswered,
    SequenceLoaded,
    StartUpBegan,
    StartUpEnded,
    StateEntered,
    StepTaken,
    ThinkingEnded,
)
from homeostat.domain.events.people import (
    AlarmAcknowledged,
    AlarmRaised,
    AlarmReturned,
    AlarmShelved,
    AlarmUnshelved,
    ModeEntered,
    PersonHeard,
    ServiceChanged,
)
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    Concluded,
    Diagnosed,
    Doubted,
    FaultsEnded,
    GaveUp,
    NoActionTaken,
    Noticed,
    Probed,
    ReleasedActions,
    ReleaseRefused,
    SymptomsCleared,
    Waited,
)
from homeostat.domain.events.trips import (
    FallbackActivated,
    Latched,
    LatchReset,
    Shed,
    TripLifted,
    TripLiftEnded,
    Tripped,
)
from homeostat.domain.events.writes import LeaseLost, LeaseTried, TargetsHeld, WriteIntended
from homeostat.domain.mode import Verb
from homeostat.domain.recovery import Command
from homeostat.domain.request import RequestStatus
from homeostat.journal import Event, RunFinished, RunStarted
from homeostat.journal.memory import Entry
from homeostat.record.story.plain import plainly

_ON_THE_WAY = (RequestStatus.RECEIVED, RequestStatus.AUTHORISED, RequestStatus.VERIFIED)
"""What the guard says of a request that it has not answered yet."""
_NO_COMMANDS = frozenset({"heartbeat", "shed"})
"""Alarms that last as long as the plant takes no commands, once it was told so."""


@dataclass(slots=True)
class Situation:
    """What the events up to one moment leave true."""

    mode: str = ""
    """Mode that the guard stands in; empty before it says so."""
    requested: str = ""
    """Mode that was asked for last; the same as ``mode`` unless it was refused or is waited for."""
    requested_s: float | None = None
    """Since when it is waited for, because more people must order it [s]; None where it is not."""
    lease_lost: str = ""
    """Why the plant does not take commands; empty where it does."""
    latched: str = ""
    """Why nothing more is released until a person resets the latch; empty where it is not latched."""
    state: str = ""
    """State of the machine; empty before it is told."""
    started: bool = False
    """Whether start-up is over."""
    started_s: float | None = None
    """When it was over [s]; None while it lasts."""
    targets: dict[str, float | None] = field(default_factory=dict)
    """Writable tag -> target that it was last given; None for automatic."""
    quality: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Tag whose reading is not good -> its quality and why."""
    out_of_service: dict[str, str] = field(default_factory=dict)
    """Tag that the guard may not write -> why."""
    alarms: dict[str, tuple[AlarmRaised, float, bool]] = field(default_factory=dict)
    """Alarm that stands -> what it says, since when [s], and whether a person has seen it."""
    shelved: set[str] = field(default_factory=set)
    """Alarms that a person has taken out of sight for a time."""
    offered: dict[str, tuple[RequestAnswered, float]] = field(default_factory=dict)
    """Request that waits for a person's yes -> what the guard said, and since when [s]."""
    accepted: str = ""
    """Digest of what is on the way to the plant; empty for nothing."""
    armed: tuple[str, ...] = ()
    """Fallbacks in the order in which they would act."""
    act_by_s: float | None = None
    """When the first of them acts unless something was released [s]; None for no such time."""
    thinking_s: float | None = None
    """When recovery last showed that it works on an answer [s]; None where it has come to an end."""
    waits: tuple[Waited, float] | None = None
    """What is waited for, and until when [s]."""
    probe_s: float | None = None
    """Until when the plant is only looked at, to tell explanations apart [s]; None for no such time."""
    decided: str = ""
    """Digest of what recovery has chosen and the guard has not answered yet; empty for nothing."""
    advised: str = ""
    """Digest of what was advised last and nobody writes; empty for nothing."""
    lifted: set[str] = field(default_factory=set)
    """Limits whose reading is beyond them and does not count, because a diagnosis explains it."""
    outlook: Foreseen | None = None
    """What the twin says that will happen from here on; None where it has not looked ahead since something was done."""
    proposed: Foreseen | None = None
    """What it says that will happen with what was proposed last."""
    done: tuple[str, float] | None = None
    """What was done last, ``release`` or the name of a fallback, and when [s]; None for nothing."""
    finished: str = ""
    """How the run ended; empty while it goes on."""
    end_s: float | None = None
    """When the run is to end [s]; None where it does not say."""


def situation(entries: Iterable[Entry], before: Situation | None = None) -> Situation:
    """Where a run stands after ``entries``, which follow on where it stood ``before``; that stays as it is."""
    now = Situation() if before is None else _copied(before)
    for entry in entries:
        for take in (_of_guard, _of_people, _of_recovery, _ahead):
            take(now, entry.event, entry.at_s)
    return now


def _copied(before: Situation) -> Situation:
    return replace(
        before,
        targets=dict(before.targets),
        quality=dict(before.quality),
        out_of_service=dict(before.out_of_service),
        alarms=dict(before.alarms),
        shelved=set(before.shelved),
        offered=dict(before.offered),
        lifted=set(before.lifted),
    )


def _of_guard(now: Situation, event: Event, at_s: float) -> None:
    match event:
        case GuardStarted():
            now.mode, now.requested, now.finished = event.mode, event.mode, ""
            now.shelved, now.alarms, now.lease_lost = set(), {}, ""  # and raises what lasts once more
            now.quality = {}  # and tells once more which reading is not good
            now.offered, now.accepted, now.advised = {}, "", ""  # a guard that begins again knows of no request
            _drop(now)
        case StartUpBegan():
            now.started, now.started_s = False, None
        case StartUpEnded():
            now.started, now.started_s = True, at_s
        case StateEntered() | StepTaken() | SequenceLoaded():
            now.state = event.state or now.state
        case TargetsHeld():
            now.targets |= event.targets
        case WriteIntended():
            _aim(now, event.commands)
        case QualityChanged():
            now.quality.pop(event.tag, None)
            if event.quality != "good":
                now.quality[event.tag] = (event.quality, event.reason)
        case RequestAnswered():
            now.offered.pop(event.request, None)
            if event.status == RequestStatus.OFFERED:
                now.offered[event.request] = (event, at_s)
            now.accepted = event.digest if event.status == RequestStatus.ACCEPTED else ""
            if event.status == RequestStatus.ADVISED:
                now.thinking_s, now.advised = None, event.digest
            if event.status not in _ON_THE_WAY:
                now.decided = ""
        case Armed():
            now.armed, now.act_by_s = event.strategies, event.act_by_s
        case LeaseLost() | Shed():
            now.lease_lost = event.reason
        case LeaseTried() if event.given:
            now.lease_lost = ""
        case ThinkingEnded():
            _drop(now)  # what it was about to say is lost


def _of_people(now: Situation, event: Event, at_s: float) -> None:
    match event:
        case ModeEntered():
            now.mode = now.requested = event.mode
            now.thinking_s, now.decided, now.advised = None, "", ""  # what was thought under another mode is dropped
        case PersonHeard() if event.verb == Verb.MODE.value:
            now.requested = event.subject if event.done or event.missing else now.mode
            now.requested_s = at_s if event.missing else None
        case ServiceChanged():
            now.out_of_service.pop(event.tag, None)
            if not event.in_service:
                now.out_of_service[event.tag] = event.reason
        case AlarmRaised():
            now.alarms[event.alarm] = (event, at_s, False)
        case AlarmReturned():
            now.alarms.pop(event.alarm, None)
            if event.alarm in _NO_COMMANDS and not _NO_COMMANDS & now.alarms.keys():
                now.lease_lost = ""
        case AlarmAcknowledged() if event.alarm in now.alarms:
            raised, since_s, _ = now.alarms[event.alarm]
            now.alarms[event.alarm] = (raised, since_s, True)
        case AlarmShelved():
            now.shelved.add(event.alarm)
        case AlarmUnshelved():
            now.shelved.discard(event.alarm)
        case LatchReset():
            now.latched, now.state = "", event.state or now.state
            now.mode = now.requested = "observe"


def _of_recovery(now: Situation, event: Event, at_s: float) -> None:
    match event:
        case RunStarted():
            now.end_s = _number(event.settings.get("end_s"))
        case RunFinished():
            now.finished, now.thinking_s, now.act_by_s = event.outcome, None, None
        case Noticed() | Diagnosed() | Doubted() | Attempted():
            now.thinking_s, now.waits, now.probe_s, now.decided = at_s, None, None, ""
        case Waited():
            now.thinking_s, now.waits, now.decided = None, (event, at_s + event.seconds), ""
        case ReleasedActions() | NoActionTaken():
            now.thinking_s, now.act_by_s, now.waits = None, None, None
        case Compared():
            now.decided, now.advised = event.chosen, ""
            now.thinking_s = now.thinking_s if event.chosen else None
        case Probed() if not event.commands:  # looking on is all there is to it
            now.thinking_s, now.probe_s, now.decided = None, at_s + event.seconds, ""
        case GaveUp() | Concluded():
            now.thinking_s = None
        case FallbackActivated():
            now.thinking_s, now.act_by_s, now.waits = None, None, None
            _aim(now, event.commands)
        case Tripped() if event.acted:
            now.act_by_s = None
        case Latched():
            now.latched, now.act_by_s = plainly(event.reason), None


def _ahead(now: Situation, event: Event, at_s: float) -> None:
    """What is foreseen from here on: what was foreseen before something was done is not what is to come."""
    match event:
        case GuardStarted():
            now.lifted = set()
        case TripLifted():
            now.lifted.add(event.limit)
        case TripLiftEnded():
            now.lifted.discard(event.limit)
        case Foreseen() if event.digest:
            now.proposed = event
        case Foreseen() if now.done is None or now.done[1] < event.from_s - 1.0:
            now.outlook = event
        case ReleasedActions():
            given = now.proposed if now.proposed is not None and now.proposed.digest == event.digest else None
            now.outlook, now.done, now.advised, now.decided = given, ("release", at_s), "", ""
        case FallbackActivated():
            now.outlook, now.done, now.advised, now.decided = None, (event.strategy, at_s), "", ""
        case FaultsEnded() | SymptomsCleared():
            now.outlook, now.advised, now.done = None, "", None
            _drop(now)
        case NoActionTaken() | ReleaseRefused():
            now.advised = now.decided = ""


def _drop(now: Situation) -> None:
    """Nobody works on an answer any more, and what was waited for or decided comes to nothing."""
    now.thinking_s, now.waits, now.probe_s, now.decided = None, None, None, ""


def _aim(now: Situation, commands: tuple[Command, ...]) -> None:
    now.targets |= {command.tag: command.value for command in commands}


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None
