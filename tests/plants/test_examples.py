"""The plants in `examples/`: short, clean, as worked out by hand, and looked after whatever of theirs fails."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.lint.deep.course import Course, Setting, run
from homeostat.evaluate.runner import run as supervised
from homeostat.evaluate.scenario import Fault, ScenarioError, departing, scenario_of
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant
from homeostat.plants.teaching.learning import learned
from tests.cli.command import homeostat

EXAMPLES = Path(__file__).parents[2] / "examples"
GENERATED = ("plant.ttl", "baseline.csv")
NAMES = sorted(folder.name for folder in EXAMPLES.iterdir() if (folder / "case.toml").exists())
MOST_LINES = 300
NOT_LOOKED_AFTER = {Outcome.LIMIT_VIOLATED, Outcome.FALLBACK, Outcome.NOT_DETECTED}
ONLY_THE_FALLBACK = {("heated_batch", "V1_stuck_open")}
"""Where nothing else is left: a vessel that fills is emptied, and what leaves is no product."""


def copied(name: str, where: Path) -> Path:
    """The example as somebody has it who has just written it."""
    return Path(shutil.copytree(EXAMPLES / name, where / name, ignore=shutil.ignore_patterns(*GENERATED)))


def course(name: str, where: Path, end_s: float, *faults: FaultState) -> Course:
    """What it does by its best estimates without noise while nobody acts."""
    plant = load_plant(str(copied(name, where)), learned=False, kept=False)
    return run(plant, Setting(plant.true_parameters(1, spread=0.0), faults=faults, end_s=end_s))


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


def at_last(found: Course, by_hand: Mapping[str, float], rel: float = 5e-3) -> None:
    """The true values at the end are those that are worked out by hand."""
    assert {tag: float(found.true(tag)[-1]) for tag in by_hand} == pytest.approx(by_hand, rel=rel, abs=1e-6)


def test_there_is_one_of_each_kind() -> None:
    assert NAMES == ["buffer_pumps", "exchanger_train", "heated_batch", "instrument_air", "two_tanks"]


@pytest.mark.parametrize("name", NAMES)
def test_it_is_short_and_nothing_in_it_is_generated(name: str) -> None:
    written = [p for p in (EXAMPLES / name).rglob("*") if p.suffix in (".py", ".csv", ".toml")]
    lines = {p: len(p.read_text("utf-8").splitlines()) for p in written if p.name not in GENERATED}
    assert sum(lines.values()) <= MOST_LINES
    assert {p.parent.name for p in lines if p.suffix == ".csv"} == {"engineering"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["heated_batch", "two_tanks", *(pytest.param(name, marks=pytest.mark.wide) for name in NAMES[:2] + NAMES[3:4])],
)
def test_its_tables_agree_with_its_model(name: str, tmp_path: Path) -> None:
    copied(name, tmp_path)
    done = homeostat("plant", "check", f"./{name}", cwd=tmp_path)
    assert (done.status, done.out) == (0, f"./{name}: clean\n")


@pytest.mark.usefixtures("plain")
def test_two_pumps_share_the_load_as_their_curve_says(tmp_path: Path) -> None:
    """4 bar and 0.25 L/s each: n = sqrt((4 + 4 * 0.25^2) / 6); V2 passes 0.5 L/s = 0.6 u sqrt(4)."""
    speed = math.sqrt((4.0 + 4.0 * 0.25**2) / 6.0)
    shared = {"p": 4.0, "F2": 0.5, "F3": 0.25, "F4": 0.25, "P1.pos": speed, "P2.pos": speed, "V2.pos": 0.5 / 1.2}
    at_last(course("buffer_pumps", tmp_path, 600.0), shared)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("stuck", ["P1", "P2"])
def test_a_pump_at_full_speed_takes_all_of_the_load(stuck: str, tmp_path: Path) -> None:
    """6 - 4 * 0.5^2 = 5 bar, against which the other one, whose check valve closes, gives nothing."""
    own, other = ("F3", "F4") if stuck == "P1" else ("F4", "F3")
    found = course("buffer_pumps", tmp_path, 800.0, FaultState(f"{stuck}_stuck_open", 1.0, 300.0))
    at_last(found, {"p": 5.0, "F2": 0.5, own: 0.5, other: 0.0})


@pytest.mark.usefixtures("plain")
def test_the_train_passes_the_heat_that_its_feed_takes_up(tmp_path: Path) -> None:
    """C = 2.09 kW/K; 62.7 kW over 8 kW/K are 7.84 K, and 73.15 kW over 1.5 kW/K are 48.77 K."""
    waste, oil = 62.7 / (4.18 * (98.0 - 52.84)), 73.15 / (2.2 * (200.0 - 128.77))
    by_hand = {"T1": 45.0, "T2": 80.0, "T3": 52.84, "T4": 128.77, "F1": 0.5, "F2": waste, "F3": oil}
    at_last(course("exchanger_train", tmp_path, 1200.0), by_hand)


@pytest.mark.usefixtures("plain")
def test_the_phases_of_the_batch_take_the_times_that_are_worked_out_by_hand(tmp_path: Path) -> None:
    """61 L, as the valve needs 2 s: filled at 0.5 L/s, heated by 40 kW to 69 degC, cooled by 2.5 kW/K of water."""
    found = course("heated_batch", tmp_path, 900.0)
    assert [state for state, _ in found.states] == ["filling", "heating", "reacting", "cooling", "emptying", "complete"]
    took = {state: end_s - at_s for (state, at_s), (_, end_s) in pairwise(found.states)}
    assert took["filling"] == pytest.approx((60.0 - 5.0) / 0.5, abs=4.0)
    assert took["heating"] == pytest.approx(61.0 * 4.18 * 49.0 / 40.0, rel=0.06)
    assert took["cooling"] == pytest.approx(61.0 * 4.18 / 2.5 * math.log(55.0 / 20.0), rel=0.08)
    assert took["emptying"] == pytest.approx((61.0 - 5.0) / 1.0, abs=7.0)
    at_70 = 2.05e7 * math.exp(-60_000.0 / (8.314462618 * 343.15))
    reacting = found.after(found.states[2][1]) & ~found.after(found.states[3][1])
    a = found.true("A1")[reacting]
    assert math.log(a[0] / a[-1]) / (len(a) - 1) == pytest.approx(at_70, rel=0.05)
    assert float(found.true("made")[-1]) > 0.9 * 55.0


@pytest.mark.wide
@pytest.mark.timeout(600)
def test_an_outlet_is_opened_further_where_few_members_overflow(tmp_path: Path) -> None:
    """What lets out just as much as comes in overflows in some of the validation's members, and in none that the search
    sees: the fallback acted, where opening the valve a little further does."""
    folder = copied("heated_batch", tmp_path)
    setpoints = folder / "engineering" / "setpoints.csv"
    setpoints.write_text(
        setpoints.read_text("utf-8").replace("passing,V3.cmd,0.6,1,1", "passing,V3.cmd,0.3,1,1"), "utf-8"
    )
    (folder / "baseline.csv").write_bytes(learned(load_plant(str(folder), learned=False)))
    plant = load_plant(str(folder))
    chosen = scenario_of(plant, [Fault("V1_stuck_open")], seed=1)
    done = supervised(plant, chosen, clock=DeclaredClock(1.0)).result(Path())
    assert sum(limit.total_s for limit in done.limit_exposure_s) == 0.0 and done.outcome is not Outcome.FALLBACK


@pytest.mark.usefixtures("plain")
def test_the_air_is_as_lean_as_its_analyser_says(tmp_path: Path) -> None:
    """21 % times the supply is 17 % of 6 mol/s; each valve passes Kv u sqrt(dp), and the motor takes 0.8 F p."""
    supply = 6.0 * 0.17 / 0.21
    by_hand = {"P1": 9.0, "P2": 6.0, "A1": 0.17, "F2": supply, "F5": 6.0 - supply, "J1": 0.8 * supply * 9.0}
    opened = {"C1.pos": supply / 12.0, "V1.pos": supply / (8.0 * math.sqrt(3.0)), "V3.pos": 0.0}
    at_last(course("instrument_air", tmp_path, 1500.0), by_hand | opened | {"V4.pos": 1.0 / math.sqrt(6.0)})


def test_a_setpoint_that_a_controller_sets_is_nobodys_to_disturb(tmp_path: Path) -> None:
    """Its reading has no value that anything could be added to: the run would say that nothing happened."""
    plant = load_plant(str(copied("instrument_air", tmp_path)), learned=False, kept=False)
    chosen = scenario_of(plant, (), 1, None)
    assert departing(plant, chosen, ("A1.sp - 0.02 from 1500",)).disturbances
    with pytest.raises(ScenarioError, match=r"no parameter or commanded tag 'F5\.sp'"):
        departing(plant, chosen, ("F5.sp + 0.1 from 1500",))


@pytest.mark.wide
@pytest.mark.parametrize("name", NAMES)
def test_a_deep_check_finds_nothing(name: str, tmp_path: Path) -> None:
    copied(name, tmp_path)
    done = homeostat("plant", "check", f"./{name}", "--deep", cwd=tmp_path)
    assert done.status == 0 and ": error:" not in done.out and ": warning:" not in done.out, done.out


@pytest.mark.wide
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", NAMES)
def test_search_looks_after_it_whatever_fails(name: str, tmp_path: Path) -> None:
    folder = copied(name, tmp_path)
    (folder / "baseline.csv").write_bytes(learned(load_plant(str(folder), learned=False)))
    plant = load_plant(str(folder))
    hard = {limit.name for limit in plant.description.limits.hard}
    quiet = supervised(plant, scenario_of(plant, [], seed=1), clock=DeclaredClock(1.0)).result(Path())
    assert (quiet.outcome, quiet.detected_s) == (Outcome.NO_ACTION, None)
    for fault in plant.model.faults:
        done = supervised(plant, scenario_of(plant, [Fault(fault)], seed=1), clock=DeclaredClock(1.0)).result(Path())
        assert sum(each.total_s for each in done.limit_exposure_s if each.limit in hard) == 0.0, fault
        assert done.outcome not in NOT_LOOKED_AFTER or (name, fault) in ONLY_THE_FALLBACK, (fault, done.outcome)
