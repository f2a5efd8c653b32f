"""A plant whose tables state each thing once: what follows from instruments, loops, actuators, streams and states."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.knowledge.build.build import build, refuse_incomplete
from homeostat.knowledge.build.derived.draft import one_digit, written
from homeostat.knowledge.build.derived.tables import digest, stated_tables, tables
from homeostat.knowledge.build.provenance import DERIVED, sha256, stale_tables
from homeostat.knowledge.build.tables.schemas import EVERY, SCHEMAS
from homeostat.knowledge.checks.consistency import ModelInterface, inconsistencies
from homeostat.knowledge.store.error import Code, GraphError
from tests.knowledge.shorts import Short, rows_of
from tests.knowledge.tables import INSTALLED
from tests.knowledge.whole import whole

LOOPS = {"FIC1": ("F1", "V1"), "LIC1": ("L1", "P1"), "TIC2": ("T2", "H1")}
ACTUATORS = ("V1", "P1", "H1")
MOST_LINES = 200


@pytest.fixture
def short(tmp_path: Path) -> Short:
    return Short.at(tmp_path / "two_tanks")


def test_two_heated_tanks_take_few_lines_and_fit_a_model_that_offers_what_they_name(short: Short) -> None:
    assert sum(len(path.read_text().splitlines()) for path in short.folder.glob("engineering/*.csv")) <= MOST_LINES
    plant = short.plant()
    measured = {row["tag"] for row in rows_of(short.folder, "instruments")}
    held = {f"{pv}.{end}" for pv, _ in LOOPS.values() for end in ("sp", "err")}
    driven = {f"{actuator}.{end}" for _, actuator in LOOPS.values() for end in ("cmd", "man")}
    assert {tag.name for tag in plant.tags} == measured | held | driven
    model = ModelInterface(
        parameters=frozenset(p.symbol for p in plant.parameters),
        variables=frozenset(tag.name.replace(".", "_") for tag in plant.tags),
        faults=frozenset(f"{a}_{way}" for a in ACTUATORS for way in ("stuck_open", "stuck_closed", "weak")),
        horizon_s=900.0,
    )
    assert inconsistencies(plant, model) == ()


def test_an_instrument_has_equipment_errors_and_quality(short: Short) -> None:
    assert short.row("equipment", id="LT1")["part_of"] == "B1"
    level = short.row("signals", tag="L1")
    assert (level["role"], level["relation"], level["variable"], level["scale"]) == ("PV", "measures", "L1", "0.02")
    assert short.row("sensors", component="ZT1")["parameter_bias"] == "bias_V1_pos"
    assert short.row("quality", tag="L1")["frozen_s"] == "10"
    relative = short.row("quality", tag="F1")
    assert (relative["noise"], relative["frozen_s"]) == ("", "")
    assert short.row("signals", tag="V1.pos")["role"] == "STATUS"


def every(short: Short, table: str, seconds: str) -> None:
    """State how often the first level is sampled."""
    lines = short.path(table).read_text("utf-8").splitlines()
    short.write(
        table, *(f"{line},{'every_s' if not k else seconds * (',L1,' in line)}" for k, line in enumerate(lines))
    )


@pytest.mark.parametrize(
    ("seconds", "frozen", "stale"), [("30", 90, 65), ("900", 2700, 1805), ("2", 10, 9), ("1", 10, 5)]
)
def test_what_is_sampled_is_judged_by_its_samples(short: Short, seconds: str, frozen: float, stale: float) -> None:
    every(short, "instruments", seconds)
    row, other = short.row("quality", tag="L1"), short.row("quality", tag="L2")
    assert (row["every_s"], row["frozen_s"], row["stale_s"]) == (seconds, f"{frozen:g}", f"{stale:g}")
    assert (other["every_s"], other["frozen_s"], other["stale_s"]) == ("", "10", "5")
    assert short.mistakes() == []
    plant = short.plant()
    rule = plant.qualities["L1"]
    assert (rule.every_s, rule.frozen_s, rule.stale_s) == (float(seconds), frozen, stale)
    assert plant.sampled == ({"L1": int(seconds)} if seconds != "1" else {})


@pytest.mark.parametrize(
    ("frozen_s", "stale_s", "said"),
    [
        ("90", "5", ""),
        ("1800", "1800", ""),
        ("10", "5", "outside 90 to 1800 s"),
        ("2000", "5", "a sample is taken every 30 s"),
        ("90", "2000", "outside 1 to 1800 s"),
    ],
)
def test_the_bounds_of_its_times_follow_its_samples(short: Short, frozen_s: str, stale_s: str, said: str) -> None:
    every(short, "instruments", "30")
    short.write("quality", "tag,noise,frozen_s,stale_s,every_s", f"L1,0.005,{frozen_s},{stale_s},30")
    assert said in "".join(map(str, short.mistakes())) and bool(said) == bool(short.mistakes())


def test_the_readings_of_a_loop_are_measured_wherever_its_instrument_is(short: Short) -> None:
    short.edit("instruments", "FT1,F1,L/s,0,1,B1", "FT1,F1,L/s,0,1,V1")
    assert short.row("signals", tag="F1")["role"] == "PV"


def test_a_loop_has_a_controller_an_operator_and_flows(short: Short) -> None:
    loop = short.row("loops", id="LIC1")
    names = ("LIC1", "PO_LIC1", "L1.sp", "Kp_LIC1", "Ki_LIC1", "Level of the feed tank")
    assert tuple(loop[c] for c in ("controller", "operator", "sp", "gain", "reset", "label")) == names
    assert short.row("operators", id="PO_LIC1")["successor"] == "PO_P1"
    flows = {(r["direction"], r["tag"]) for r in tables(short.folder)["flows"].rows if r["operator"] == "PO_LIC1"}
    assert flows == {("input", "L1"), ("input", "L1.sp"), ("output", "P1.cmd")}
    assert short.row("parameters", symbol="Ki_FIC1")["unit"] == "1/L"


def test_a_controller_may_command_several_actuators(short: Short) -> None:
    short.edit("equipment", "P1,Actuator,,Transfer pump", "P1,Actuator,,Transfer pump\nP3,Actuator,,Its twin")
    short.edit("loops", "LIC1,L1,P1.cmd", "LIC1,L1,P1.cmd|P3.cmd")
    short.edit("fallbacks", "stop,,H1.man,0", "stop,,H1.man,0\nstop,,P3.man,0")
    short.edit("setpoints", "shutdown,H1.man", "shutdown,P3.man,,,0\nshutdown,H1.man")
    assert short.row("loops", id="LIC1")["mv"] == "P1.cmd"
    flows = {r["tag"] for r in tables(short.folder)["flows"].rows if r["operator"] == "PO_LIC1"}
    assert flows == {"L1", "L1.sp", "P1.cmd", "P3.cmd"}
    plant = short.plant()
    assert plant.tag("P3.cmd").increment is None and plant.writables["P3.man"].automatic
    assert {rule.name for rule in plant.symptom_rules if "P3_weak" in rule.faults} == {"S-LIC1-OFF"}


def test_a_command_of_several_that_is_no_tag_is_told_by_its_name(short: Short) -> None:
    short.edit("loops", "LIC1,L1,P1.cmd", "LIC1,L1,P1.cmd|P9.cmd")
    assert any("P9.cmd" in str(mistake) for mistake in short.mistakes())


def test_an_actuator_without_a_loop_is_commanded_by_hand(short: Short) -> None:
    short.write("loops", "id,pv,mv", "FIC1,F1,V1.cmd", "LIC1,L1,P1.cmd")
    short.edit("setpoints", "*,T2.sp,20,70,50", "*,H1.cmd,0,1,0.5")
    short.write(
        "setpoints", *(line for line in short.path("setpoints").read_text().splitlines() if "H1.man" not in line)
    )
    short.write("fallbacks", "strategy,target,tag,value", "stop,shutdown,F1.sp,0", "stop,,H1.cmd,0")
    short.write("parameters", *(x for x in short.path("parameters").read_text().splitlines() if "TIC2" not in x))
    plant = short.plant()
    assert plant.tag("H1.cmd").increment == 0.01
    assert not plant.writables["H1.cmd"].automatic
    weak = {rule.name for rule in plant.symptom_rules if "H1_weak" in rule.faults}
    assert weak == {"S-FIC1-OFF", "S-LIC1-OFF"}, "what is near to no loop may be seen in any"


def test_streams_are_flows_between_what_the_parts_do(short: Short) -> None:
    assert short.row("operators", id="PO_B1")["successor"] == "PO_P1"
    ends = [(r["operator"], r["direction"]) for r in tables(short.folder)["flows"].rows if r["flow"] == "transfer"]
    assert ends == [("PO_P1", "output"), ("PO_B2", "input")]


def test_the_order_of_states_is_that_of_their_risk(short: Short) -> None:
    states = {state.name: state for state in short.plant().machine.states}
    assert [states[name].risk for name in ("starting", "normal", "reduced", "holding", "shutdown")] == [0, 0, 1, 2, 3]
    assert {name for name, state in states.items() if state.recovery_target} == {"normal", "reduced", "holding"}
    assert states["starting"].initial


def test_transitions_begin_in_several_states_and_have_guards_by_name(short: Short) -> None:
    machine = short.plant().machine
    ways = {t.name: t for t in machine.transitions}
    assert {n for n in ways if n.startswith("t_stop")} == {"t_stop_normal", "t_stop_reduced", "t_stop_holding"}
    assert {n for n in ways if n.startswith("t_hold")} == {"t_hold_normal", "t_hold_reduced"}
    assert str(ways["t_started"].guard) == "L1 >= 0.9 and L2 >= 0.5" and not ways["t_started"].on_decision
    events = {n: ways[n].event for n in ("t_started", "t_stop_normal", "t_restart", "t_reduce_normal")}
    assert list(events.values()) == ["t_started", "trip", "restart", "fault_diagnosed"]
    assert machine.recovery_event == "fault_diagnosed"


def test_a_hard_limit_is_watched_and_served_by_the_only_fallback(short: Short) -> None:
    plant = short.plant()
    assert plant.trips["LIM-L1-HIGH"].cusum == pytest.approx(0.1)
    assert plant.trips.keys() == plant.fallback_strategies[0].serves.keys() == {x.name for x in plant.limits.hard}
    short.add("fallbacks", "drain,shutdown,F1.sp,0")
    assert tables(short.folder)["fallback_limits"].rows == ()


def test_a_threshold_is_no_larger_than_what_its_limit_can_show(short: Short) -> None:
    short.edit("instruments", "TT2,T2,degC,0,100,B2,0.2", "TT2,T2,degC,0,100,B2,2")
    short.edit("limits", "T2 <= 85", "T2 <= 94")
    assert short.row("trips", limit="LIM-T2-HIGH")["cusum"] == "3"


def test_a_fault_shows_where_its_component_is(short: Short) -> None:
    rules = {rule.name: set(rule.faults) for rule in short.plant().symptom_rules}
    assert rules["S-V1-OFF"] == {"V1_stuck_open", "V1_stuck_closed"}
    assert rules["S-FIC1-OFF"] == rules["S-V1-OFF"] | {"V1_weak"}
    assert short.row("symptoms", id="S-V1-OFF")["on_delay_s"] == "6", "three time constants of V1"


def test_a_stated_row_counts_and_takes_over_the_columns_that_it_leaves_out(short: Short) -> None:
    short.write("signals", "tag,low,high,increment,rate_limit", "F1.sp,0,0.5,0.02,", "V1.cmd,,,,")
    setpoint = short.row("signals", tag="F1.sp")
    assert (setpoint["high"], setpoint["increment"], setpoint["unit"]) == ("0.5", "0.02", "L/s")
    assert setpoint["rate_limit"] == "", "an empty cell of a column that may be empty says that there is none"
    assert short.row("signals", tag="V1.cmd")["high"] == "1", "a cell that must be filled is"
    short.write("faults", "id,prior", "V1_weak,0.3")
    fault = short.plant().fault("V1_weak")
    assert fault.prior == 0.3 and fault.component == "V1"
    assert len(short.plant().faults) == 9


def test_a_row_for_one_state_counts_before_a_row_for_all(short: Short) -> None:
    short.add("setpoints", "holding,L1.sp,0.2,0.4,0.3")
    assert short.row("setpoints", state="holding", tag="L1.sp")["design"] == "0.3"
    assert short.row("setpoints", state="normal", tag="L1.sp")["design"] == "1"


def test_nothing_is_written_into_the_folder_and_every_row_says_where_it_comes_from(short: Short) -> None:
    before = {path: path.read_bytes() for path in short.folder.rglob("*") if path.is_file()}
    found = tables(short.folder)
    assert {path: path.read_bytes() for path in short.folder.rglob("*") if path.is_file()} == before
    for name, table in found.items():
        assert len(table.origins) == len(table.rows)
        for number, origin in enumerate(table.origins):
            stated = stated_tables(short.folder)[0][origin.table].rows
            assert 2 <= origin.line <= len(stated) + 1
            assert origin.generated or origin.table == name, table.place(name, number)


@pytest.mark.parametrize("plant", ["cstr", "mixing_module"])
def test_nothing_follows_where_there_are_no_instruments(plant: str) -> None:
    found = tables(whole(plant))
    assert found.keys() == SCHEMAS.keys()
    assert found == stated_tables(whole(plant))[0]
    assert {name: table.rows for name, table in tables(INSTALLED / plant).items() if name in SCHEMAS} == {
        name: table.rows for name, table in found.items()
    }


def test_a_graph_is_stale_when_other_rows_would_follow(short: Short) -> None:
    graph = build(short.folder)
    assert stale_tables(short.folder, graph) == ()
    for changed, old in (("instruments", "Feed flow"), ("guards", "Something is fed")):
        content = short.path(changed).read_bytes()
        short.edit(changed, old, "Another text")
        assert stale_tables(short.folder, graph) == (f"engineering/{changed}.csv",)
        short.path(changed).write_bytes(content)
    other = graph.replace(digest(short.folder).encode(), sha256(b"another generator").encode())
    assert stale_tables(short.folder, other) == (DERIVED,)


MISTAKES = [
    ("instruments", "LT1,L1,m,-0.2", "LT1,L1,m,wide", "instruments.csv row 2 ('LT1'): low: 'wide' is no number"),
    ("instruments", ",B2,0.005", ",B3,0.005", "row 3 ('LT2'): at: there is no component 'B3' in equipment.csv"),
    ("instruments", "id,tag", "id,tga", "instruments.csv row 1: column 'tga' is not known; did you mean 'tag'"),
    (
        "loops",
        "LIC1,L1",
        "LIC1,L9",
        "loops.csv row 3 ('LIC1'): pv: there is no tag 'L9' in signals.csv or instruments.csv",
    ),
    ("loops", "P1.cmd", "P9.cmd", "loops.csv row 3 ('LIC1'): mv: there is no tag 'P9.cmd'"),
    ("streams", "product,,B2,", "product,,,", "streams.csv row 6 ('product'): source and target are empty"),
    ("streams", "transfer,,P1", "transfer,,P7", "streams.csv row 5 ('transfer'): source: there is no component 'P7'"),
    ("guards", "L1 >= 0.9", "L1 >=", "guards.csv row 2 ('filled'): formula: "),
    ("transitions", "reduced holding", "reduced houlding", "row 3 ('t_return_houlding'): source: there is no state"),
    (
        "setpoints",
        "*,L1.sp,0.5,1.5,1",
        "*,L1.sp,0.5,1.5,9",
        "setpoints.csv row 2 ('starting L1.sp'): design 9 is outside",
    ),
    ("parameters", "tau_V1,2,,,,,", "tau_V1,two,,,,,", "parameters.csv row 8 ('tau_V1'): value: 'two' is no number"),
]


@pytest.mark.parametrize(("table", "old", "new", "words"), MISTAKES, ids=[words[:45] for *_, words in MISTAKES])
def test_a_mistake_is_told_where_it_stands(short: Short, table: str, old: str, new: str, words: str) -> None:
    short.edit(table, old, new)
    found = [str(error) for error in short.mistakes()]
    assert any(words in error for error in found), found


def test_a_table_that_nothing_can_follow_from_is_missed(short: Short) -> None:
    short.path("states").unlink()
    assert [error.code for error in short.mistakes()] == [Code.BAD_TABLE]


def test_short_tables_are_refused_where_there_are_no_instruments(tmp_path: Path) -> None:
    short = Short.at(tmp_path / "plant")
    short.path("instruments").unlink()
    found = [error for error in short.mistakes() if error.code is Code.BAD_MAPPING]
    assert {error.thing for error in found} == {"streams.csv", "guards.csv"}
    assert all("it is read only beside an instruments.csv" in error.message for error in found)


CELLS = st.sampled_from(
    [
        *("", "*", "|", "((", "a b", "normal|holding", "L1", "V1", "V1.cmd", "V1.pos", "B1", "trip", "Actuator"),
        *("1", "-1", "1e-300", "-1e300", "nan", "yes", "no", "true"),
        *("always (L1 <= 2)", "1 / L1 <= 2", "L1 <= 1e308", "L1 <= T2", "brim <= 3"),
    ]
)


@pytest.mark.slow
@given(data=st.data())
@settings(max_examples=60)
def test_bad_cells_are_never_more_than_mistakes(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    short = Short.at(tmp_path_factory.mktemp("fuzz") / "plant")
    name = data.draw(st.sampled_from(sorted(path.stem for path in short.folder.glob("engineering/*.csv"))))
    rows = rows_of(short.folder, name)
    for _ in range(data.draw(st.integers(1, 3))):
        row = data.draw(st.sampled_from(rows))
        row[data.draw(st.sampled_from(sorted(row)))] = data.draw(CELLS)
    with short.path(name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    assert tables(short.folder).keys() == EVERY.keys()
    try:
        refuse_incomplete(build(short.folder))
    except GraphError as error:
        assert "\n" not in str(error)


@given(st.floats(1e-6, 1e6))
def test_one_digit_is_written_with_one_digit(value: float) -> None:
    rounded = one_digit(value)
    assert abs(rounded - value) <= 0.5 * value + 1e-12
    assert float(written(rounded)) == pytest.approx(rounded, rel=1e-6)


# --- rows that are not wanted, and rows that stand for several -----------------------------------------------------


def test_an_omitted_row_does_not_follow_and_nothing_that_follows_from_it(short: Short) -> None:
    before = {name: table.rows for name, table in tables(short.folder).items()}
    short.write("omitted", "table,row,reason", "faults,V1_*,The valve is watched by others", "features,F-LIC1,")
    assert short.mistakes() == []
    after = {name: table.rows for name, table in tables(short.folder).items()}
    gone = {name: [row for row in rows if row not in after[name]] for name, rows in before.items() if name != "omitted"}
    assert [row["id"] for row in gone["faults"]] == ["V1_stuck_open", "V1_stuck_closed", "V1_weak"]
    assert [row["id"] for row in gone["features"]] == ["F-LIC1"]
    assert [row["id"] for row in gone["symptoms"]] == ["S-LIC1-OFF"]
    assert {row["fault"] for row in after["symptom_faults"]} == {row["id"] for row in after["faults"]}
    assert all(gone[name] == [] for name in ("signals", "equipment", "quality", "writables", "limits"))
    assert len(short.plant().faults) == len(after["faults"])


def test_a_stated_row_is_none_that_follows_and_cannot_be_omitted(short: Short) -> None:
    short.write("signals", "tag,high", "F1.sp,0.5")
    short.write("omitted", "table,row", "signals,F1.sp")
    (mistake,) = short.mistakes()
    assert mistake.thing == "omitted.csv row 2 ('signals F1.sp')"
    assert mistake.message.startswith("row: nothing that follows in signals is called 'F1.sp'; did you mean 'L1.sp'")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("fautls,V1_*", "table: there is no table 'fautls'; did you mean 'faults'"),
        (
            "faults,V1_stuk_open",
            "row: nothing that follows in faults is called 'V1_stuk_open'; did you mean 'V1_stuck_",
        ),
        ("guards,warm", "table: there is no table 'guards'"),
        (",V1_*", "table: the cell is empty; fill it"),
        ("faults,", "row: the cell is empty; fill it"),
    ],
)
def test_what_omits_nothing_is_one_line(short: Short, line: str, said: str) -> None:
    short.write("omitted", "table,row", line)
    (mistake,) = short.mistakes()
    assert mistake.message.startswith(said) and mistake.thing.startswith("omitted.csv row 2")


def test_what_is_needed_is_missed_where_it_is_used(short: Short) -> None:
    short.write("omitted", "table,row", "signals,L1.sp")
    assert any("there is no tag 'L1.sp'" in mistake.message for mistake in short.mistakes())


def test_a_row_may_stand_for_several_things(short: Short) -> None:
    short.write("quality", "tag,grace_s,description", "L1|L2,7,Both levels")
    short.write("writables", "tag,confirm_s", "F1.sp|T2.sp,4")
    short.write("state_requirements", "state,component,description", "normal|holding,V1|P1,What moves")
    assert short.mistakes() == []
    assert [short.row("quality", tag=tag)["grace_s"] for tag in ("L1", "L2", "F1")] == ["7", "7", "5"]
    assert {short.row("writables", tag=tag)["confirm_s"] for tag in ("F1.sp", "T2.sp")} == {"4"}
    pairs = [(row["state"], row["component"]) for row in tables(short.folder)["state_requirements"].rows]
    assert sorted(pairs) == [("holding", "P1"), ("holding", "V1"), ("normal", "P1"), ("normal", "V1")]


def test_the_same_thing_twice_is_told_with_both_lines(short: Short) -> None:
    short.write("quality", "tag,grace_s,description", "L1|L2,7,Both levels", "L2,6,Again")
    told = [str(mistake) for mistake in short.mistakes() if mistake.code is Code.DUPLICATE_ID]
    assert len(told) == 1 and "quality.csv row 3 ('L2'): tag is that of row 2" in told[0]


def test_an_instrument_may_say_what_it_is_called_and_be_a_switch(short: Short) -> None:
    text = short.path("instruments").read_text("utf-8").splitlines()
    head, rows = text[0].split(","), text[1:]
    more = [f"{line},," for line in rows]
    switch = {
        "id": "LS1",
        "tag": "L1.full",
        "unit": "1",
        "low": "0",
        "high": "1",
        "at": "B1",
        "description": "B1 is full",
    }
    own = ",".join((*[switch.get(column, "") for column in head], "Level switch", "STATUS"))
    short.write("instruments", ",".join((*head, "label", "role")), *more, own)
    assert short.mistakes() == []
    assert short.row("equipment", id="LS1")["label"] == "Level switch"
    assert short.row("signals", tag="L1.full")["role"] == "STATUS"
    assert not [row for row in tables(short.folder)["sensors"].rows if row["component"] == "LS1"]
    quality = short.row("quality", tag="L1.full")
    assert (quality["noise"], quality["grace_s"]) == ("", "0")


def test_the_operator_that_is_stated_of_a_part_is_that_of_its_streams(short: Short) -> None:
    part = tables(short.folder)["streams"].rows[0]["target"]
    short.write("operators", "id,resource,label", f"PO_Dose,{part},Dose the feed")
    assert short.mistakes() == []
    found = tables(short.folder)
    assert {row["operator"] for row in found["flows"].rows if row["flow"] == found["streams"].rows[0]["stream"]} == {
        "PO_Dose"
    }
    assert f"PO_{part}" not in {row["id"] for row in found["operators"].rows}
