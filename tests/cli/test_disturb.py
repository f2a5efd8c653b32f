"""Runs of a true plant that no table describes: how they are asked for, told, kept, shown again and refused."""

import json
from pathlib import Path

import pytest

import homeostat as hs
from homeostat.evaluate.recorded.resumption import Past
from homeostat.evaluate.scenario import ScenarioError
from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import load_plant
from tests.cli.command import homeostat

HOT = "T_coolant + 10 from 700"
SHORT = ("run", "cstr", "--end", "900", "--thinking-declared", "1", "--out", "run")


def test_what_happens_to_the_true_plant_is_told_kept_and_shown_again(tmp_path: Path) -> None:
    asked = (*SHORT, "--disturb", HOT, "--disturb", "T2 reads * 1.01 from 750", "--mismatch", "plant")
    done = homeostat(*asked, cwd=tmp_path)
    assert done.err in ("", "homeostat: compiling, once\n") and f"onset     {HOT} (ground truth)" in done.out
    assert "Disturbed   T_coolant + 10 from 700; T2 reads * 1.01 from 750" in done.out
    assert "Mismatch    plant" in done.out and verify(tmp_path / "run").complete
    kept = json.loads((tmp_path / "run" / "result.json").read_text())
    assert kept["fault"] is None and kept["mismatch"] == "plant" and kept["onset_s"] == 700.0
    assert kept["disturbances"] == [HOT, "T2 reads * 1.01 from 750"]
    again = homeostat("replay", "run", cwd=tmp_path)
    assert (again.status, again.out) == (0, done.out)
    assert json.loads(homeostat("replay", "run", "--json", cwd=tmp_path).out) == kept


def test_a_run_that_goes_on_has_the_true_plant_that_it_began_with(tmp_path: Path) -> None:
    homeostat(*SHORT, "--disturb", HOT, "--mismatch", "plant", cwd=tmp_path)
    kept = [record for record in read_events(tmp_path / "run") if record.kind != "run-finished"]
    scenario = Past.of(kept).scenario(load_plant("cstr"))
    assert [str(d) for d in scenario.disturbances] == [HOT] and scenario.mismatch == "plant"


def test_a_fault_and_a_disturbance_come_together(tmp_path: Path) -> None:
    both = ("--fault", "pump_degrade", "--onset", "800", "--disturb", HOT, "--json")
    kept = json.loads(homeostat(*SHORT, *both, cwd=tmp_path).out)
    assert kept["fault"] == "pump_degrade" and kept["disturbances"] == [HOT] and kept["onset_s"] == 700.0


def test_equal_seeds_disturb_equally(tmp_path: Path) -> None:
    one, other = (
        homeostat(*SHORT[:-1], name, "--disturb", "T1 noise * 5", "--mismatch", "plant", "--json", cwd=tmp_path)
        for name in ("one", "other")
    )
    events = [[(r.at_s, r.kind) for r in read_events(tmp_path / name)] for name in ("one", "other")]
    assert one.status == other.status and events[0] == events[1]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("--disturb", "nonsense"), "disturbance 'nonsense' cannot be understood; say NAME + 10"),
        (("--disturb", "T_coolnt + 3"), "no parameter or commanded tag 'T_coolnt'; did you mean 'T_coolant'"),
        (("--disturb", "T_coolant + 3 from 900"), "must begin in the run, 0 s to 900 s; choose an earlier begin"),
        (("--disturb", "UA * 0.5 every 1"), "acts at no whole second of the run"),
        (("--disturb", "UA * 0.5 from 100.2 to 100.8"), "acts at no whole second of the run"),
        (("--mismatch", "real"), "no mismatch 'real'; there are: 'none', 'plant', 'twice'"),
    ],
)
def test_what_the_plant_cannot_have_is_refused_before_anything_is_made(
    tmp_path: Path, given: tuple[str, ...], words: str
) -> None:
    done = homeostat(*SHORT, *given, cwd=tmp_path)
    assert done.status == 2 and words in done.err and done.err.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_plant_that_breaks_ends_the_run_in_one_line_with_a_closed_record(tmp_path: Path) -> None:
    done = homeostat(*SHORT, "--disturb", "cp * 0 from 500", cwd=tmp_path)
    assert done.status == 2 and done.err.splitlines()[-1].startswith("homeostat: the simulated plant left the physical")
    assert "disturb it less" in done.err and "Traceback" not in done.err
    assert verify(tmp_path / "run").complete
    assert [r.fields["outcome"] for r in read_events(tmp_path / "run") if r.kind == "run-finished"] == ["broken"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"disturb": None}, "disturbances None must be a list of texts"),
        ({"disturb": 5}, "disturbances 5 must be a list of texts"),
        ({"disturb": [3]}, "disturbance 3 is no text"),
        ({"mismatch": ["plant"]}, "must be a name, or 'none'"),
        ({"disturb": ["cp * 0"], "end_s": 50.0}, "left the physical world"),
    ],
)
def test_from_python_the_same_is_refused_in_the_same_words(given: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        hs.run("cstr", **given)  # type: ignore[arg-type]


def test_the_figure_marks_what_begins(tmp_path: Path) -> None:
    both = ("--disturb", "T2 reads + 0.1 from 650", "--disturb", "T_ambient + 1 from 800")
    homeostat(*SHORT, *both, cwd=tmp_path)
    assert (tmp_path / "run" / "figure.png").stat().st_size > 10_000
