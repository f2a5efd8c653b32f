"""Settings: an unknown key, an unknown name and an absurd value are one line each; nothing foreign is imported."""

from __future__ import annotations

import json
import math
import re
import sys
import tomllib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.evaluate.study.ledger import LEDGER, Ledger
from homeostat.guard.guard import Guard
from homeostat.guard.settings import GuardSettings
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, PlantFiles
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.settings import Settings
from homeostat.plants.wired import assembly
from homeostat.plants.wired.assembly import wire
from homeostat.record.row import RESERVED, Row, columns_of
from tests.cli.command import homeostat, refused
from tests.evaluate.study.fake_rows import plain
from tests.plants.copies import Copy

TEXT = (INSTALLED / "cstr" / "case.toml").read_text(encoding="utf-8")


@pytest.fixture
def reactor(tmp_path: Path) -> Copy:
    return Copy.of("cstr", tmp_path)


def read(text: str) -> Settings:
    return read_settings(PlantFiles(Path("some"), {"case.toml": text.encode("utf-8", "surrogatepass")}))


def changed(key: str, value: str) -> str:
    """The reactor's settings with another ``value`` for ``key``, which is added where it is not there."""
    table, _, name = key.rpartition(".")
    pattern = re.compile(rf"(?m)^{re.escape(name)} = .*$")
    start = TEXT.index(f"[{table}]") if table else 0
    end = TEXT.find("\n[", start + 1)
    section = TEXT[start:end]
    line = f"{name} = {value}"
    section = pattern.sub(lambda _: line, section, count=1) if pattern.search(section) else f"{section}\n{line}\n"
    return TEXT[:start] + section + TEXT[end:]


ABSURD = [
    ("twin.judged_draws", "-1", "judged_draws: -1 draws is outside 1 to 1000 draws"),
    ("twin.judged_draws", "0", "outside 1 to 1000"),
    ("twin.draws", "0", "draws: 0 draws is outside"),
    ("twin.search_draws", "1000000", "search_draws: 1e+06 draws is outside"),
    ("twin.horizon_s", "100000000", "horizon_s: 1e+08 s is outside 1 to 86400 s"),
    ("twin.horizon_s", "1e8", "outside 1 to 86400 s"),
    ("twin.gain_error", "nan", "gain_error: nan"),
    ("twin.gain_error", "1.5", "outside 0 to 1"),
    ("twin.misled", "0.5", "misled: 0.5 (probability) is outside 0 to 0.4"),
    ("twin.misled", "nan", "misled: nan"),
    ("twin.size_error", "-0.1", "size_error: -0.1 (fraction) is outside 0 to 2"),
    ("twin.least_size_error", "inf", "least_size_error: inf"),
    ("twin.horizon_s", "86400", "judged_draws x horizon_s = 1036800 ticks, more than 1000000"),
    ("twin.stride", "0", "stride: 0 s is outside 1 to 3600 s"),
    ("twin.stride", "1000", "at most horizon_s = 900 s"),
    ("twin.replay_s", "-5", "replay_s: -5 s is outside 1 to 3600 s"),
    ("twin.recent_s", "100000", "recent_s: 100000 s is outside"),
    ("twin.synchronise_s", "0", "synchronise_s: 0 s"),
    ("twin.settle_rows", "700", "at most replay_s = 640"),
    ("twin.errors.T1", "[nan, 0.1]", "errors, T1"),
    ("twin.errors.T1", "[-0.5, 0.1]", "outside 0 to"),
    ("twin.errors.T1", "[0.5]", "at least 2 items are needed, and there are 1, as in T1 = [0.2, 0.5]"),
    ("twin.initial.T", "inf", "initial, T: inf"),
    ("twin.corrected", "[]", "twin, corrected: at least 1 items are needed, and there are 0; add what is meant"),
    ("objective.delivered", "[]", "objective, delivered: at least 1 items are needed, and there are 0"),
    ("run.end_s", "0.0", "end_s: 0 s is outside 10 to 604800 s"),
    ("run.end_s", "inf", "end_s: inf s is outside"),
    ("run.onset_s", "-1.0", "onset_s: -1 s"),
    ("run.onset_s", "6000.0", "onset_s = 6000 s must be before end_s = 6000 s"),
    ("objective.design_rate", "0.0", "design_rate: 0"),
    ("objective.per_s", "0.0", "per_s: 0 s is outside 1 to 604800 s"),
    ("objective.per_s", "604801.0", "per_s: 604801 s is outside"),
    ("objective.per_s", "nan", "per_s: nan"),
    ("objective.per_s", '"600"', "per_s: it must be a number, as in per_s = 600, without quotation marks"),
    ("objective.currency", '""', "currency: "),
    ("objective.currency", '"E U R"', "currency: "),
    ("objective.currency", '"thirteen-long"', "currency: "),
    ("objective.currency", "3", 'currency: it must be a text in quotation marks, as in currency = "3"'),
    ("objective.delivered", '"F1"', 'delivered: it must be a list in square brackets, as in delivered = ["F1"]'),
    ("twin.errors.T1", "3.5", "T1: it must be a list in square brackets, as in T1 = [0.2, 0.5], the noise"),
    ("twin.errors.T1", "[1, 2, 3]", "T1: at most 2 items may stand there, and there are 3, as in T1 = [0.2, 0.5]"),
    ("monitoring.sure", "1.2", "sure: 1.2 (probability) is outside 0.5 to 1"),
    ("monitoring.sure", "nan", "sure: nan"),
    ("monitoring.settle_s", "-1.0", "settle_s: -1 s"),
    ("monitoring.repeat_s", "0.0", "repeat_s: 0 s is outside 1 to 86400 s"),
    ("monitoring.evidence_s", "1e9", "evidence_s: 1e+09 s"),
    ("run.end_s", "true", "it must be a number"),
    ("run.end_s", '"6000"', "it must be a number, as in end_s = 6000"),
    ("model", '"os"', "model: 'os' is not written as 'module:class'"),
    ("system", '"no iri"', "system: 'no iri' is not written as an IRI"),
    ("title", '""', "title: "),
    ("twin.judged_drawz", "3", "there is no key 'judged_drawz'; did you mean 'judged_draws'"),
    ("run.onset", "3", "there is no key 'onset'; did you mean 'onset_s'"),
    ("tilte", '"x"', "there is no key 'tilte'; did you mean 'title'"),
]


@pytest.mark.parametrize(("key", "value", "words"), ABSURD, ids=lambda x: x if "." in x else "")
def test_an_absurd_value_is_one_line(key: str, value: str, words: str) -> None:
    with pytest.raises(PlantError) as caught:
        read(changed(key, value))
    message = str(caught.value)
    assert words in message and re.match(r"some/case\.toml line \d+: ", message) and "\n" not in message


def test_a_misspelt_key_comes_before_the_one_that_is_missing_by_it() -> None:
    with pytest.raises(PlantError, match=r"there is no key 'onsets'; did you mean 'onset_s'.*\(and 1 more\)$"):
        read(TEXT.replace("onset_s", "onsets", 1))


def test_what_nothing_follows_for_is_explained_where_it_is_missing() -> None:
    start = TEXT.index("[twin.initial]")
    with pytest.raises(
        PlantError, match=r"^some/case\.toml line \d+: twin: 'initial' is missing; state what smoothing may get"
    ):
        read(f"{TEXT[:start]}{TEXT[TEXT.index(chr(10) + '[', start) :]}")


@pytest.mark.parametrize("table", ["errors", "initial"])
def test_a_table_that_names_nothing_is_one_line(table: str) -> None:
    start = TEXT.index(f"[twin.{table}]")
    with pytest.raises(PlantError, match=rf"^some/case\.toml line \d+: twin, {table}: at least 1 items are needed"):
        read(f"{TEXT[:start]}[twin.{table}]{TEXT[TEXT.index(chr(10) + '[', start) :]}")


@pytest.mark.parametrize(
    "text",
    ["[twin", "twin = 3", "", "title = '\x00'", "a = " + "9" * 5000, "a = " + "[" * 5000, "twin = [[1]]", "\ud800"],
)
def test_what_are_no_settings(text: str) -> None:
    with pytest.raises(PlantError, match=r"^some/case\.toml") as caught:
        read(text)
    assert len(str(caught.value)) < 500


MISFITS = [
    ('started_by = "t_started"', 'started_by = "t_start"', "no transition 't_start'; did you mean 't_started'"),
    ('"T1.sp" = 310.0', '"T1.spp" = 310.0', "no tag that can be commanded 'T1.spp'; did you mean 'T1.sp'"),
    ('"T1.sp" = 310.0', '"T1" = 310.0', "no tag that can be commanded 'T1'"),
    ('"T1.sp" = 310.0', '"T1.sp" = 400.0', "start, T1.sp: 400 K is outside 296 to 313 K"),
    ('throughput = "F1"', 'throughput = "F11"', "no tag 'F11'; did you mean 'F1'"),
    ("design_rate = 0.0333333333333333", "design_rate = 5", "design_rate: 5 L/s is outside 8e-05 to 0.08 L/s"),
    ('delivered = ["product", "L1"]', 'delivered = ["produkt"]', "no quantity 'produkt'; did you mean 'product'"),
    ('delivered = ["product", "L1"]', 'delivered = ["L1", "L1"]', "quantity 'L1' is named twice"),
    ("L1 = [0.03, 0.03]", "L11 = [0.03, 0.03]", "twin, errors: the plant has no variable 'L11'; did you mean 'L1'"),
    ("L1 = [0.03, 0.03]", "L1 = [30, 0.03]", "twin, errors, L1: noise 30 L must be from 4e-06 to 4 L"),
    ("L1 = [0.03, 0.03]", "L1 = [0, 0.03]", "noise 0 L must be from"),
    ("L1 = [0.03, 0.03]", "L1 = [0.03, 5]", "model error 5 at most"),
    ("design_rate = 0.0333333333333333", "design_rate = 1e-8", "design_rate: 1e-08 L/s is outside 8e-05 to 0.08 L/s"),
    ("sure = 0.95", "review_s = 30000", "monitoring, review_s: 30000 s must be less than the run's end_s = 6000 s"),
    ("window = [0.0, 12.0]", "window = [0.0, 1e8]", "figure 'Level' has the window 0 to 1e+08 L"),
    ('corrected = ["T1", "L1"]', 'corrected = ["T1", "L2"]', "no variable with an entry in errors 'L2'"),
    ("V = 0.005", "V = 5000", "twin, initial, V: 5000 L must be at most 16 L, the widest range of a tag that is"),
    ("V = 0.005", "V = 0.0", "twin, initial, V: 0 must be more than 0, and finite"),
    ("V = 0.005", "VV = 0.005", "twin, initial: the plant has no state variable 'VV'; did you mean 'V'"),
    (
        "[twin.balances.T]",
        "[twin.balances.TT]",
        "cstr/case.toml: twin, balances, TT: the plant has no state variable 'TT'",
    ),
    ('component = "R1"', 'component = "R9"', "twin, balances, T: the plant has no component 'R9'; did you mean 'R1'"),
    ("cp / 1000 * max(L1, 1)", "cpp * L1", "no tag or parameter 'cpp'; did you mean 'cp'"),
    ("cp / 1000 * max(L1, 1)", "cp * (", "capacity 'cp * (': expression"),
    ("sure = 0.95", "settle_s = 6000", "must be less than the run's end_s = 6000 s"),
    ('tags = ["F1", "F2", "F1.sp"]', 'tags = ["F1", "F22"]', "did you mean 'F2'"),
]


@pytest.mark.parametrize(("old", "new", "words"), MISFITS, ids=[new for _, new, _ in MISFITS])
def test_a_setting_that_does_not_fit_the_plant(reactor: Copy, old: str, new: str, words: str) -> None:
    reactor.replace("case.toml", old, new)
    with pytest.raises(PlantError) as caught:
        reactor.load()
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "model",
    [
        "antigravity:geohash", "os:system", "homeostat.process.model:ProcessModel", "homeostat.plants.cstr:process",
        "homeostat.plants.csrt.process:REACTOR", "homeostat.plants.cstr.process:REACTORS",
        "homeostat.plants.cstr.process:Mapping", "homeostat.plants.cstr.process:advance",
        "homeostat.plants.teaching.learning:main", "homeostat.plants.cstr.__init__:x",
    ],
)  # fmt: skip
def test_only_what_an_installed_plant_provides_is_imported(reactor: Copy, model: str) -> None:
    before = set(sys.modules)
    reactor.replace("case.toml", "homeostat.plants.cstr.process:REACTOR", model)
    with pytest.raises(PlantError, match=r"nor a shipped plant provides|defines no process model") as caught:
        reactor.load()
    assert "\n" not in str(caught.value)
    assert not {"antigravity"} & (set(sys.modules) - before)


def numbers(table: Any, place: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Places of all numbers in the settings."""
    if isinstance(table, dict):
        return [found for key, value in table.items() for found in numbers(value, (*place, key))]
    return [place] if isinstance(table, int | float) else []


CONTENT = tomllib.loads(TEXT)
HOSTILE = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, -1, -1e-9, 10**400, -(10**400), 1e300, True, None, "5", [], {}]),
    st.dates(),
    st.text(max_size=200),
)


@given(place=st.sampled_from(numbers(CONTENT)), value=HOSTILE)
@settings(max_examples=200)
def test_whatever_stands_for_a_number_is_one_line(place: tuple[str, ...], value: Any) -> None:
    content = tomllib.loads(TEXT)
    table = content
    for key in place[:-1]:
        table = table[key]
    table[place[-1]] = value
    if place[0] == "start" and value in (-1, -1e-9, 1e300):
        return  # finite: what the plant says about the tag bounds it
    with pytest.raises(PlantError) as caught:
        read(_toml(content))
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 600


def _toml(value: Any, top: bool = True) -> str:
    if isinstance(value, dict):
        pairs = [f"{_toml(str(key), False)} = {_toml(item, False)}" for key, item in value.items()]
        return "\n".join(pairs) if top else "{" + ", ".join(pairs) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item, False) for item in value) + "]"
    if isinstance(value, str):
        return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08x}" for c in value) + '"'
    if isinstance(value, bool) or value is None:
        return str(value).lower()  # None is no TOML at all
    return value.isoformat() if hasattr(value, "isoformat") else _digits(value)


def _digits(value: float) -> str:
    return f"1{'0' * 400}" if value == 10**400 else f"-1{'0' * 400}" if value == -(10**400) else repr(value)


@pytest.mark.parametrize("name", ["cstr", "mixing_module"])
def test_the_installed_plants_are_as_their_files_say(name: str) -> None:
    plant = load_plant(name)
    content = tomllib.loads((INSTALLED / name / "case.toml").read_text(encoding="utf-8"))
    assert plant.remade == () and (plant.end_s, plant.onset_s) == (content["run"]["end_s"], content["run"]["onset_s"])
    assert plant.twin.errors == {k: tuple(v) for k, v in content["twin"]["errors"].items()}
    for table, filled in (("twin", plant.twin), ("monitoring", plant.monitoring), ("intervention", plant.intervention)):
        for key, value in content.get(table, {}).items():
            if isinstance(value, int | float):
                assert getattr(filled, key) == value


def test_what_prices_are_in_and_what_time_an_amount_is_made_in() -> None:
    objective = read(TEXT).objective
    assert (objective.currency, objective.production.per_s) == ("EUR", 1.0)
    batch = load_plant("mixing_module")
    assert (batch.prices.currency, batch.production.per_s) == ("EUR", 600.0)
    plain_text = "".join(line for line in TEXT.splitlines(keepends=True) if not line.startswith("currency"))
    assert read(plain_text).objective.currency == "units"


@pytest.mark.parametrize("table", ["intervention", "patience"])
def test_the_table_of_the_intervention_may_have_either_name(table: str) -> None:
    text = TEXT.replace("[intervention]\n", f"[{table}]\ncalm_s = 45.0\n")
    assert read(text).intervention.settings.calm_s == 45.0


def test_the_table_of_the_intervention_has_one_name() -> None:
    with pytest.raises(PlantError, match=r"\[patience\] and \[intervention\] are two names of one table; keep one"):
        read(f"{TEXT}\n[patience]\ncalm_s = 45.0\n")


def test_how_long_the_link_may_need_for_a_lease_is_the_plants_setting() -> None:
    assert read(TEXT).link.lease_within_s == load_plant("cstr").lease_within_s == 10.0
    assert read(f"{TEXT}\n[link]\nlease_within_s = 45.0\n").link.lease_within_s == 45.0
    for value in ("0.5", "601.0", "nan", "true", '"10"'):
        with pytest.raises(PlantError, match="lease_within_s"):
            read(f"{TEXT}\n[link]\nlease_within_s = {value}\n")


def test_the_guard_waits_for_a_lease_as_long_as_the_plant_states(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[GuardSettings] = []

    def guard(rules: Any, attachment: Any, settings: GuardSettings) -> Guard:
        made.append(settings)
        return Guard(rules, attachment, settings)

    monkeypatch.setattr(assembly, "Guard", guard)
    plant = replace(load_plant("cstr"), lease_within_s=45.0)
    wire(plant, None, DeclaredClock(1.0), MemoryTrace(), 1)
    assert [s.lease_within_s for s in made] == [45.0]


@pytest.mark.parametrize("name", sorted(RESERVED))
def test_a_total_is_reported_under_no_name_that_a_row_has_for_something_else(reactor: Copy, name: str) -> None:
    reactor.replace("case.toml", "[objective]\n", f'[objective]\nreported = ["{name}"]\n')
    reactor.replace("case.toml", "\n[twin]\n", f'\n[objective.totals]\n{name} = "T1"\n\n[twin]\n')
    with pytest.raises(PlantError, match=f"objective: reported names '{name}', which every row of a study has") as bad:
        reactor.load()
    assert "\n" not in str(bad.value) and f"{name}_L" in str(bad.value)
    refused(homeostat("graph", "check", "./cstr", cwd=reactor.folder.parent), f"reported names {name!r}")


def test_what_a_row_has_is_reserved_whatever_writes_it(tmp_path: Path) -> None:
    row = plain()
    with Ledger(tmp_path) as ledger:
        ledger.add("0" * 32, row)
    (line,) = (tmp_path / LEDGER).read_text().splitlines()
    assert set(json.loads(line)) <= RESERVED and {*columns_of(row), *(f.name for f in fields(Row))} <= RESERVED
    with pytest.raises(ValueError, match="reports a total 'fingerprint', which is another column"):
        plain(totals={"fingerprint": 1.0})
