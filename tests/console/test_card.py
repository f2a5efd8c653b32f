"""The card says what the journal says, and nothing that was not known yet."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.card import episode
from homeostat.console.card.card import Card
from homeostat.console.opened import OpenedRun
from homeostat.console.outlook import Until
from homeostat.console.view import recorded, seen, shown
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import Armed
from homeostat.domain.events.recovery import Attempted, Compared, Diagnosed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.journal import Event
from homeostat.record.story.plain import plainly


def first(run: OpenedRun, kind: type[Event]) -> tuple[float, Event]:
    """The first event of one kind, after its time [s]."""
    return next((entry.at_s, entry.event) for entry in run.entries if isinstance(entry.event, kind))


def card_at(run: OpenedRun, at_s: float) -> Card:
    found = seen(run, at_s).card
    assert found is not None
    return found


def test_nothing_is_known_before_it_was_seen(recovered: OpenedRun) -> None:
    told = shown(recovered)
    assert told.begins_s is not None
    before = seen(recovered, told.begins_s - 1.0)
    assert before.card is None
    assert (before.overview.level, before.overview.alarm) == ("normal", "")


def test_the_diagnosis_is_the_journals(recovered: OpenedRun) -> None:
    at_s, event = first(recovered, Diagnosed)
    assert isinstance(event, Diagnosed)
    card = card_at(recovered, at_s)
    likely = sum(h.probability for h in event.hypotheses if h.name == "cool_stuck_closed")
    assert card.headline == "Cooling valve stuck towards closed" and card.probability == pytest.approx(likely)
    assert card.explanations[0].component == "V2" and card.explanations[0].supports
    assert {s.rule: s.times for s in card.seen} == {s.rule: s.severity for s in event.symptoms}
    assert card.proposal is None


def test_of_a_release_and_a_hold_with_the_same_commands_one_is_the_choice(recovered: OpenedRun) -> None:
    at_s, compared = first(recovered, Compared)
    assert isinstance(compared, Compared)
    chosen = next(a for a in compared.alternatives if a.digest == compared.chosen)
    hold = replace(chosen, kind=AlternativeKind.HOLD, seconds=60.0)
    both = replace(compared, alternatives=(*compared.alternatives, hold))
    entries = [replace(e, event=both) if e.event is compared else e for e in recovered.until(at_s)]
    told = episode.card(recorded(entries), recovered.plant, None, at_s)
    assert told is not None and len(told.choices) == len(both.alternatives)
    assert [c.kind for c in told.choices if c.chosen] == [chosen.kind.value]


def test_the_proposal_has_every_margin_cost_and_command_of_the_journal(recovered: OpenedRun) -> None:
    at_s, compared = first(recovered, Compared)
    tried = next(e.event for e in recovered.entries if isinstance(e.event, Attempted) and e.event.approved)
    assert isinstance(compared, Compared) and compared.chosen == tried.digest
    card = card_at(recovered, at_s)
    proposal = card.proposal
    assert proposal is not None and proposal.released_s is None
    listed = next(a.certificate for a in compared.alternatives if a.digest == tried.digest)
    released = first(recovered, ReleasedActions)[1]
    assert isinstance(released, ReleasedActions) and listed is not None
    assert proposal.certificate == released.certificate, "whoever is asked for a yes knows how safe it is"
    mine = {f.criterion: f if f.deciding is None else f.deciding for f in tried.findings}
    margins = {
        f.criterion: (mine[f.criterion].margin, mine[f.criterion].unit, f.at_s, f.member) for f in tried.findings
    }
    assert len(proposal.margins) + proposal.checks == len(margins)
    assert all(margins[m.name] == (m.margin, m.unit, m.at_s, m.member) for m in proposal.margins)
    assert [m.scaled for m in proposal.margins] == sorted(m.scaled for m in proposal.margins)
    assert all(m.actual is None for m in proposal.margins)
    assert {m.tag: m.after for m in proposal.moves} == {c.tag: c.value for c in tried.commands}
    moved = {m.tag: m for m in proposal.moves}
    assert moved["V2.man"].known and moved["V2.man"].before is None and moved["T1.sp"].before == 310.0
    assert [c.cost for c in card.choices] == [a.cost.total for a in compared.alternatives]
    assert [c.certificate for c in card.choices] == [a.certificate for a in compared.alternatives]
    assert [c.chosen for c in card.choices] == [a.digest == compared.chosen for a in compared.alternatives]
    left = next(a for a in compared.alternatives if a.kind is AlternativeKind.LEAVE)
    assert [c.chosen for c in card.choices].count(True) == 1
    assert card.alone == plainly(left.refused) and "violated by" in card.alone


def test_after_the_release_what_was_predicted_stands_beside_what_came(recovered: OpenedRun) -> None:
    at_s, released = first(recovered, ReleasedActions)
    assert isinstance(released, ReleasedActions) and recovered.readings is not None
    proposal = card_at(recovered, at_s + 60.0).proposal
    assert proposal is not None and proposal.digest == released.digest
    assert proposal.certificate == released.certificate and proposal.released_s is not None
    margin = next(m for m in proposal.margins if m.name == "LIM-T-HIGH")
    readings = recovered.readings
    since = readings.signals["T1"][readings.between(proposal.released_s, at_s + 60.0)]
    assert margin.actual == pytest.approx(313.0 - since.max())
    judged_later = next(m for m in proposal.margins if m.name == "ACC-T-HIGH")
    assert judged_later.actual is None  # it counts from 180 s after the release on


def test_a_deadline_is_shown_until_something_was_released(recovered: OpenedRun) -> None:
    armed_s, armed = next((e.at_s, e.event) for e in recovered.entries if isinstance(e.event, Armed))
    released_s, _ = first(recovered, ReleasedActions)
    assert isinstance(armed, Armed) and armed_s < released_s
    before, after = seen(recovered, armed_s).overview, seen(recovered, released_s).overview
    left = before.left
    assert (left.until, left.to_s, before.fallback) == (Until.FALLBACK, armed.act_by_s, armed.strategies[0])
    assert left.to_s is not None and left.to_s > armed_s and before.level == "high"
    assert after.left.until is Until.CLEAR and after.waiting == "the effect of what was released"


def test_a_fallback_that_acted_is_told_with_its_reason_and_what_it_wrote(handed_over_run: Path) -> None:
    run = opened(handed_over_run, None)
    at_s, event = first(run, FallbackActivated)
    assert isinstance(event, FallbackActivated)
    moment = seen(run, run.last_s)
    assert moment.card is not None
    acted = moment.card.acted[-1]
    assert (acted.at_s, acted.strategy, acted.reason) == (at_s, event.strategy, event.reason)
    assert {m.tag: m.after for m in acted.moves} == {c.tag: c.value for c in event.commands}
    assert moment.overview.level == "critical" and moment.overview.left.until in (Until.ACTED, Until.ENDED)


def test_every_moment_of_a_run_can_be_shown(recovered: OpenedRun) -> None:
    for entry in recovered.entries:
        moment = seen(recovered, entry.at_s)
        assert moment.at_s == entry.at_s
        assert (moment.card is None) == (entry.at_s < (shown(recovered).begins_s or 0.0))


def test_what_is_foreseen_is_the_journals_and_of_before(recovered: OpenedRun) -> None:
    told = [(e.at_s, e.event) for e in recovered.entries if isinstance(e.event, Foreseen)]
    alone_s, alone = next((at_s, e) for at_s, e in told if not e.digest)
    checked_s, checked = next((at_s, e) for at_s, e in told if e.digest)
    assert alone.first is not None and alone.first.earliest_s <= alone.first.middle_s <= alone.first.latest_s
    before = seen(recovered, alone_s - 1.0).card
    assert before is None or before.foresight is None
    card = card_at(recovered, checked_s)
    assert card.foresight is not None and card.foresight.told == alone
    assert card.foresight.limit == "Highest reactor temperature"
    assert card.proposal is not None and card.proposal.foresight is not None and card.proposal.beside is not None
    assert (card.proposal.foresight.told, card.proposal.beside.told) == (checked, alone)
    tags = {tag.name for tag in shown(recovered).tags if tag.limits}
    assert tags <= {band.tag for band in checked.bands}
