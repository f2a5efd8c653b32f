"""Does a record agree with itself? Each rule yields what contradicts it, one sentence with the line each."""

import math
from collections.abc import Callable, Iterator
from typing import Final

from homeostat.domain.events.guard import GuardStarted, RequestAnswered, StateEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.recovery import action_digest
from homeostat.journal.beside.manifest import OLDER_KINDS, UNSIGNED_FORMAT
from homeostat.journal.encode import Json
from homeostat.journal.events import RunFinished, RunStarted
from homeostat.journal.reading import Record
from homeostat.journal.verify.course import begin, end, releases, starts_of_people
from homeostat.journal.verify.evidence import Evidence, text, word
from homeostat.journal.verify.requests import accepted_in_gaps, lives_of_requests
from homeostat.journal.verify.writes import lives_of_writes, writes_that_mode_or_latch_forbid

MOST = 20
"""Contradictions that are told; the rest would say no more."""
_WITHOUT_FALLBACK: Final = frozenset({"recovered", "no-action", "held"})
"""Outcomes of runs in which no fallback acted."""


def contradictions(evidence: Evidence) -> Iterator[str]:
    """Everything in which a run contradicts itself, at most `MOST` sentences."""
    found = (problem for rule in RULES for problem in rule(evidence))
    for _, problem in zip(range(MOST), found, strict=False):
        yield problem


def times(evidence: Evidence) -> Iterator[str]:
    """Lines' times never decrease, nothing happens after its line, and nothing before signatures after the end."""
    if evidence.manifest is not None and evidence.manifest.format == UNSIGNED_FORMAT:
        yield from _older_times(evidence)
        return
    last = -math.inf
    for record in evidence.records:
        if record.at_s < last:
            yield f"line {record.seq}: its time is {record.at_s:g} s, after a line of {last:g} s; times never decrease"
        if record.happened_s > record.at_s:
            yield f"line {record.seq}: it happened at {record.happened_s:g} s, after its line of {record.at_s:g} s"
        last = max(last, record.at_s)


def _older_times(evidence: Evidence) -> Iterator[str]:
    """The format before signatures kept events in the order in which they became known."""
    finished = [r for r in evidence.of(RunFinished) if word(r.fields.get("outcome")) != "interrupted"]
    end = finished[-1].at_s if finished else math.inf
    for record in evidence.records:
        if not 0.0 <= record.at_s <= end:
            yield f"line {record.seq}: its time is {record.at_s:g} s, outside the run, which lasts from 0 to {end:g} s"


def kinds(evidence: Evidence) -> Iterator[str]:
    """A record that says it is older than signatures holds nothing that is younger."""
    if evidence.manifest is None or evidence.manifest.format != UNSIGNED_FORMAT:
        return
    for record in evidence.records:
        if record.kind not in OLDER_KINDS or record.happened_s != record.at_s:
            yield f"line {record.seq}: format {UNSIGNED_FORMAT} has no event like this {record.kind!r}"


def digests(evidence: Evidence) -> Iterator[str]:
    """The digest of what was released is that of its commands, and the same digest never stands for others."""
    known: dict[str, tuple[int, Json]] = {}
    for record in evidence.of(ReleasedActions, WriteIntended):
        digest, commands = text(record, "digest"), record.fields.get("commands")
        if not digest or record.fields.get("attempt", 1) != 1:  # another attempt may send what is left
            continue
        if _holds_all(record) and _recomputed(record) != digest:
            yield f"line {record.seq}: digest {digest[:12]} is not that of the commands and steps that it stands for"
        first, others = known.setdefault(digest, (record.seq, commands))
        if commands != others:
            yield f"line {record.seq}: digest {digest[:12]} stands for other commands than in line {first}"


def _holds_all(record: Record) -> bool:
    """Whether the digest can be made again: an intention does not hold the guards of later steps."""
    if record.kind == WriteIntended.kind:
        return record.fields.get("steps") == []
    return bool(text(record, "state"))


def _recomputed(record: Record) -> str:
    """The digest of what a record holds; empty where it cannot be one."""
    try:
        steps = [
            [s["transition"], s["guard"], s["target"], _plain(s["commands"])]  # type: ignore[index, call-overload]
            for s in record.fields.get("then", [])  # type: ignore[union-attr]
        ]
        return action_digest(text(record, "state"), _plain(record.fields["commands"]), steps)
    except (LookupError, TypeError, ValueError):
        return ""


def _plain(commands: Json) -> list[list[Json]]:
    return [[c["tag"], c["value"], c["rate"]] for c in commands]  # type: ignore[index, call-overload, union-attr]


def outcomes(evidence: Evidence) -> Iterator[str]:
    """How the run ended, by its last word, its manifest and its result, agrees with what happened in it."""
    finished = list(evidence.of(RunFinished))
    if not finished:
        return
    outcome, line = word(finished[-1].fields.get("outcome")), finished[-1].seq
    if evidence.manifest is not None and word(evidence.manifest.outcome) != outcome:
        yield f"line {line}: the run ended {outcome!r}, by the manifest {word(evidence.manifest.outcome)!r}"
    fallback = next(evidence.of(FallbackActivated), None)
    if outcome in _WITHOUT_FALLBACK and fallback is not None:
        yield f"line {line}: the run ended {outcome!r}, but a fallback acted in line {fallback.seq}"
    if outcome == "fallback" and fallback is None:
        yield f"line {line}: the run ended {outcome!r}, but no fallback acted"


def configurations(evidence: Evidence) -> Iterator[str]:
    """The configuration that the first event names is the manifest's."""
    stated = "" if evidence.manifest is None else evidence.manifest.configuration
    first = next(((r, d) for r in evidence.of(RunStarted, GuardStarted) if (d := _configuration(r))), None)
    if stated and first is not None and first[1] != stated:
        yield f"line {first[0].seq}: it ran with configuration {first[1][:12]}, by the manifest with {stated[:12]}"


def _configuration(record: Record) -> str:
    value = record.fields.get("configuration")
    if isinstance(value, list):  # of a run: everything that was chosen
        settings = [s for s in value if isinstance(s, dict) and s.get("name") == "configuration"]
        value = settings[0].get("value") if settings else ""
    return value if isinstance(value, str) else ""


def results(evidence: Evidence) -> Iterator[str]:
    """The result says of the run what its events say."""
    result = evidence.result
    if result is None:
        return
    for name, events in _stated(evidence):
        if name in result and result[name] not in events:
            said = ", ".join(map(repr, events[:3])) or "nothing"
            yield f"the result's {name!r} is {result[name]!r}; the journal says {said}"
    sent = evidence.of(ReleasedActions, FallbackActivated, WriteIntended)
    written = [_untyped(record.fields.get("commands")) for record in sent]
    if result.get("actions") and result["actions"] not in written:
        yield "the result's 'actions' were never written by the journal"


def _stated(evidence: Evidence) -> Iterator[tuple[str, list[Json]]]:
    """Keys of a result, each with the values that the journal admits."""
    started, finished = next(evidence.of(RunStarted), None), list(evidence.of(RunFinished))
    if started is not None:
        yield "case", [started.fields.get("case")]
        yield "seed", [started.fields.get("seed")]
    if finished:
        yield "outcome", [finished[-1].fields.get("outcome")]
    yield "attempts", [sum(1 for _ in evidence.of(Attempted))]
    if states := list(evidence.of(StateEntered)):
        yield "state", [states[-1].fields.get("state")]
    onset = None if evidence.result is None else evidence.result.get("onset_s")
    begin = onset if isinstance(onset, int | float) else -math.inf
    reports = [r.happened_s for r in evidence.of(Diagnosed, Tripped) if r.happened_s >= begin]
    yield "detected_s", [min(reports)] if reports else [None]
    known = next((r.seq for r in evidence.of(Diagnosed)), math.inf)
    times_s, begun = _releases(evidence)
    yield "released_s", times_s if any(seq > known for seq in begun) else [None, *times_s]


def _releases(evidence: Evidence) -> tuple[list[Json], list[int]]:
    """Times that a release may bear [s], and the line in which each begins: the guard's, else what recovery said."""
    said = list(evidence.of(ReleasedActions))
    written = [
        (text(r, "source" if r.kind == WriteIntended.kind else "request"), r)
        for r in evidence.of(WriteIntended, RequestAnswered)
        if word(r.fields.get("cause")) == "request" or word(r.fields.get("status")) == "confirmed"
    ]
    begun = {name: r.seq for name, r in reversed(written)}
    return [r.happened_s for r in (*said, *(r for _, r in written))], list(begun.values()) or [r.seq for r in said]


def _untyped(commands: Json) -> Json:
    if not isinstance(commands, list):
        return None
    return [{k: v for k, v in c.items() if k != "@type"} if isinstance(c, dict) else c for c in commands]


RULES: Final[tuple[Callable[[Evidence], Iterator[str]], ...]] = (
    *(kinds, times, digests),
    *(lives_of_writes, lives_of_requests, accepted_in_gaps, writes_that_mode_or_latch_forbid),
    *(begin, end, starts_of_people, releases, outcomes, configurations, results),
)
"""Every rule, in the order in which its contradictions are told."""
