"""What every store of samples must do, wherever it keeps them. A test class inherits this and says how to open one."""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from homeostat.history.quality import GOOD
from homeostat.history.samples import ALWAYS, MINUTE_US, NO_TIME, Batch, Series, Span
from homeostat.history.store import HistoryError, HistoryReader, HistoryStore, Occurrence, UnknownTag

Open: TypeAlias = Callable[[], HistoryStore]
"""Opens the store under test, the same one each time."""

T0 = 1_764_000_000_000_000
S = 1_000_000
SENSOR_FAILURE, LAST_USABLE = 0x808C0000, 0x40900000

Row: TypeAlias = tuple[str, int, float, int, int]
"""Tag, source time [us], value, code, server time [us]."""


def batch(*rows: Row, own_us: int = T0) -> Batch:
    """A batch of these samples."""
    tags, times, values, codes, servers = zip(*rows, strict=True) if rows else ((), (), (), (), ())
    return Batch(
        tuple(tags),
        np.array(times, dtype=np.int64),
        np.array(values, dtype=np.float64),
        np.array(codes, dtype=np.uint32),
        np.array(servers, dtype=np.int64),
        own_us,
    )


def plain(tag: str, time_us: int, value: float, code: int = GOOD) -> Row:
    """A sample that the server had a millisecond after it was taken."""
    return tag, time_us, value, code, time_us + 1000


def rows_of(series: Series) -> list[tuple[int, bytes, int, int, int]]:
    """Every sample, with the bits of its value."""
    columns = (series.time_us, series.value, series.quality, series.server_us, series.own_us)
    return [(int(t), np.float64(v).tobytes(), int(q), int(s), int(o)) for t, v, q, s, o in zip(*columns, strict=True)]


def expected_of(batches: Sequence[Batch], tag: str, span: Span = ALWAYS) -> list[tuple[int, bytes, int, int, int]]:
    """What reading ``tag`` must give: by time, and as they arrived."""
    found = [
        (int(b.time_us[k]), b.value[k].tobytes(), int(b.quality[k]), int(b.server_us[k]), b.own_us)
        for b in batches
        for k, name in enumerate(b.tags)
        if name == tag and span.from_us <= b.time_us[k] < span.to_us
    ]
    return sorted(found, key=lambda row: row[0])


LARGEST = sys.float_info.max
ODD_VALUES = (0.0, -0.0, math.inf, -math.inf, math.nan, 5e-324, LARGEST, 0.1 + 0.2)
samples = st.tuples(
    st.sampled_from(["T1", "L1", "größe/→.pv", "V2.pos"]),
    st.one_of(st.integers(T0 - 90 * S, T0 + 90 * S), st.integers(-(10**17), 10**17)),
    st.one_of(st.floats(width=64, allow_nan=False), st.sampled_from(ODD_VALUES)),
    st.sampled_from([GOOD, LAST_USABLE, SENSOR_FAILURE, 0xFFFFFFFF]),
    st.one_of(st.just(NO_TIME), st.integers(T0, T0 + 90 * S)),
)
own_times = st.integers(T0 - 4000 * S, T0 + 4000 * S)
batches = st.lists(st.tuples(st.lists(samples, max_size=6), own_times), max_size=8)


class HistoryStoreContract:
    """The contract. A test class provides the fixtures ``opened``, ``anew`` (a new store each time) and ``reader``."""

    def test_what_was_appended_is_read_at_once_and_after_it_was_opened_again(self, opened: Open) -> None:
        kept = batch(plain("T1", T0, 1.5), plain("L1", T0, 2.5, SENSOR_FAILURE), plain("T1", T0 + S, 1.6))
        store = opened()
        store.append(kept)
        for tag in ("T1", "L1"):
            assert rows_of(store.read([tag], ALWAYS)[tag]) == expected_of([kept], tag)
        store.close()
        store = opened()
        assert rows_of(store.read(["T1"], ALWAYS)["T1"]) == expected_of([kept], "T1")
        assert store.tags() == ("L1", "T1") and store.extent() == Span(T0, T0 + S + 1)
        store.close()

    @settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(given=batches, closed=st.integers(0, 8), span=st.tuples(st.integers(-99, 99), st.integers(0, 99)))
    def test_nothing_is_lost_or_altered_whatever_comes_in_whatever_order(
        self, anew: Callable[[], Open], given: list[tuple[list[Row], int]], closed: int, span: tuple[int, int]
    ) -> None:
        opened, every = anew(), [batch(*rows, own_us=own_us) for rows, own_us in given]
        with ExitStack() as used:
            store = used.enter_context(closing(opened()))
            for k, one in enumerate(every):
                if k == closed:
                    store.close()
                    store = used.enter_context(closing(opened()))
                store.append(one)
            part = Span(T0 + span[0] * S, T0 + (span[0] + span[1]) * S)
            for again in (False, True):
                if again:
                    store.close()
                    store = used.enter_context(closing(opened()))
                for tag in {tag for one in every for tag in one.tags}:
                    for asked in (ALWAYS, part):
                        assert rows_of(store.read([tag], asked)[tag]) == expected_of(every, tag, asked)
                    last = expected_of(every, tag)[-1]
                    assert rows_of(store.last([tag])[tag]) == [last]
            assert store.take_troubles() == ()

    @settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(given=batches)
    @example(given=[([plain("T1", T0, LARGEST)] * 3, T0)])
    def test_minutes_are_those_of_the_samples(
        self, anew: Callable[[], Open], given: list[tuple[list[Row], int]]
    ) -> None:
        opened, every = anew(), [batch(*rows, own_us=own_us) for rows, own_us in given]
        with closing(opened()) as store:
            for one in every:
                store.append(one)
        with closing(opened()) as store:
            for tag in {tag for one in every for tag in one.tags}:
                by_minute: dict[int, list[tuple[int, float, int]]] = {}
                for time_us, value, code, _, _ in expected_of(every, tag):
                    row = (time_us, float(np.frombuffer(value)[0]), code)
                    by_minute.setdefault(time_us // MINUTE_US * MINUTE_US, []).append(row)
                found = store.minutes([tag], ALWAYS)[tag]
                assert found.minute_us.tolist() == sorted(by_minute)
                assert found.count.tolist() == [len(by_minute[m]) for m in sorted(by_minute)]
                for k, minute in enumerate(sorted(by_minute)):
                    good = [v for _, v, code in by_minute[minute] if code >> 30 == 0 and math.isfinite(v)]
                    assert found.good[k] == len(good)
                    shown = [found.minimum[k], found.maximum[k], found.last[k]]
                    assert shown == [min(good), max(good), good[-1]] if good else np.isnan(shown).all()
                    if good:
                        mean, size = statistics.mean(good), max(map(abs, good))
                        assert math.isclose(found.mean[k], mean, rel_tol=1e-9, abs_tol=1e-12 * size)

    def test_a_tag_that_is_not_there_is_refused_with_those_that_are_near(self, opened: Open) -> None:
        store = opened()
        store.append(batch(plain("reactor.T1", T0, 1.0)))
        near = r"'reactor.T2'; did you mean 'reactor.T1'\?"
        with pytest.raises(UnknownTag, match=near):
            store.read(["reactor.T2"], ALWAYS)
        with pytest.raises(UnknownTag, match=near):
            store.last(["reactor.T2"])
        with pytest.raises(UnknownTag, match=near):
            store.minutes(["reactor.T2"], ALWAYS)
        assert store.read(["reactor.T1"], Span(0, 1))["reactor.T1"].length == 0
        store.close()

    def test_an_empty_store_has_no_tags_and_no_extent(self, opened: Open) -> None:
        store = opened()
        store.append(batch())
        assert store.tags() == () and store.extent() is None and store.occurrences(ALWAYS) == ()
        store.close()

    def test_alarms_and_events_are_kept_by_time(self, opened: Open) -> None:
        first = Occurrence(T0 + 5 * S, T0 + 6 * S, "alarm", "LIM-T-HIGH", 900, "T1 is 314 K, limit 313 K", '{"v": 1}')
        second = Occurrence(T0 + 2 * S, T0 + 7 * S, "state", "plant", 1, "größer → ✓")
        store = opened()
        store.record(first)
        store.append(batch(plain("T1", T0, 1.0)))
        store.record(second)
        assert store.occurrences(ALWAYS) == (second, first)
        store.close()
        store = opened()
        assert store.occurrences(ALWAYS) == (second, first)
        assert store.occurrences(Span(T0, T0 + 5 * S)) == (second,)
        store.close()

    def test_a_gap_of_months_and_a_clock_that_steps_back_lose_nothing(self, opened: Open) -> None:
        owns = (T0, T0 + 60 * 86_400 * S, T0 + 3600 * S, T0 - 7200 * S, T0 + 1)
        every = [batch(plain("T1", own, float(k)), plain("T1", T0, -1.0), own_us=own) for k, own in enumerate(owns)]
        store = opened()
        for one in every:
            store.append(one)
        store.close()
        store = opened()
        assert rows_of(store.read(["T1"], ALWAYS)["T1"]) == expected_of(every, "T1")
        store.close()

    @pytest.mark.parametrize("name", ["", "a\nb", "x" * 600, "\ud800"], ids=["empty", "line", "long", "surrogate"])
    def test_what_is_no_name_is_refused_and_the_batch_with_it(self, opened: Open, name: str) -> None:
        store = opened()
        with pytest.raises(ValueError, match="is no name of a tag; it needs 1 to 512 visible characters"):
            store.append(batch(plain("T1", T0, 1.0), plain(name, T0, 1.0)))
        assert store.tags() == ()
        store.append(batch(plain("T1", T0, 2.0)))
        assert store.read(["T1"], ALWAYS)["T1"].value.tolist() == [2.0]
        store.close()

    def test_a_closed_store_takes_nothing_and_says_so(self, opened: Open) -> None:
        store = opened()
        store.close()
        store.close()
        with pytest.raises(HistoryError, match="is closed; append before closing it"):
            store.append(batch(plain("T1", T0, 1.0)))

    def test_a_reader_beside_sees_what_is_appended_while_it_is_written(
        self, opened: Open, reader: Callable[[], HistoryReader]
    ) -> None:
        store = opened()
        beside = reader()
        for k in range(30):
            store.append(batch(plain("T1", T0 + k * 400 * S, float(k)), own_us=T0 + k * 400 * S))
            assert beside.read(["T1"], ALWAYS)["T1"].value.tolist() == [float(v) for v in range(k + 1)]
            assert store.read(["T1"], ALWAYS)["T1"].length == k + 1
            assert beside.minutes(["T1"], ALWAYS)["T1"].count.sum() == k + 1
        store.close()
        assert beside.read(["T1"], ALWAYS)["T1"].length == 30
