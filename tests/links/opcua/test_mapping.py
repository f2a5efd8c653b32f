"""The mapping file: what it may say, and that whatever else it says is told in one line with the entry."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.recovery import Command
from homeostat.links.errors import LinkError
from homeostat.links.opcua.agreement import disagreements
from homeostat.links.opcua.mapping import TagNodes, mapping_of, read_mapping
from homeostat.links.opcua.writing.writes import Translation
from tests.equipment.opcua.tank import RULES, tank_content, tank_mapping


def changed(path: str, value: object) -> dict[str, Any]:
    """The tank's mapping with one entry changed; None takes it out."""
    content = tank_content(4840)
    table: Any = content
    *way, last = path.split("/")
    for key in way:
        table = table[key]
    if value is None:
        del table[last]
    else:
        table[last] = value
    return content


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("connection/url", "http://127.0.0.1", "connection.url"),
        ("connection/url", "opc.tcp://me:secret@host:4840/", "connection.url"),
        ("connection/url", "opc.tcp://[bad", "connection.url"),
        ("connection/url", "opc.tcp://host:65536/", "connection.url"),
        ("connection/url", "opc.tcp://host:0/", "connection.url"),
        ("connection/dead_s", 0.0, "connection.dead_s"),
        ("connection/publsh_s", 1.0, "connection.publsh_s"),
        ("guard/counter", "Plant/Counter", "ns=2;s=NAME"),
        ("tags/L/scale", 0.0, "scale of 0"),
        ("tags/L/scale", float("nan"), "tags.L.scale"),
        ("tags/L/node", None, "tags.L.node: Field required"),
        ("tags/L/uncertain", "maybe", "'use' or 'bad'"),
        ("tags/L.sp/write/ramp", "nobody", "'plant' or 'guard'"),
        ("tags/L.sp/write/ramp", "guard", "leave 'rate' out"),
        ("tags/L.sp/write/apply", "ns=2;s=L.sp/Apply", "give both or none"),
        ("tags/L.sp/write/kind", "Complex", "tags.L.sp.write.kind"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(path: str, value: object, told: str) -> None:
    with pytest.raises(LinkError) as found:
        mapping_of(changed(path, value), "tank.toml")
    message = str(found.value)
    assert message.startswith("tank.toml: ") and "\n" not in message and told in message
    assert "secret" not in message


def test_a_file_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="cannot be read"):
        read_mapping(tmp_path / "none.toml")
    broken = tmp_path / "broken.toml"
    for content in ("[connection\n", f"a = {'[' * 5000}{']' * 5000}\n"):
        broken.write_text(content)
        with pytest.raises(LinkError, match="is no TOML file"):
            read_mapping(broken)


numbers = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-3)


@given(scale=numbers, offset=numbers, value=numbers)
def test_a_value_comes_back_through_scale_and_offset(scale: float, offset: float, value: float) -> None:
    assume(scale != 0.0)
    nodes = TagNodes(node="ns=2;s=x", scale=scale, offset=offset)
    room = abs(offset) + abs(value) + 1.0
    assert nodes.of_node(nodes.to_node(value)) == pytest.approx(value, abs=1e-9 * room)


@given(value=st.floats(-100.0, 100.0), rate=st.none() | st.floats(1e-3, 100.0))
def test_nothing_outside_range_and_rate_is_ever_written(value: float, rate: float | None) -> None:
    translation = Translation(tank_mapping(4840), RULES)
    try:
        order = translation.order((Command("L.sp", value, rate),))
    except LinkError:
        assert not 2.0 <= value <= 12.0 or rate is None or rate > 2.0
        return
    written = {write.node: write.value for write in order.writes}
    assert 2.0 - 1e-6 <= float(written["ns=2;s=L.sp/Target"]) <= 12.0 + 1e-6
    assert 0.0 < float(written["ns=2;s=L.sp/Rate"]) <= 2.0 + 1e-6
    assert list(written) == ["ns=2;s=L.sp/Mode", "ns=2;s=L.sp/Rate", "ns=2;s=L.sp/Target"], "the target comes last"


def test_a_step_is_written_only_where_the_tables_allow_one_or_the_guard_ramps() -> None:
    step, automatic = Command("L.sp", 11.0, None), Command("cool.man", None, None)
    with pytest.raises(LinkError, match=r"'L.sp' cannot step to 11 L: it needs a rate, and 2 L/s are allowed"):
        Translation(tank_mapping(4840), RULES).order((step,))
    assert Translation(tank_mapping(4840), RULES).order((automatic,)).writes
    free = {**RULES.tags, "L.sp": replace(RULES.tags["L.sp"], rate_limit=None)}
    order = Translation(tank_mapping(4840), replace(RULES, tags=free)).order((step,))
    assert [w.value for w in order.writes if w.node == "ns=2;s=L.sp/Rate"] == [0.0]
    content = tank_content(4840)
    content["tags"]["L.sp"]["write"] |= {"ramp": "guard"}
    del content["tags"]["L.sp"]["write"]["rate"]
    guards = {**RULES.writables, "L.sp": replace(RULES.writables["L.sp"], ramped_by=Side.GUARD)}
    assert Translation(mapping_of(content, "tank"), replace(RULES, writables=guards)).order((step,)).writes


def test_units_and_types_of_the_node_are_written() -> None:
    content = tank_content(4840)
    content["tags"]["L.sp"] |= {"unit": "mm", "scale": 0.01}
    content["tags"]["L.sp"]["write"] |= {"kind": "Int16"}
    order = Translation(mapping_of(content, "tank"), RULES).order((Command("L.sp", 11.0, 0.5),))
    assert [(w.value, w.kind) for w in order.writes] == [(2, "Int32"), (50.0, "Double"), (1100, "Int16")]
    assert order.read_back[0].tolerance == pytest.approx(5.0)
    with pytest.raises(LinkError, match="whole numbers"):
        Translation(mapping_of(content, "tank"), RULES).order((Command("L.sp", 11.0033, 0.5),))


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("tags/T9", {"node": "ns=2;s=T9"}, "the plant 'tank' has not"),
        ("tags/T/write", {"node": "ns=2;s=T", "ramp": "plant"}, "which the plant's writables.csv does not"),
        ("tags/T/unit", "degC", r"'T' is in K and its node in degC, .* state scale and offset in the mapping, or unit"),
    ],
)
def test_a_mapping_that_contradicts_the_plant_is_refused(path: str, value: object, told: str) -> None:
    with pytest.raises(LinkError, match=told):
        Translation(mapping_of(changed(path, value), "tank"), RULES)


def test_a_unit_that_is_converted_or_the_tags_own_is_no_contradiction() -> None:
    content = tank_content(4840)
    for stated in ({"unit": "degC", "offset": 273.15}, {"unit": "mK", "scale": 0.001}, {"unit": "K"}, {}):
        content["tags"]["T"] = {"node": "ns=2;s=T", **stated}
        assert disagreements(mapping_of(content, "tank"), RULES) == {}


def test_one_side_ramps_and_both_files_say_which() -> None:
    rules = {**RULES.writables, "L.sp": WriteRule("L.sp", 0.05, 3.0, ramped_by=Side.GUARD)}
    with pytest.raises(LinkError, match="ramped by the plant in the mapping and by the guard"):
        Translation(tank_mapping(4840), type(RULES)("tank", RULES.tags, RULES.machine, RULES.limits, {}, {}, rules, ()))
