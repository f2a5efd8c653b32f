"""What the page is told: once of the plant and its run, then of every moment that is looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from homeostat.console.card.card import Card
from homeostat.console.card.episode import card, first_decided_s, first_seen_s, last_episode
from homeostat.console.card.explanation import Paragraph, explained
from homeostat.console.drawn import (
    DrawnPanel,
    DrawnSheet,
    DrawnTag,
    drawn_panels,
    drawn_sheet,
    drawn_tags,
    lately_violated,
    violated,
)
from homeostat.console.opened import OpenedRun
from homeostat.console.overview import Overview, overview
from homeostat.console.watched import Fresh
from homeostat.domain.events.guard import StartUpEnded, StateEntered
from homeostat.journal.memory import Entry
from homeostat.record.run_record import RunRecord
from homeostat.record.story.line import Line
from homeostat.recovery.exchange.pacing import Pace

_MOST_EVENTS = 20_000
"""Most events, the last ones, that a card is made from."""
_MOST_LINES = 2000
"""Most lines of the story that the page gets; of a longer one the last ones."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What stays as it is while a run is looked at."""

    title: str
    """The plant in the engineer's words."""
    notice: str
    """What a reader must know of plant or record; empty for nothing."""
    live: bool
    """Whether a process writes the run now."""
    closed: bool
    """Whether the run was closed."""
    attached: bool
    """Whether it is a plant that is attached."""
    measured: bool
    """Whether its readings are kept."""
    last_s: float
    """The latest process time that something is known of [s]."""
    begins_s: float | None
    """When something was first seen [s]; None where nothing ever was."""
    decided_s: float | None
    """When it was first decided what to do about it [s]; None where it never was."""
    tags: tuple[DrawnTag, ...]
    """Its tags."""
    panels: tuple[DrawnPanel, ...]
    """What its figures show."""
    sheet: DrawnSheet | None
    """Its flowsheet."""
    lines: tuple[Line, ...]
    """What happened, line by line."""
    altered: str = ""
    """Which line of the journal does not follow the one before, so that nothing later is shown; empty where all do."""
    beside: bool = False
    """Whether another run is shown beside it."""
    model: str = ""
    """Name of the model that says the card in other words; empty where there is none."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A run at one moment."""

    at_s: float
    """The moment, process time [s]."""
    sampled_s: float
    """When the readings were taken [s]."""
    values: Mapping[str, float]
    """Tag -> reading; NaN for a manual output on automatic."""
    quality: Mapping[str, tuple[str, str]]
    """Tag whose reading is not good -> its quality and why."""
    targets: Mapping[str, float | None]
    """Writable tag -> its target; None for automatic."""
    violated: tuple[str, ...]
    """Names of the limits that the readings violate, start-up apart."""
    fresh: Fresh | None
    """How fresh that is; None where it is a run."""
    overview: Overview
    """The line above."""
    whole: bool
    """Whether card and sentences are told; else they are as they were."""
    card: Card | None = None
    """The card; None where there is none, or where not the whole is told."""
    told: tuple[Paragraph, ...] = ()
    """The card in sentences."""
    pace: Pace | None = None
    """How fast the run goes on; None where that cannot be changed at this page."""


def shown(run: OpenedRun) -> Shown:
    """What stays as it is."""
    plant, entries = run.plant, run.entries
    begins_s = first_seen_s(entries)
    until_s = run.last_s if begins_s is None else begins_s
    readings = run.readings
    if run.attached:  # what came in weeks does not say what is usual now
        episode = last_episode(entries)
        until_s = run.last_s if episode is None or episode.over_s is not None else episode.entries[0].at_s
        until_s = until_s if run.stands(run.last_s).started else -1.0
    healthy = slice(0, 0) if readings is None else readings.between(_settled_s(entries, until_s), until_s)
    closed, going = run.closed, run.attached or run.goes_on()
    notices = [plant.notice, "" if run.altered else run.trouble]
    if not closed and not run.attached:
        notices.append(
            "The run goes on; this page follows it."
            if going
            else "The run did not come to its end; it is shown as far as it came."
        )
    if readings is None and not run.attached:
        notices.append("Its readings are not kept: they are stored when a run ends.")
    return Shown(
        title=plant.title,
        notice=" ".join(text for text in notices if text),
        live=going,
        closed=closed,
        attached=run.attached,
        measured=readings is not None,
        last_s=run.last_s,
        begins_s=begins_s,
        decided_s=first_decided_s(entries),
        tags=drawn_tags(plant, readings, healthy),
        panels=drawn_panels(plant),
        sheet=drawn_sheet(plant),
        lines=tuple(run.lines[-_MOST_LINES:]),
        altered=run.altered,
    )


def _settled_s(entries: Sequence[Entry], until_s: float) -> float:
    """Since when the plant was in the state in which it was at ``until_s`` [s], start-up over: what it usually does."""
    entered = [e.at_s for e in entries if isinstance(e.event, StateEntered | StartUpEnded) and e.at_s <= until_s]
    return entered[-1] if entered else 0.0


def seen(run: OpenedRun, at_s: float, whole: bool = True) -> Seen:
    """The run at ``at_s`` [s]; card and sentences only where the ``whole`` of it is wanted."""
    readings = run.readings
    sampled_s, values = readings.at(at_s) if readings is not None else (at_s, {})
    now = run.stands(at_s)
    broken = violated(values, run.plant.description) if now.started else ()
    count, (known, one) = run.count(at_s), run.made
    if whole or known != count:
        one = card(recorded(run.until(at_s)[-_MOST_EVENTS:]), run.plant, readings, at_s)
        run.made = count, one
    beyond = lately_violated(readings, sampled_s, run.plant.description, now.started_s)
    line = overview(now, one, run.plant.description, at_s, beyond)
    at = at_s, sampled_s, values, now.quality, now.targets, broken, run.fresh, line
    told = () if one is None else explained(one)
    return Seen(*at, True, one, told, run.pace) if whole else Seen(*at, False, pace=run.pace)


def recorded(entries: Sequence[Entry]) -> RunRecord:
    """The record of a run that has come so far."""
    record = RunRecord()
    for entry in entries:
        record(entry.event, entry.at_s)
    return record
