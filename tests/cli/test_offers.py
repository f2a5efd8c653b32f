"""What a person decides by: the listing of the requests that wait."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.cli.offers import Offers
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import Armed, RequestAnswered
from homeostat.domain.events.recovery import Attempted, Compared, Diagnosed
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding
from homeostat.journal import Event, Journal, Record, RunStarted, read_events
from tests.plants.cstr.reactor import plant

PLANT = plant()


def found(criterion: str, margin: float, unit: str, message: str = "") -> Finding:
    return Finding(criterion, Owner.ACTION, margin, unit, 0.0, 0, message)


FINDINGS = (
    found("LIM-T-HIGH", 7.0, "K"), found("ACC-A", 30.0, "K", "A"), found("ACC-B", 31.0, "K", "B"),
    found("TARGET-reduced", 1.5, "K", "State 'reduced' is reached"), found("ACC-C", 32.0, "K", "C"),
    found("ACC-D", 33.0, "K", "D"), found("ACC-E", 34.0, "K", "E"),
)  # fmt: skip
ASKED: tuple[tuple[Event, float], ...] = (
    (RunStarted("cstr", (), 1), 0.0),
    (Diagnosed((), (
        Hypothesis((FaultState("cool_stuck_closed", 0.3, 2000.0),), 0.9), Hypothesis((), 0.1),
    )), 2004.0),
    (Armed(("shut_feed", "rest"), 2093.0), 2005.0),
    (Attempted(1, "search", ("reduced", "held"), (Command("F1.sp", 0.02, 0.001),), "d1", True, FINDINGS, 4), 2006.0),
    (RequestAnswered("r1", "search", "d1", "offered"), 2008.0),
)  # fmt: skip


def listed(folder: Path, *events: tuple[Event, float], known: bool = True) -> list[str]:
    with Journal(folder) as journal:
        for event, at_s in events:
            journal.record(event, at_s)
    records: tuple[Record, ...] = tuple(read_events(folder))
    return list(Offers.of(records).lines(PLANT if known else None))


def test_a_request_is_listed_with_all_that_a_person_decides_by(tmp_path: Path) -> None:
    assert listed(tmp_path, *ASKED) == [
        "r1  by search  --digest d1",
        "  diagnosed 90 % cool_stuck_closed 0.3; 10 % nothing is wrong",
        "  time      offered at 2008 s, void by 2608 s; the fallback 'shut_feed' acts at 2093 s unless something is "
        "released; the journal has come to 2008 s",
        "  leads to  held, by reduced > held",
        "  commands  F1.sp to 0.02 L/s at 0.001 L/s per s",
        "  margins   State 'reduced' is reached +1.5 K (TARGET-reduced)",
        "            T1: Highest reactor temperature, +7 K (LIM-T-HIGH)",
        "            A +30 K (ACC-A)",
        "            B +31 K (ACC-B)",
        "            C +32 K (ACC-C)",
        "            and 2 more, all further from their limits",
    ]


@pytest.mark.parametrize(
    ("certificate", "told"),
    [
        (Certificate(64, 0, 0.04941, 0.95), ["  risk      at most 5.0 % (0 of 64 draws violate a hard limit)"]),
        (Certificate(64, 3, 0.19, 0.95, True), ["  risk      at most 19.0 % (3 of 64 draws do worse than the fallback, "
                                                "which violates a hard limit as well)"]),
        (None, []),
    ],
)  # fmt: skip
def test_how_likely_harm_is_stands_above_the_margins(
    tmp_path: Path, certificate: Certificate | None, told: list[str]
) -> None:
    one = Alternative(AlternativeKind.RELEASE, "reduced > held", Cost((), 30.0), "", "search", "d1")
    other = replace(one, digest="d0", certificate=Certificate(64, 64, 1.0, 0.95))
    compared = Compared("EUR", (replace(one, certificate=certificate), other), "d1"), 2007.0
    lines = listed(tmp_path, *ASKED[:-1], compared, ASKED[-1])
    assert [line for line in lines if line.startswith("  risk")] == told
    assert all(lines[lines.index(line) + 1].startswith("  margins") for line in told)


def test_what_was_said_of_the_same_commands_before_is_not_said_of_them_now(tmp_path: Path) -> None:
    """Digests are of contents: months ago the same may have been safe."""
    old = Alternative(
        AlternativeKind.RELEASE, "x", Cost((), 30.0), "", "search", "d1", certificate=Certificate(64, 0, 0.05, 0.95)
    )
    now = replace(old, certificate=None)
    lists = [(Compared("EUR", (one,), "d1"), at_s) for one, at_s in ((old, 100.0), (now, 2007.0))]
    lines = listed(tmp_path, ASKED[0], lists[0], *ASKED[1:-1], lists[1], ASKED[-1])
    assert not any(line.startswith("  risk") for line in lines)


def test_what_the_release_check_says_stands_in_place_of_what_the_list_says(tmp_path: Path) -> None:
    one = Alternative(
        AlternativeKind.RELEASE, "x", Cost((), 30.0), "", "search", "d1", certificate=Certificate(64, 0, 0.05, 0.95)
    )
    checked = Foreseen("d1", 2007.0, 900.0, 36, certificate=Certificate(512, 0, 0.0041, 0.96))
    lines = listed(tmp_path, *ASKED[:-1], (Compared("EUR", (one,), "d1"), 2006.5), (checked, 2007.0), ASKED[-1])
    assert "  risk      at most 0.41 % (0 of 512 draws violate a hard limit)" in lines


@pytest.mark.parametrize(
    ("bound", "told"),
    [(1.0, "100.0"), (0.04941, "5.0"), (0.05, "5.0"), (0.0101, "1.1"), (0.00991, "1.00"), (0.0041, "0.41"),
     (0.00009, "0.0090"), (0.0000901, "0.0091"), (0.0, "0.0")],
)  # fmt: skip
def test_a_bound_is_never_rounded_to_less_than_it_is(bound: float, told: str) -> None:
    assert Certificate(64, 0, bound, 0.95).percent == told


def test_a_plant_that_is_not_known_here_is_decided_on_by_names_and_margins(tmp_path: Path) -> None:
    lines = listed(tmp_path, *ASKED, known=False)
    assert "  diagnosed 90 % cool_stuck_closed; 10 % none" in lines
    assert "  commands  F1.sp to 0.02 at 0.001 per s" in lines


@pytest.mark.parametrize("events", [ASKED[:-1], (*ASKED, (RequestAnswered("r1", "search", "d1", "withdrawn"), 2010.0))])
def test_where_nothing_waits_that_is_said_with_its_time(
    tmp_path: Path, events: tuple[tuple[Event, float], ...]
) -> None:
    assert listed(tmp_path, *events) == [f"no request waits for a person at {events[-1][1]:.0f} s"]
