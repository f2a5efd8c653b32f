"""The study of unknown causes: what is run with everything on, beside one another, and what is kept of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, replace
from operator import attrgetter
from pathlib import Path

import pytest

from benchmarks.unknown import store, strategies
from benchmarks.unknown.__main__ import main
from benchmarks.unknown.bars import Study, bars
from benchmarks.unknown.causes import Cause, forced_labels, pairs, what_changes
from benchmarks.unknown.forced import Forced, is_caught
from benchmarks.unknown.jobs import SEEDS, Job, jobs, scenario_of, to_operate
from benchmarks.unknown.judge import Statement
from benchmarks.unknown.judging import Judged
from benchmarks.unknown.operated import Operated
from benchmarks.unknown.page import page
from benchmarks.unknown.pairs import Paired, first_seen_s
from benchmarks.unknown.running import operate, results
from benchmarks.unknown.sizes import sized, true_size
from benchmarks.unknown.strategies import kept_by
from benchmarks.unknown.tally import Look, answers
from benchmarks.unknown.workers import RunsFailed, each
from homeostat.domain.diagnosis import FaultState
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.evaluate.score.scoring import outside_after
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant

MIXER = "mixing_module"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(store, "FOLDER", tmp_path)
    yield tmp_path


def wanted(plant: str, part: str) -> list[Job]:
    return list(jobs(load_plant(plant), [part], [], [], "plant"))


def test_every_pair_of_the_reactor_and_sixty_of_the_module() -> None:
    reactor, module = wanted("cstr", "pairs"), wanted(MIXER, "pairs")
    assert len({job.name for job in reactor}) == 36 * 3 and len({job.name for job in module}) == 60
    items = {f.name: f.component for f in load_plant(MIXER).description.faults}
    for job in module:
        first, second = job.cause.faults
        assert items[first.fault] != items[second.fault], "what is stuck closed is not stuck open"
    truth = scenario_of(load_plant("cstr"), reactor[0])
    assert truth.fault == reactor[0].cause.id == "cool_stuck_closed+cool_stuck_open" and truth.mismatch == "plant"
    assert len({fault.onset_s for fault in truth.faults}) == 2
    assert pairs(load_plant(MIXER), 401) == pairs(load_plant(MIXER), 401) != pairs(load_plant(MIXER), 402)


@pytest.mark.parametrize(("plant", "count"), [("cstr", 72), (MIXER, 34)])
def test_every_fault_is_told_to_be_another_one(plant: str, count: int) -> None:
    nominal = {f.name: f.severity_nominal for f in load_plant(plant).description.faults}
    found = forced_labels(load_plant(plant), 401)
    assert len(found) == len({cause.id for cause in found}) == count
    for cause in found:
        assert cause.told is not None and cause.told.fault != cause.fault
        assert cause.told == FaultState(cause.told.fault, nominal[cause.told.fault], cause.onset_s)
        assert cause.severity == nominal[cause.fault]


def test_the_study_is_as_large_as_it_was_asked_to_be() -> None:
    harmless = [*wanted("cstr", "harmless"), *wanted(MIXER, "harmless")]
    assert len(harmless) >= 340, "on some true plants noise alone violates a criterion, and their runs do not count"
    assert len(SEEDS["pairs"]) == 3 and len(wanted("cstr", "forced")) == 72 * 3
    assert len({one.name for one in wanted(MIXER, "forced")}) >= 100
    operated = to_operate([*wanted("cstr", "unknown"), *wanted("cstr", "known"), *wanted("cstr", "day")])
    assert {job.part for job in operated} == {"unknown", "day"} and not any(job.cause.known for job in operated)


def job(cause: Cause, part: str = "unknown", plant: str = "cstr") -> Job:
    return Job(plant, part, cause, 1, "plant")


LEAK = FaultState("leak", 0.01, 2000.0)
TOLD = (job(Cause("b", "pair", also=LEAK)), job(Cause("a", "pair")), job(Cause("c", "pair")))


@pytest.mark.parametrize("processes", [1, 2])
def test_what_is_found_does_not_depend_on_how_many_processes_find_it(processes: int) -> None:
    found = dict(each(attrgetter("truth"), TOLD, processes))
    assert found == {one: one.truth for one in TOLD}


@pytest.mark.parametrize("processes", [1, 2])
def test_a_run_that_breaks_is_told_and_does_not_end_the_others(
    processes: int, capsys: pytest.CaptureFixture[str]
) -> None:
    found = {}
    with pytest.raises(RunsFailed, match="2 of 3 runs failed"):
        for one, fault in each(attrgetter("cause.also.fault"), TOLD, processes):
            found[one.name] = fault
    assert found == {TOLD[0].name: "leak"}
    assert f"{TOLD[1].name} failed: " in capsys.readouterr().out


def test_a_torn_line_takes_no_other_with_it(folder: Path) -> None:
    store.keep(store.PAIRED, TOLD[0], {"run": TOLD[0].name, "outside": ("LIM-T-HIGH",)})
    path = store.path_of(store.PAIRED)
    path.write_text(path.read_text() + '{"run": "torn')
    store.keep(store.PAIRED, TOLD[1], {"run": TOLD[1].name})
    assert list(store.kept(store.PAIRED, TOLD)) == [
        (TOLD[0], {"run": TOLD[0].name, "outside": ("LIM-T-HIGH",)}),
        (TOLD[1], {"run": TOLD[1].name}),
    ]


def test_what_was_found_of_another_truth_is_not_in(folder: Path) -> None:
    store.keep(store.PAIRED, TOLD[0], {"run": TOLD[0].name})
    other = replace(TOLD[0], cause=replace(TOLD[0].cause, also=FaultState("leak", 0.02, 2000.0)))
    assert other.name == TOLD[0].name and not list(store.kept(store.PAIRED, [other]))


@pytest.mark.parametrize(
    ("cause", "said", "at_s", "expected"),
    [
        (Cause("x", "x", "TT1", spec="T1 reads - 5 from 2000"), "T1_reads_low", 2100.0, 5.0),
        (Cause("x", "x", "TT1", spec="T1 reads - 5 from 2000"), "T1_reads_high", 2100.0, -5.0),
        (Cause("x", "x", "TT1", spec="T1 reads + 4 from 2000"), "temp_bias", 2100.0, 4.0),
        (Cause("x", "x", "LT1", spec="L1 reads + 0.7 from 2000"), "level_bias", 2100.0, -0.7),
        (Cause("x", "x", "FT1", spec="F1 reads * 0.8 from 2000"), "F1_reads_low", 2100.0, 0.2),
        (Cause("x", "x", "FT1", spec="F1 reads + 0.006 from 2000"), "F1_reads_high", 2100.0, None),
        (Cause("x", "x", "ZT2", spec="V2.pos reads + 0.15 from 2000"), "V2.pos_reads_high", 2100.0, 0.15),
        (Cause("x", "x", "TT1", spec="T1 reads - 3 from 1800 over 1000"), "T1_drifts_down", 2000.0, 0.003),
        (Cause("x", "x", "TT1", spec="T1 reads - 3 from 1800 over 1000"), "T1_reads_low", 2000.0, None),
        (Cause("x", "x", "TT1", spec="T1 reads - 3 from 1800 over 1000"), "T1_reads_low", 2900.0, 3.0),
        (Cause("x", "x", "TT1", spec="T1 reads + 3 from 2000 every 300"), "T1_reads_high", 2075.0, None),
        (Cause("x", "x", "TT1", spec="T1 reads - 4 from 2000 to 2200"), "T1_reads_low", 2100.0, None),
        (Cause("x", "x", "TT1", spec="T1 frozen from 2000"), "T1_frozen", 2100.0, None),
        (Cause("x", "x", "P1", spec="K_P1 * 0.8 from 2000"), "pump_degrade", 2100.0, 0.2),
        (Cause("x", "x", "P1", spec="K_P1 * 0.8 from 2000"), "outlet_block", 2100.0, None),
        (Cause("x", "x", "R1", spec="T_ambient - 40 from 2000"), "unknown_heat_R1_T_ambient", 2100.0, -40.0),
        (Cause("x", "x", "R1", spec="T_ambient + 40 from 2000 over 400"),
         "unknown_heat_R1_T_ambient_growing", 2100.0, 0.1),
        (Cause("x", "x", "R1", spec="T_ambient - 40 from 2000"), "unknown_heat_R1", 2100.0, None),
        (Cause("leak", "known", "R1", fault="leak", severity=0.01, onset_s=2000.0), "leak", 2100.0, 0.01),
        (Cause("leak", "known", "R1", fault="leak", severity=0.01, onset_s=2000.0), "unknown_mass_R1", 2100.0, None),
        (Cause("none", "healthy"), "leak", 2100.0, None),
    ],
)  # fmt: skip
def test_true_sizes_are_known_where_what_happened_has_one(
    cause: Cause, said: str, at_s: float, expected: float | None
) -> None:
    plant = load_plant("cstr")
    mode = next(m for m in plant.description.fault_modes if m.name == said)
    found = true_size(plant, job(cause), Statement(said, mode.component, "", 1.0), mode, at_s)
    assert found == (None if expected is None else pytest.approx(expected))


def test_a_factor_on_a_parameter_is_a_change_of_what_it_truly_is() -> None:
    plant = load_plant("cstr")
    mode = next(m for m in plant.description.fault_modes if m.name == "unknown_heat_R1_UA")
    at = [
        true_size(plant, replace(job(Cause("x", "x", "J1", spec="UA * 0.7 from 2000")), seed=seed),
                  Statement(mode.name, "J1", "", 1.0), mode, 2100.0)
        for seed in (1, 2)
    ]  # fmt: skip
    assert at[0] != at[1] and all(size == pytest.approx(-150.0, rel=0.1) for size in at if size is not None)


def test_what_a_fault_of_the_tables_changes_is_there() -> None:
    for plant in ("cstr", MIXER):
        d = load_plant(plant).description
        assert set(what_changes(plant)) <= {fault.name for fault in d.faults}
        names = {*d.tags_by_name, *load_plant(plant).model.parameters}
        assert all(change["name"] in names for change in what_changes(plant).values())


def look(said: Statement, cause: Cause, part: str = "unknown") -> Look:
    return Look(job(cause, part), Judged(job(cause, part).name, 0, 2100.0, (said,), 0.1, True))


def test_an_interval_holds_the_truth_or_does_not() -> None:
    plant, low = load_plant("cstr"), Cause("x", "x", "TT1", spec="T1 reads - 5 from 2000")
    said = Statement("T1_reads_low", "TT1", "", 0.95, 4.9)
    every = [replace(said, interval=between) for between in ((4.5, 5.2), (4.5, 4.9), None)]
    found = list(sized(plant, [look(one, low) for one in every]))
    assert [one.holds for one in found] == [True, False, False]
    assert found[0].width == pytest.approx(0.14)
    other = Cause("x", "x", "J1", spec="UA * 0.7 from 2000")
    assert not list(sized(plant, [look(every[0], other)])), "what is not there has no true size"


def test_an_answer_is_a_set_that_holds_the_truth_or_does_not() -> None:
    cause = Cause("x", "x", "J1", ("heat R1",))
    near, far = Statement("fouling", "J1", "heat R1", 0.3), Statement("temp_bias", "TT1", "", 0.6)
    both = replace(look(near, cause), judged=replace(look(near, cause).judged, said=(near, far)))
    assert answers([both, look(far, cause)]) == [(pytest.approx(0.9), True), (0.6, False)]


def left_alone(name: str, fault: str, onset_s: float) -> Run:
    plant = load_plant(name)
    return run(plant, scenario(plant, fault, 1, onset_s), proposing=Proposing(propose=None))


@pytest.mark.wide
def test_something_else_keeps_a_limit_that_nobody_keeps() -> None:
    done = left_alone("cstr", "cool_stuck_closed", 2000.0)
    outside = outside_after(done.truth, done.force, 2030.0)
    assert outside and first_seen_s(done) is None
    assert kept_by(done, outside, 2030.0) == "fallback drain"
    assert kept_by(done, {}, 2030.0) == "", "nothing is violated that could be kept"


@pytest.mark.parametrize(
    ("name", "fault", "onset_s", "best"),
    [
        ("cstr", "pump_degrade", 2000.0, "constant F1.sp = "),
        (MIXER, "sensor_stuck_B201", 60.0, "best route"),
        (MIXER, "stuck_open_VI203", 60.0, ""),
    ],
)
def test_where_no_fallback_keeps_a_limit_others_are_tried(
    monkeypatch: pytest.MonkeyPatch, name: str, fault: str, onset_s: float, best: str
) -> None:
    monkeypatch.setattr(strategies, "fallbacks", lambda plant: ())
    done = left_alone(name, fault, onset_s)
    outside = outside_after(done.truth, done.force, onset_s + 30.0)
    found = kept_by(done, outside, onset_s + 30.0)
    assert outside and found.startswith(best) and bool(found) == bool(best)


@pytest.mark.slow
def test_a_wrong_label_is_all_that_recovery_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cause = next(c for c in forced_labels(load_plant("cstr"), 1) if c.id == "pump_degrade-told-level_bias")
    asked = job(cause, "forced")
    operate([asked])
    assert capsys.readouterr().out.startswith(f"{asked.name}: ")
    (one,) = results([asked]).values()
    assert isinstance(one, Forced) and one.run == asked.name and not one.missed
    operate([asked])
    assert capsys.readouterr().out == "", "it is in"


@pytest.mark.parametrize(("fallen_s", "outside_s", "alone_s", "caught"), [
    ((505.0,), 40.0, 0.0, True), ((300.0,), 40.0, 0.0, True), ((511.0,), 40.0, 0.0, False), ((), 40.0, 0.0, False),
    ((505.0,), 61.0, 0.0, False), ((505.0,), 900.0, 895.0, True), ((300.0,), 1500.0, 20.0, False),
])  # fmt: skip
def test_a_release_is_caught_where_the_guard_falls_back_at_once_and_it_helps(
    fallen_s: tuple[float, ...], outside_s: float, alone_s: float, caught: bool
) -> None:
    """A limit is left at 500 s."""
    assert is_caught(fallen_s, 500.0, outside_s, alone_s) is caught


def test_what_is_told_is_all_that_is_diagnosed() -> None:
    plant = load_plant(MIXER)
    label = (FaultState("pump_degradation", 0.25, 60.0),)
    conditions = Conditions(label_given=True, label=label)
    chosen = scenario(plant, "clogging_B201", 3, 60.0, end_s=150.0)
    done = run(plant, chosen, clock=DeclaredClock(1.0), proposing=Proposing(conditions=conditions))
    said = [h.faults for _, event in done.record.diagnosed for h in event.hypotheses]
    assert said and set(said) == {label}
    assert done.scenario.fault == "clogging_B201", "it is judged by what is true"


def test_the_page_tells_of_pairs_and_labels_that_did_harm() -> None:
    plant = load_plant("cstr")
    asked = list(jobs(plant, ["pairs", "forced", "harmless"], [], [401], "plant"))
    named = {part: next(j.name for j in asked if j.part == part) for part in ("pairs", "forced", "harmless")}
    pair = Paired(named["pairs"], True, ("LIM-T-HIGH",), "fallback drain", "held", 10.0, 1.0)
    label = Forced(named["forced"], 1, ("LIM-L-HIGH",), 90.0, 20.0, False, "held", 10.0)
    quiet = Operated(named["harmless"], 0.0, True, 0.0, 0, 0, 1, (), "no_action", 4.0)
    study = Study(plant, asked, [], [pair, label, quiet])
    met = {bar.text: bar.judgement for bar in bars(study)}
    assert met["pairs of faults outside a hard limit after detection that a tried strategy keeps"] == "**no**"
    assert met["wrong labels with a release that violates a limit, and the guard does not catch it"] == "**no**"
    assert met["harmless runs with a write"] == "so far"
    text = page([study], "plant")
    assert "| 1 of 36 | 1 | 1 | 1 | 1 fallback | 0 |" in text
    assert f"`{pair.run}`: held, outside LIM-T-HIGH, kept by fallback drain" in text
    assert f"`{label.run}`: held, outside LIM-L-HIGH for 90 s (20 s left alone), **not caught**" in text
    assert "| Reactor | a pair of faults | 1 | 10.0 s | 10.0 s |" in text
    unseen = replace(pair, noticed=False)
    assert not unseen.avoidable and asdict(unseen)["kept_by"]


def test_what_is_called_harmless_and_is_not_does_not_count() -> None:
    plant = load_plant("cstr")
    asked = list(jobs(plant, ["harmless"], ["coolant-5-warmer"], [401, 402], "plant"))
    written = [Operated(one.name, 0.0, True, 0.0, 1, 0, 1, (), "needless_action", 4.0) for one in asked]
    judged = [
        Judged(one.name, 0, 2100.0, (), 0.1, True, violated) for one, violated in zip(asked, (("A",), ()), strict=True)
    ]
    study = Study(plant, asked, [Look(one, seen) for one, seen in zip(asked, judged, strict=True)], written)
    assert study.operated("harmless") == written[1:]
    assert {bar.text: bar.measured for bar in bars(study)}["harmless runs with a write"] == "1"
    assert "Reactor; 1 harmless runs that violate something" in page([study], "plant")


def test_a_process_that_is_ended_ends_the_study() -> None:
    with pytest.raises(RunsFailed, match="fewer --jobs"):
        list(each(end_it, TOLD, 2))


def end_it(job: Job) -> None:
    """What a host does to a process that takes too much memory."""
    os._exit(1)


def test_no_process_is_no_study(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["unknown", "--jobs", "0"])
    with pytest.raises(SystemExit):
        main()
    assert "--jobs 0 must be at least 1 process" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("cpu_s", "judged"), [((4.0, 9.0, 60.0), "so far"), ((4.0, 11.0, 12.0), "**no**"), ((), "not measured")]
)
def test_what_a_run_costs_stands_beside_what_it_may(cpu_s: tuple[float, ...], judged: str) -> None:
    plant = load_plant("cstr")
    asked = [j for j in jobs(plant, ["unknown"], [], [401], "plant") if not j.cause.known]
    runs = [Operated(j.name, 0.0, True, 0.0, 0, 0, 1, (), "no_action", s) for j, s in zip(asked, cpu_s, strict=False)]
    found = {bar.text: bar for bar in bars(Study(plant, asked, [], runs))}
    bar = next(bar for text, bar in found.items() if text.startswith("processor time"))
    assert (bar.asked, bar.judgement) == ("<= 10 s", judged)
    mixer = load_plant(MIXER)
    assert not any(b.text.startswith("processor") for b in bars(Study(mixer, [], [], [])))
