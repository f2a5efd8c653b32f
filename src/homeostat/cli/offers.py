"""What a person decides by: the requests that wait, what is diagnosed, how long there is, and the margins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import FaultProbability, by_fault_set
from homeostat.domain.events.guard import Armed
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Record
from homeostat.record.certified import certified
from homeostat.record.run_record import RunRecord
from homeostat.record.story.wording import probabilities, quantity
from homeostat.service.answers import Waiting, waiting

MOST: Final = 5
"""Most margins that are listed of a request."""


@dataclass(frozen=True, slots=True)
class Offers:
    """The requests that wait for a person in a run that goes on."""

    waiting: tuple[Waiting, ...]
    """The oldest first."""
    attempts: dict[str, Attempted]
    """Digest -> how it was judged on the twin."""
    certificates: dict[str, Certificate]
    """Digest -> how likely it is to violate a hard limit, by whoever said so last."""
    believed: tuple[FaultProbability, ...]
    """Probabilities of faults as last diagnosed, most probable first."""
    armed: Armed | None
    """Which fallback acts, and perhaps when; None while none was ranked."""
    now_s: float
    """Process time of the journal's last line [s]."""

    @classmethod
    def of(cls, records: Sequence[Record]) -> Offers:
        """What ``records``, a whole journal in order, say."""
        run = RunRecord.of(records)
        diagnosed, armed = run.diagnosed, run.of_kind(Armed)
        return cls(
            waiting(records),
            {attempt.digest: attempt for attempt in run.attempts if attempt.approved},
            {w.digest: found for w in waiting(records) if (found := certified(run.entries, w.digest)) is not None},
            by_fault_set(diagnosed[-1][1].hypotheses) if diagnosed else (),
            armed[-1] if armed else None,
            records[-1].at_s if records else 0.0,
        )

    def lines(self, plant: PlantDescription | None) -> Iterator[str]:
        """What is shown; ``plant`` gives units, scales and the operator's words, None where it is not known here."""
        if not self.waiting:
            yield f"no request waits for a person at {self.now_s:.0f} s"
        for request in self.waiting:
            yield f"{request.request}  by {request.proposer}  --digest {request.digest}"
            yield _row("diagnosed", _believed(self.believed, plant))
            yield _row("time", self._time(request))
            attempt = self.attempts.get(request.digest)
            if attempt is None:
                yield _row("commands", "not in the journal")
                continue
            yield _row("leads to", f"{attempt.path[-1]}, by {' > '.join(attempt.path)}" if attempt.path else "no state")
            yield _row("commands", ", ".join(_command(c, plant) for c in attempt.commands) or "none")
            if (certificate := self.certificates.get(request.digest)) is not None:
                counted = f"{certificate.violations} of {certificate.draws} draws {certificate.told}"
                yield _row("risk", f"at most {certificate.percent} % ({counted})")
            for name, text in zip(("margins", *[""] * MOST), _margins(attempt.findings, plant), strict=False):
                yield _row(name, text)

    def _time(self, request: Waiting) -> str:
        """How long there is to decide, in process time."""
        void_s = request.at_s + GuardSettings().person_s if request.void_s is None else request.void_s
        armed, text = self.armed, f"offered at {request.at_s:.0f} s, void by {void_s:.0f} s; "
        if armed is not None and armed.act_by_s is not None and armed.strategies:
            text += (
                f"the fallback {armed.strategies[0]!r} acts at {armed.act_by_s:.0f} s unless something is released; "
            )
        return f"{text}the journal has come to {self.now_s:.0f} s"


def _row(name: str, text: str) -> str:
    return f"  {name:<9} {text}"


def _believed(held: Iterable[FaultProbability], plant: PlantDescription | None) -> str:
    if plant is not None:
        return probabilities(held, plant)
    return "; ".join(f"{100 * fault_set.probability:.0f} % {fault_set.name}" for fault_set in held) or "no explanation"


def _command(order: Command, plant: PlantDescription | None) -> str:
    unit = "" if plant is None else plant.tag(order.tag).unit
    text = f"{order.tag} to {'automatic' if order.value is None else quantity(order.value, unit).rstrip()}"
    return text if order.rate is None else f"{text} at {quantity(order.rate, unit).rstrip()} per s"


def _margins(findings: Iterable[Finding], plant: PlantDescription | None) -> Iterator[str]:
    """The margins, one a line, what is nearest to its limit first, and how many more there are."""
    scales = {} if plant is None else plant.scales
    ordered = sorted(findings, key=lambda finding: finding.relative(scales))
    for finding in ordered[:MOST]:
        unit = "" if finding.unit in ("", "1") else f" {finding.unit}"
        yield f"{_subject(finding, plant)} {finding.margin:+.3g}{unit} ({finding.criterion})"
    if len(ordered) > MOST:
        yield f"and {len(ordered) - MOST} more, all further from their limits"


def _subject(finding: Finding, plant: PlantDescription | None) -> str:
    """The tags whose limit it is, and what it protects; what was judged, where the plant has no such limit."""
    named: tuple[Limit | Criterion, ...] = ()
    if plant is not None:
        named = (*plant.limits.limits, *plant.limits.criteria)
    limit = next((limit for limit in named if limit.name == finding.criterion), None)
    if limit is None:
        return finding.message
    return f"{', '.join(sorted(limit.formula.tags))}: {limit.description},"
