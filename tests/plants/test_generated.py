"""Generated files: altered is refused, older than the sources is made again, absurd reference values are refused."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal import read_events
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.build.provenance import is_sealed, seal, with_one_line_end
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines
from homeostat.plants.files.folder import BASELINES, INSTALLED, read_files
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import load_plant
from homeostat.plants.teaching.learning import learned
from tests.cli.command import homeostat, refused
from tests.plants.copies import Copy

LIMITS = "engineering/limits.csv"


@pytest.fixture
def module(tmp_path: Path) -> Copy:
    return Copy.of("mixing_module", tmp_path)


@pytest.fixture
def reactor(tmp_path: Path) -> Copy:
    return Copy.of("cstr", tmp_path)


def sigma(copy: Copy, factor: float) -> None:
    """Every deviation within a run times ``factor``."""
    rows = [line.split(",") for line in copy.text(BASELINES).splitlines() if not line.startswith("#")]
    comments = [line for line in copy.text(BASELINES).splitlines() if line.startswith("#")]
    for row in rows[1:]:
        row[2] = f"{float(row[2]) * factor:.6g}"
    (copy.folder / BASELINES).write_text("\n".join([*map(",".join, rows), *comments]) + "\n")


def cell(copy: Copy, column: str, value: str | None) -> None:
    """Another value in one cell of the temperature's row; None takes the cell away."""
    lines = copy.text(BASELINES).splitlines()
    at = lines[0].split(",").index(column)
    number = next(k for k, line in enumerate(lines) if line.startswith("F-TEMPERATURE,"))
    cells = lines[number].split(",")
    cells[at : at + 1] = [] if value is None else [value]
    lines[number] = ",".join(cells)
    (copy.folder / BASELINES).write_text("\n".join(lines) + "\n")


ATTACKS: dict[str, tuple[str, Callable[[Copy], None]]] = {
    "limit widened": (GRAPH, lambda c: c.replace(GRAPH, '"T1 <= 313"', '"T1 <= 353"')),
    "limit widened, table unlike": (
        GRAPH,
        lambda c: (c.replace(GRAPH, '"T1 <= 313"', '"T1 <= 353"'), c.replace(LIMITS, "<= 313", "<= 314"))[0],
    ),
    "hard made soft": (GRAPH, lambda c: c.replace(GRAPH, "true", "false")),
    "seal cut off": (GRAPH, lambda c: (c.folder / GRAPH).write_text(c.text(GRAPH).rpartition("# sha256")[0])),
    "line added": (GRAPH, lambda c: (c.folder / GRAPH).write_text(c.text(GRAPH) + "<urn:a> <urn:b> 1 .\n")),
    "emptied": (GRAPH, lambda c: (c.folder / GRAPH).write_text("")),
    "sigma times 1e6": (BASELINES, lambda c: sigma(c, 1e6)),
    "sigma NaN": (BASELINES, lambda c: sigma(c, float("nan"))),
    "sigma a little": (BASELINES, lambda c: sigma(c, 1.1)),
    "row removed": (BASELINES, lambda c: c.replace(BASELINES, "\nF-MASS", "\n# F-MASS")),
}


@pytest.mark.parametrize(("file", "attack"), ATTACKS.values(), ids=ATTACKS)
def test_what_was_altered_is_refused_by_load_and_by_graph_check(
    reactor: Copy, tmp_path: Path, file: str, attack: Callable[[Copy], None]
) -> None:
    attack(reactor)
    before = reactor.text(file)
    with pytest.raises(GraphError, match=re.escape(file)) as caught:
        reactor.load()
    assert caught.value.code is Code.ALTERED and "\n" not in str(caught.value)
    assert reactor.text(file) == before  # not made again: somebody has to look
    refused(homeostat("graph", "check", "./cstr", cwd=tmp_path), "[altered]", file)


ABSURD: dict[str, Callable[[Copy], None]] = {
    "sigma times 1e6": lambda c: sigma(c, 1e6),
    "sigma by 1e6": lambda c: sigma(c, 1e-6),
    "sigma NaN": lambda c: sigma(c, float("nan")),
    "sigma infinite": lambda c: sigma(c, float("inf")),
    "sigma negative": lambda c: sigma(c, -1.0),
    "feature missing": lambda c: c.replace(BASELINES, "\nF-MASS", "\n# F-MASS"),
    "feature unknown": lambda c: c.replace(BASELINES, "\nF-MASS", "\nF-MAS"),
    "feature twice": lambda c: c.replace(BASELINES, "\nF-MASS", "\nF-LEVEL"),
    "mean far away": lambda c: cell(c, "mean", "-200"),
    "mean shifted": lambda c: cell(c, "mean", "-20"),
    "percentile swapped": lambda c: cell(c, "p99", "-0.4"),
    "no number": lambda c: cell(c, "p99", "much"),
    "cell too many": lambda c: cell(c, "p99", "0.45,1"),
    "cell missing": lambda c: cell(c, "p99", None),
    "header renamed": lambda c: c.replace(BASELINES, "within_sd", "within"),
}


@pytest.mark.parametrize("attack", ABSURD.values(), ids=ABSURD)
def test_absurd_reference_values_are_refused_also_with_a_new_hash(
    reactor: Copy, attack: Callable[[Copy], None]
) -> None:
    attack(reactor)
    reactor.reseal(BASELINES)
    with pytest.raises(GraphError) as caught:
        reactor.load()
    assert caught.value.code is Code.BAD_BASELINE and "\n" not in str(caught.value)


def test_graph_check_names_absurd_reference_values_and_settings(reactor: Copy, tmp_path: Path) -> None:
    sigma(reactor, 1e6)
    reactor.reseal(BASELINES)
    done = homeostat("graph", "check", "./cstr", cwd=tmp_path)
    assert done.status == 1 and "[bad-baseline] baseline.csv, feature 'F-COOLANT'" in done.out
    reactor.replace("case.toml", "judged_draws = 12", "judged_draws = -1")
    refused(homeostat("graph", "check", "./cstr", cwd=tmp_path), "judged_draws: -1 draws is outside 1 to 1000 draws")


def test_graph_check_sees_an_altered_graph_with_a_new_hash(reactor: Copy, tmp_path: Path) -> None:
    reactor.replace(GRAPH, '"T1 <= 313"', '"T1 <= 353"')
    reactor.reseal(GRAPH)
    done = homeostat("graph", "check", "./cstr", cwd=tmp_path)
    assert done.status == 1 and "plant.ttl: is not what its tables make" in done.out


@pytest.mark.slow
def test_what_is_made_again_is_said_to_the_person_and_in_the_first_event(reactor: Copy, tmp_path: Path) -> None:
    reactor.replace(LIMITS, "T1 <= 313", "T1 <= 312.9")
    checked = homeostat("graph", "check", "./cstr", cwd=tmp_path)
    assert f"run 'python -m homeostat.knowledge.build {reactor.folder}'" in checked.out
    done = homeostat("run", "./cstr", "--end", "20", "--out", "run", cwd=tmp_path)
    why = "table 'engineering/limits.csv' changed since it was made"
    assert done.err == f"homeostat: made again cstr/plant.ttl: {why}\n"
    started = next(iter(read_events(tmp_path / "run")))
    stated = {setting["name"]: setting["value"] for setting in started.fields["configuration"]}
    assert stated["made again plant.ttl"] == "it was older than its sources"
    again = homeostat("run", "./cstr", "--end", "20", "--out", "again", cwd=tmp_path)
    assert again.err == ""


def test_what_is_made_again_for_another_mapping_is_said_to_be_so(
    reactor: Copy, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    digest = re.search(r'"mapping.rml.ttl" ;\s+hs:sha256 "([0-9a-f]{64})"', reactor.text(GRAPH))
    assert digest is not None
    reactor.replace(GRAPH, digest[1], "0" * 64)
    reactor.reseal(GRAPH)
    checked = homeostat("graph", "check", "./cstr", cwd=tmp_path)
    assert "[stale-graph] the package's mapping: changed after the graph was built" in checked.out
    assert reactor.load().remade == (GRAPH,)
    assert caplog.messages == ["made again cstr/plant.ttl: the package's mapping changed since it was made"]


def test_what_is_made_again_says_what_changed(reactor: Copy, caplog: pytest.LogCaptureFixture) -> None:
    for table in ("limits", "faults", "criteria", "sensors", "states"):
        path = reactor.folder / f"engineering/{table}.csv"
        path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    reactor.load()
    tables = "table 'engineering/criteria.csv', table 'engineering/faults.csv', table 'engineering/limits.csv'"
    assert caplog.messages == [f"made again cstr/plant.ttl: {tables} and 2 more changed since it was made"]
    caplog.clear()
    (reactor.folder / GRAPH).unlink()
    reactor.load()
    assert caplog.messages == ["made again cstr/plant.ttl: there was none"]


def test_a_changed_table_takes_effect_at_the_next_load(reactor: Copy) -> None:
    configuration = reactor.load().configuration
    reactor.replace(LIMITS, "T1 <= 313", "T1 <= 312.9")
    plant = reactor.load()
    assert plant.remade == (GRAPH,) and plant.configuration != configuration
    assert "T1 <= 312.9" in {str(limit.formula) for limit in plant.description.limits.limits}
    assert '"T1 <= 312.9"' in reactor.text(GRAPH) and is_sealed(reactor.text(GRAPH).encode())
    again = reactor.load()
    assert (again.remade, again.configuration) == ((), plant.configuration)


PRICES = "engineering/prices.csv"


def test_a_folder_without_prices_has_every_price_by_default(reactor: Copy) -> None:
    (reactor.folder / PRICES).unlink()
    plant = reactor.load()
    d, hour = plant.description, plant.production.design_rate * 3600.0
    assert plant.remade == (GRAPH,) and d.prices == ()
    assert (plant.prices.product, plant.prices.currency) == (1.0, "EUR")
    assert plant.prices.release == pytest.approx(hour / 400.0)
    assert plant.prices.states == pytest.approx({s.name: 0.01 * s.risk * hour for s in d.machine.states})
    assert plant.prices.outside == pytest.approx({rule.name: 0.1 * hour for rule in d.limits.priced})
    assert plant.prices.violation == pytest.approx({limit.name: hour for limit in d.limits.hard})
    assert (
        reactor.load().remade == () and homeostat("graph", "check", str(reactor.folder), cwd=reactor.folder).status == 0
    )


def test_prices_that_are_lost_found_or_changed_are_in_the_next_graph(
    reactor: Copy, caplog: pytest.LogCaptureFixture
) -> None:
    table, graph = reactor.text(PRICES), reactor.text(GRAPH)
    said = [f"made again cstr/plant.ttl: table '{PRICES}' changed since it was made"]
    (reactor.folder / PRICES).unlink()
    without = reactor.load()
    assert (without.remade, caplog.messages, PRICES in reactor.text(GRAPH)) == ((GRAPH,), said, False)
    (reactor.folder / PRICES).write_text(table, encoding="utf-8")
    found = reactor.load()
    assert (found.remade, caplog.messages) == ((GRAPH,), said * 2)
    assert reactor.text(GRAPH) == graph and found.configuration != without.configuration
    reactor.replace(PRICES, "state,holding,6,", "state,holding,60,")
    changed = reactor.load()
    assert (changed.remade, caplog.messages) == ((GRAPH,), said * 3)
    assert changed.prices.states["holding"] == 60.0 and reactor.load().remade == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "state,holding,",
            "state,holdng,",
            "there is no state 'holdng'; did you mean 'holding'",
        ),
        ("criterion,ACC-T,", "criterion,ACC-T-HIGH,", "there is no soft criterion or envelope 'ACC-T-HIGH'"),
        ("limit,LIM-T-HIGH,", "limit,LIM-T-LOW,", "there is no hard limit 'LIM-T-LOW'"),
        ("limit,LIM-T-HIGH,", "lmit,LIM-T-HIGH,", "kind: 'lmit' is none of"),
        ("state,holding,6", "state,holding,-6", "price: '-6' is outside 0 to 1e+09"),
        ("state,holding,6", "state,holding,nan", "price: 'nan' is "),
        (
            "state,shutdown,",
            "state,holding,",
            "prices.csv row 7 ('state holding'): kind and item are those of row 6",
        ),
        ("release,release,", "product,by-product,", "is a second price of product; keep one row"),
    ],
)
def test_a_price_that_cannot_be_is_one_line(reactor: Copy, old: str, new: str, words: str) -> None:
    reactor.replace(PRICES, f"\n{old}", f"\n{new}")
    with pytest.raises((GraphError, PlantError)) as caught:
        reactor.load()
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_folder_that_cannot_be_written_is_loaded_as_its_tables_say(
    module: Copy, caplog: pytest.LogCaptureFixture
) -> None:
    before = module.text(GRAPH)
    module.replace("engineering/faults.csv", "Clogging of the main line", "Clogged main line")
    (module.folder / f".{GRAPH}.{os.getpid()}.partial").mkdir()  # stands where the new graph is to be written first
    plant = module.load()
    assert plant.remade == (GRAPH,) and module.text(GRAPH) == before
    assert "it is not kept, because" in caplog.text
    assert plant.description.fault("clogging_main").label == "Clogged main line"
    assert is_sealed(plant.files.contents[GRAPH])


def test_a_table_that_makes_no_plant_is_refused(reactor: Copy) -> None:
    before = reactor.text(GRAPH)
    reactor.replace(LIMITS, "T1 <= 313", "T11 <= 313")
    with pytest.raises(GraphError, match="T11"):
        reactor.load()
    assert reactor.text(GRAPH) == before


def test_reference_values_follow_what_they_were_learned_from(module: Copy) -> None:
    sources = baseline_sources(module.load())
    module.replace("case.toml", "end_s = 600.0", "end_s = 580.0")
    plant = module.load()
    assert plant.remade == (BASELINES,) and baseline_sources(plant) != sources
    assert plant.baselines != load_plant("mixing_module").baselines
    assert module.load().remade == ()


def test_what_was_never_learned_says_how(module: Copy) -> None:
    (module.folder / BASELINES).unlink()
    remedy = re.escape(f"learn them: homeostat plant learn {module.folder}")
    with pytest.raises(PlantError, match=f"no reference values yet; {remedy}$"):
        module.load()
    content = learned(load_plant(str(module.folder), learned=False))
    assert content == (INSTALLED / "mixing_module" / BASELINES).read_bytes()


def test_the_digest_knows_every_file_and_no_place(reactor: Copy, tmp_path: Path) -> None:
    digest = load_plant("cstr").configuration
    assert re.fullmatch("[0-9a-f]{64}", digest) and reactor.load().configuration == digest
    for name in read_files(reactor.folder).contents:  # as a checkout on another system has it
        path = reactor.folder / name
        path.write_bytes(with_one_line_end(path.read_bytes()).replace(b"\n", b"\r\n"))
    plant = reactor.load()
    assert plant.configuration == digest and plant.remade == ()
    reactor.replace("case.toml", "onset_s = 2000.0", "onset_s = 2000.1")
    assert reactor.load().configuration != digest


@given(content=st.binary(max_size=400), at=st.integers(0, 399), byte=st.integers(0, 255))
def test_a_seal_sees_every_changed_byte(content: bytes, at: int, byte: int) -> None:
    body = with_one_line_end(content.replace(b"\r", b"")) + b"\n"
    sealed = seal(body)
    assert is_sealed(sealed)
    at %= len(body)
    other = sealed[:at] + bytes([byte]) + sealed[at + 1 :]
    if with_one_line_end(other) != sealed:
        assert not is_sealed(other)


CSTR = load_plant("cstr")
FILE = CSTR.files.contents[BASELINES].decode()


@given(text=st.text(alphabet=',\n#-."0123456789eEnaif', max_size=12), at=st.integers(0, len(FILE)))
def test_any_text_is_read_or_refused(text: str, at: int) -> None:
    try:
        found = read_baselines((FILE[:at] + text + FILE[at:]).encode(), CSTR.description)
    except GraphError as error:
        assert "\n" not in str(error)
    else:
        assert set(found) == set(CSTR.baselines)
