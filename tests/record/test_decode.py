"""Events of costs: read back as they were recorded, and from journals that are older than prices."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.events.recovery import Attempted, Compared
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding, Violating
from homeostat.journal import Event, Journal, Record, Summary, read_events
from homeostat.record.decode import DecodeError, decode

COST = Cost((CostItem("production", 9.5), CostItem("release", 0.3)), 30.0)
FINDING = Finding("ACC-T-HIGH", Owner.ACTION, 0.2, "K", 636.0, 0, "fine")
TRIED = Attempted(1, "search", ("normal", "reduced"), (Command("F1.sp", 0.02, None),), "d1", True, (FINDING,), 4, COST)
COMPARED = Compared(
    "EUR",
    (
        Alternative(AlternativeKind.RELEASE, "normal > reduced", COST, "", "search", "d1"),
        Alternative(
            AlternativeKind.LEAVE,
            "normal",
            replace(COST, items=()),
            "too hot",
            certificate=Certificate(64, 3, 0.2, 0.95),
        ),
        Alternative(AlternativeKind.FALLBACK, "drain", Cost((CostItem("ACC-T", math.inf),), 30.0), "it acts later"),
    ),
    "d1",
)


def recorded(folder: Path, event: Event) -> Record:
    """``event``, as a journal on disk has it."""
    with Journal(folder) as journal:
        journal.record(event, 5.0)
        journal.close(Summary(seed=1, outcome="released"))
    return next(record for record in read_events(folder) if record.kind == event.kind)


SOME = replace(TRIED, approved=False, findings=(replace(FINDING, margin=-9.0, violating=Violating(1, 4, 0.05)),))


@pytest.mark.parametrize("event", [TRIED, SOME, replace(TRIED, cost=None), COMPARED, Compared("EUR", (), "")])
def test_what_was_recorded_is_read_back(tmp_path: Path, event: Event) -> None:
    assert decode(recorded(tmp_path / "run", event)) == event


def test_a_finding_that_is_older_than_the_count_of_members_is_read_without_it(tmp_path: Path) -> None:
    record = recorded(tmp_path / "run", SOME)
    (told,) = cast(list[dict[str, Any]], record.fields["findings"])
    older = replace(record, fields={**record.fields, "findings": [{k: v for k, v in told.items() if k != "violating"}]})
    assert decode(older) == replace(SOME, findings=(replace(FINDING, margin=-9.0),))


def test_an_attempt_that_is_older_than_prices_has_no_cost(tmp_path: Path) -> None:
    record = recorded(tmp_path / "run", TRIED)
    older = replace(record, fields={name: value for name, value in record.fields.items() if name != "cost"})
    assert decode(older) == replace(TRIED, cost=None)


def test_a_comparison_that_is_older_than_its_certificates_is_read_without_them(tmp_path: Path) -> None:
    record = recorded(tmp_path / "run", COMPARED)
    told = [{k: v for k, v in a.items() if k != "certificate"} for a in record.fields["alternatives"]]
    found = decode(replace(record, fields=record.fields | {"alternatives": told}))
    assert isinstance(found, Compared) and all(a.certificate is None for a in found.alternatives)
    assert [a.digest for a in found.alternatives] == [a.digest for a in COMPARED.alternatives]


def test_a_comparison_that_lacks_a_cost_or_says_another_kind_is_refused(tmp_path: Path) -> None:
    record = recorded(tmp_path / "run", COMPARED)
    first = record.fields["alternatives"][0]
    for broken in ({name: value for name, value in first.items() if name != "cost"}, first | {"kind": "WISH"}):
        with pytest.raises(DecodeError, match="'compared'"):
            decode(replace(record, fields=record.fields | {"alternatives": [broken]}))
