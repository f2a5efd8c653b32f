"""An instrument whose samples the tables do not state, and a limit on one of which nobody notices that it is frozen."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.lint.places import Places
from homeostat.evaluate.lint.sampled import otherwise_sampled, unjudged
from tests.knowledge.shorts import Short

EMPTY = ("tag,noise,frozen_s", "L1,,")
LIMIT = "id,kind,formula,source,description"


@pytest.fixture
def short(tmp_path: Path) -> Short:
    return Short.at(tmp_path / "two_tanks")


def model(**sampled: float) -> Any:
    return SimpleNamespace(sampled=sampled)


def stated(short: Short, seconds: str) -> None:
    lines = short.path("instruments").read_text("utf-8").splitlines()
    cells = ["every_s", *(seconds if ",L1," in line else "" for line in lines[1:])]
    short.write("instruments", *(f"{line},{cell}" for line, cell in zip(lines, cells, strict=True)))


def sampled(short: Short, model: Any) -> list[Finding]:
    return list(otherwise_sampled(short.plant(), model, Places(short.folder)))


def resting(short: Short) -> list[Finding]:
    return list(unjudged(short.plant(), Places(short.folder)))


def test_what_the_model_samples_and_no_table_states_is_an_error_where_it_is_bad_most_of_the_time(short: Short) -> None:
    (found,) = sampled(short, model(L1=30.0))
    assert found.severity is Severity.ERROR and str(found.where) == "engineering/instruments.csv row 2 (L1)"
    assert "every 30 s in the model, 1 s are stated" in found.what and "state every_s 30" in found.remedy


def test_one_that_a_row_of_quality_leaves_out_is_named_with_that_row(short: Short) -> None:
    short.write("quality", *EMPTY)
    (found,) = sampled(short, model(L1=30.0))
    assert found.severity is Severity.WARNING and "engineering/quality.csv row 2 (L1)" in found.remedy


def test_what_is_stated_otherwise_than_it_is_sampled_is_named(short: Short) -> None:
    stated(short, "20")
    assert [f.severity for f in sampled(short, model())] == [Severity.WARNING]
    assert sampled(short, model(L1=20.0)) == []
    assert sampled(short, SimpleNamespace()) == [], "a kernel of its own says nothing"


def test_a_limit_on_one_instrument_that_nobody_judges_is_named_once(short: Short) -> None:
    before = {found.where.key for found in resting(short)}
    short.write("quality", *EMPTY)
    new = [found for found in resting(short) if found.where.key not in before]
    read = {limit.name for limit in short.plant().limits.hard if limit.formula.tags == {"L1"}}
    assert read and {found.where.key for found in new} == read
    for found in new:
        assert found.severity is Severity.WARNING and "rests on 'L1' alone" in found.what and "frozen_s" in found.remedy


def test_another_instrument_in_the_limit_or_a_carrier_takes_its_place(short: Short) -> None:
    short.write("quality", *EMPTY)
    names = [found.where.key for found in resting(short) if "'L1'" in found.what]
    short.write("trips", "limit,carrier", *(f"{name},L2 <= 1.9" for name in names))
    assert [found for found in resting(short) if "'L1'" in found.what] == []
