"""Whether what is left when a fault is noticed suffices for a decision, and what to change where it does not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.evaluate.lint.checks import CHECKS
from homeostat.evaluate.lint.child import findings_of
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.faults import Outlook
from homeostat.evaluate.lint.deep.thinking import left_s, needs, too_little
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.scaffold import make_plant
from tests.cli.command import homeostat

Site = Callable[..., Bench]
LIMIT = "LIM-L1-HIGH"


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """The heated tank, with more lines of settings."""

    def made(settings: str = "") -> Bench:
        make_plant(tmp_path / "boiler", "tanks")
        path = tmp_path / "boiler" / "case.toml"
        text = path.read_text("utf-8")
        if settings.startswith("horizon_s"):
            horizon, _, settings = settings.partition(" ; ")
            text = text.replace("[twin]\n", f"[twin]\n{horizon}\n")
        path.write_text(text + settings, "utf-8")
        return Bench(tmp_path / "boiler")

    return made


def outlook(noticed_s: float | None, violated_s: float | None) -> Outlook:
    symptoms = ("S-H1-OFF", "S-P1-OFF")
    return Outlook("P1_stuck_closed", noticed_s, symptoms, LIMIT if violated_s else "", violated_s, (), ("adjusted",))


def said(bench: Bench, noticed_s: float | None, violated_s: float | None) -> Finding | None:
    found = list(too_little(bench, outlook(noticed_s, violated_s)))
    assert len(found) <= 1
    return found[0] if found else None


def test_there_is_time_as_long_as_evidence_thinking_and_fallback_fit(site: Site) -> None:
    bench = site()
    assert needs(bench, LIMIT).total_s == 6.0 + 1.0 + 5.0
    assert said(bench, 4.0, 16.0) is None and said(bench, 4.0, 15.0) is None  # a sample is not known better
    short = said(bench, 4.0, 14.0)
    assert short is not None and short.severity is Severity.WARNING and short.counts


def test_what_violates_nothing_or_is_not_noticed_is_no_matter_of_thinking(site: Site) -> None:
    bench = site()
    assert said(bench, 4.0, None) is None and said(bench, None, 100.0) is None


def test_too_much_evidence_is_told_with_what_it_may_be(site: Site) -> None:
    found = said(site("\n[monitoring]\nevidence_s = 40.0\n"), 4.0, 34.0)
    assert found is not None
    assert str(found) == (
        "case.toml (monitoring, evidence_s): warning: 'P1_stuck_closed' is noticed after 4 s and violates LIM-L1-HIGH "
        "after 34 s while nobody acts: 30 s are left, thinking is allowed 25 s of it, while a decision needs 46 s (40 "
        "s of evidence, 1 s of thinking, 5 s until the fallback acts); wait less for evidence: evidence_s = 40 must be "
        "at most 24 s [thinking]"
    )


def test_evidence_that_is_looked_at_sooner_is_no_wait(site: Site) -> None:
    assert said(site("\n[monitoring]\nevidence_s = 40.0\nagain_s = 1.0\n"), 4.0, 34.0) is None


@pytest.mark.parametrize(("violated_s", "words"), [(5.0, "1 s are left"), (3.0, "that is 1 s too late")])
def test_a_fault_that_is_noticed_late_is_told_at_its_symptom(violated_s: float, words: str, site: Site) -> None:
    found = said(site(), 4.0, violated_s)
    assert found is not None and words in found.what and "thinking is allowed 0 s" in found.what
    assert str(found.where) == "engineering/instruments.csv row 7 (S-P1-OFF)"
    assert "'S-P1-OFF'" in found.remedy and "engineering/limits.csv row 2 (LIM-L1-HIGH)" in found.remedy


def test_a_review_that_comes_too_late_is_told_with_what_it_may_be(site: Site) -> None:
    bench = site("horizon_s = 320 ; \n[monitoring]\nreview_s = 605.0\n")
    found = said(bench, 30.0, 643.0)
    assert found is not None and str(found.where) == "case.toml (monitoring, review_s)"
    assert "no look before review 1 sees 320 s ahead so far, and 8 s are left then" in found.what
    assert found.remedy == "review it sooner: review_s = 605 must be at most 308 s"
    assert said(bench, 30.0, 650.0) is None and said(bench, 30.0, 349.0) is None


@given(
    noticed=st.floats(0.0, 5e3), after=st.floats(0.1, 5e4), review=st.floats(1.0, 1e3), horizon=st.floats(60.0, 3600.0)
)
def test_the_first_look_that_sees_it_is_the_first(noticed: float, after: float, review: float, horizon: float) -> None:
    left, reviews = left_s(noticed, noticed + after, review, horizon)
    assert left <= horizon + 1e-6 and left == pytest.approx(after - reviews * review, abs=1e-6)
    assert reviews == 0 or after - (reviews - 1) * review > horizon - 1e-6
    assert left >= min(after, horizon - review) - 1e-6  # what a review_s of at most horizon_s less the needs ensures


@pytest.mark.wide
@pytest.mark.slow
def test_the_whole_check_finds_a_symptom_that_waits_too_long(site: Site) -> None:
    bench = site()
    rows = "id,on_delay_s\nS-P1-OFF,395\nS-LIC1-OFF,395\n"
    (bench.folder / "engineering" / "symptoms.csv").write_text(rows, "utf-8")
    found = [f for f in findings_of(CHECKS["faults"], bench) if isinstance(f, Finding) and f.check == "thinking"]
    assert found and all(str(f.where).startswith("engineering/symptoms.csv row ") for f in found)
    assert {f.what.split("'")[1] for f in found} == {"P1_stuck_closed", "P1_stuck_open"}  # just before, and after


def test_a_plant_whose_units_do_not_agree_is_not_tried(tmp_path: Path) -> None:
    make_plant(tmp_path / "boiler", "tanks")
    path = tmp_path / "boiler" / "engineering" / "parameters.csv"
    path.write_text(path.read_text("utf-8").replace("power_H1,60,kW", "power_H1,60,kJ"), "utf-8")
    done = homeostat("plant", "try", "./boiler", cwd=tmp_path)
    last = done.err.splitlines()[-1]
    assert done.status == 2 and done.out == "" and list(tmp_path.glob("*.png")) == []
    assert last.startswith("homeostat: boiler: the rate of B1_T") and "correct the equation or the unit" in last
    checked = homeostat("plant", "check", "./boiler", cwd=tmp_path)
    assert checked.status == 1 and "the rate of B1_T" in checked.out
