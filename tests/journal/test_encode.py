"""Encoding is total on what a trace may hold, deterministic, and refuses the rest by name."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal.encode import canonical, encode
from tests.journal.samples import Health, Margin, Measured, Result

pytestmark = pytest.mark.quick

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner).map(tuple) | st.dictionaries(st.text(), inner),
    max_leaves=12,
)


def same(value: object, read: object) -> bool:
    """Whether ``read`` is what JSON can keep of ``value``."""
    if isinstance(value, float) and not math.isfinite(value):
        return read == ("NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity")
    if isinstance(value, tuple):
        return isinstance(read, list) and len(read) == len(value) and all(map(same, value, read))
    if isinstance(value, dict):
        return isinstance(read, dict) and read.keys() == value.keys() and all(same(value[k], read[k]) for k in value)
    return type(read) is type(value) and read == value


@given(VALUES)
def test_values_round_trip_through_one_ascii_line(value: object) -> None:
    line = canonical(encode(value))
    assert line.isascii() and "\n" not in line
    assert same(value, json.loads(line))


@given(st.dictionaries(st.text(), st.integers(), min_size=2))
def test_a_mapping_encodes_the_same_in_any_order(mapping: dict[str, int]) -> None:
    backwards = dict(reversed(mapping.items()))
    assert canonical(encode(backwards)) == canonical(encode(mapping))


@given(st.frozensets(st.text() | st.integers()))
def test_a_set_encodes_the_same_in_any_order(items: frozenset[str | int]) -> None:
    again = set(sorted(items, key=repr))
    assert canonical(encode(again)) == canonical(encode(items))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.float64(0.1), 0.1),
        (np.float32(0.5), 0.5),
        (np.int16(-3), -3),
        (np.bool_(True), True),
        (np.float64("nan"), "NaN"),
        (-math.inf, "-Infinity"),
        (Health.BAD, "BAD"),
        (Result.TRIPPED, "TRIPPED"),
        ({Health.GOOD: 1}, {"GOOD": 1}),
        (Margin("level", 2.0), {"@type": "Margin", "criterion": "level", "value": 2.0}),
    ],
)
def test_scalars_enums_and_records(value: object, expected: object) -> None:
    read = json.loads(canonical(encode(value)))
    assert read == expected and type(read) is type(expected)


def test_an_array_is_named_by_its_digest() -> None:
    one = encode(np.arange(6.0).reshape(2, 3))
    assert isinstance(one, dict) and one["shape"] == [2, 3] and one["dtype"] == "<f8"
    assert encode(np.asfortranarray(np.arange(6.0).reshape(2, 3))) == one
    assert encode(np.arange(12.0).reshape(2, 6)[:, ::2] / 2) == one
    for other in (np.arange(1.0, 7.0).reshape(2, 3), np.arange(6.0).reshape(3, 2), np.arange(6).reshape(2, 3)):
        assert encode(other) != one


@dataclass
class Thawed:
    kind = "thawed"
    level: float = 0.0


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (Path("/plant"), r"reading\[1\] is a '\w*Path', which a trace cannot hold"),
        (1j, r"reading\[1\] is a 'complex'"),
        (b"raw", r"reading\[1\] is a 'bytes'"),
        (np.complex128(1j), r"reading\[1\] is a 'complex128'"),
        (np.array([object()]), r"reading\[1\] is an array of Python objects"),
        ({1: 2}, r"key 1 of reading\[1\] is not a unique text"),
        ({Health.GOOD: 1, "GOOD": 2}, r"key 'GOOD' of reading\[1\] is not a unique text"),
        (Measured("T1", 1j), r"reading\[1\].value is a 'complex'"),  # type: ignore[arg-type]
        (Thawed(), "'Thawed' is not a frozen dataclass"),
        (Margin, r"reading\[1\] is a 'type'"),
    ],
)
def test_what_does_not_fit_is_named(value: object, message: str) -> None:
    with pytest.raises(TypeError, match=message) as caught:
        encode((0.0, value), "reading")
    assert "\n" not in str(caught.value)
