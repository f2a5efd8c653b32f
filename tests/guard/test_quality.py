"""Quality of readings: each reason, and no sample, however wrong, that raises."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.plant.rules import SIGMAS, QualityRule
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.guard.watch.quality import QualityWatch
from tests.guard.vessel import TAGS

pytestmark = pytest.mark.quick

RULE = QualityRule("T", 5.0, noise=0.5, frozen_s=10.0, fastest=0.5, grace_s=5.0)


def watch(rule: QualityRule = RULE) -> tuple[QualityWatch, list[Any]]:
    noted: list[Any] = []
    return QualityWatch({"T": rule}, TAGS, lambda event, at_s: noted.append(event)), noted


def sample(at_s: float, value: Any = 305.0, **rest: Any) -> Snapshot:
    return Snapshot(at_s, {"T": value}, **rest)


def quality(seen: Snapshot | None) -> Quality:
    assert seen is not None
    return Quality.BAD if "T" in seen.bad else Quality.UNCERTAIN if "T" in seen.uncertain else Quality.GOOD


def reason(seen: Snapshot | None) -> str:
    assert seen is not None
    return seen.reasons.get("T", "")


def wiggled(w: QualityWatch, until: int) -> Snapshot | None:
    seen = None
    for n in range(1, until + 1):
        seen = w.assess(float(n), sample(float(n), 305.0 + 0.1 * (n % 2)))
    return seen


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"value": math.nan}, "is not a number"),
        ({"value": math.inf}, "is not a number"),
        ({"value": "305"}, "is not a number"),
        ({"value": True}, "is not a number"),
        ({"value": None}, "is not a number"),
        ({"value": 10**400}, "is not a number"),
        ({"bad": frozenset({"T"}), "reasons": {"T": "wire break"}}, "wire break"),
        ({"bad": frozenset({"T"})}, "no reason is given"),
        ({"value": 382.21}, "outside its instrument's range 270 to 380 K"),
        ({"value": 267.79}, "outside its instrument's range"),
        ({"taken_s": {"T": 20.0}}, "old"),
    ],
)
def test_a_bad_reading_has_a_reason_and_no_value(given: dict[str, Any], why: str) -> None:
    w, noted = watch()
    wiggled(w, 5)
    seen = w.assess(6.0, sample(6.0, **given))
    for late in (6.0, 12.0):  # a value from the future is not taken, and the last one grows old
        if quality(seen) is not Quality.BAD:
            seen = w.assess(late + 1.0, sample(late + 1.0, **given))
    assert seen is not None and quality(seen) is Quality.BAD and math.isnan(seen.values["T"])
    assert why in reason(seen)
    assert noted[-1].quality == "bad" and why in noted[-1].reason


@pytest.mark.parametrize("value", [382.19, 267.81])
def test_an_instrument_may_read_a_little_outside_its_range(value: float) -> None:
    w, _ = watch(QualityRule("T", 5.0))
    assert quality(w.assess(1.0, sample(1.0, value))) is Quality.GOOD


def test_a_missing_tag_is_bad_and_comes_back_by_itself() -> None:
    w, noted = watch()
    wiggled(w, 5)
    seen = w.assess(6.0, Snapshot(6.0, {"L": 8.0}))
    assert quality(seen) is Quality.BAD and "missing" in reason(seen)
    assert quality(w.assess(7.0, sample(7.0))) is Quality.GOOD
    assert [e.quality for e in noted] == ["bad", "good"]


def test_a_reading_grows_old_when_samples_stop() -> None:
    w, _ = watch()
    wiggled(w, 5)
    assert quality(w.assess(10.0, None)) is Quality.GOOD
    assert w.trouble == "no sample came"
    seen = w.assess(10.1, None)
    assert quality(seen) is Quality.BAD and "5.1 s old; at most 5 s are allowed" in reason(seen)


def test_what_the_plant_held_long_ago_is_not_known_and_tags_without_a_rule_grow_old_as_well() -> None:
    w, _ = watch()
    first = Snapshot(1.0, {"T": 305.0, "F.sp": 0.0}, accepted={"F.sp": 0.0})
    seen = w.assess(1.0, first)
    assert seen is not None and seen.accepted == {"F.sp": 0.0} and seen.values["F.sp"] == 0.0
    seen = w.assess(6.0, None)
    assert seen is not None and seen.accepted == {"F.sp": 0.0}
    seen = w.assess(6.5, None)
    assert seen is not None and seen.accepted == {} and math.isnan(seen.values["F.sp"]) and "F.sp" in seen.bad


def test_a_bad_tag_without_a_rule_has_no_value() -> None:
    w, _ = watch()
    seen = w.assess(1.0, Snapshot(1.0, {"T": 305.0, "L": 8.0, "V": 1.0}, frozenset({"L"}), frozenset({"V"})))
    assert seen is not None and math.isnan(seen.values["L"]) and seen.bad == {"L"} and seen.uncertain == {"V"}


@pytest.mark.parametrize(
    ("at_s", "why"),
    [
        (math.nan, "nan"), (math.inf, "inf"), (-1.0, "it is 6 s now"), (6.1, "it is 6 s now"), (5.0, "no newer"),
        (4.0, "no newer"), ("6", "nan"), (None, "nan"),
    ],
)  # fmt: skip
def test_a_sample_out_of_time_is_no_sample(at_s: Any, why: str) -> None:
    w, _ = watch()
    wiggled(w, 5)
    seen = w.assess(6.0, sample(at_s, 350.0))
    assert why in w.trouble
    assert seen is not None and seen.at_s == 5.0 and seen.values["T"] == pytest.approx(305.1)
    w.assess(7.0, sample(7.0))
    assert w.trouble == ""


def test_a_value_that_never_changes_is_frozen_only_where_noise_is_stated() -> None:
    for rule, frozen in (
        (RULE, True), (QualityRule("T", 5.0, None, 10.0), False), (QualityRule("T", 5.0, 0.0, 10.0), False),
        (QualityRule("T", 5.0, 0.5, None), False),
    ):  # fmt: skip
        w, _ = watch(rule)
        found = [quality(w.assess(float(n), sample(float(n)))) for n in range(1, 13)]
        assert found[:10] == [Quality.GOOD] * 10
        assert (found[10] is Quality.BAD) is frozen


def test_a_frozen_value_stays_frozen_when_bad_ones_come_between() -> None:
    w, _ = watch()
    found = [quality(w.assess(float(n), sample(float(n), 305.0 if n % 2 else math.nan))) for n in range(1, 14)]
    assert found[12] is Quality.BAD
    seen = w.assess(15.0, sample(15.0, 305.2))
    assert quality(seen) is Quality.GOOD


def test_a_step_that_is_too_fast_is_uncertain_for_its_grace_then_counts() -> None:
    w, _ = watch()
    wiggled(w, 5)  # 305.1 at last
    step = 0.5 + SIGMAS * 0.5
    assert quality(w.assess(6.0, sample(6.0, 305.1 + step - 0.001))) is Quality.GOOD
    w, _ = watch()
    wiggled(w, 5)
    found = [quality(w.assess(6.0 + n, sample(6.0 + n, 305.1 + step + 0.001 + 0.1 * n))) for n in range(7)]
    assert found == [Quality.UNCERTAIN] * 5 + [Quality.GOOD] * 2


def test_one_wild_value_is_uncertain_alone() -> None:
    w, _ = watch()
    wiggled(w, 5)  # 305.1 at last
    values = [295.0, 305.0, 305.2, 305.1]
    found = [quality(w.assess(6.0 + n, sample(6.0 + n, v))) for n, v in enumerate(values)]
    assert found == [Quality.UNCERTAIN, *[Quality.GOOD] * 3]


@pytest.mark.parametrize(("period", "longest"), [(1, 1), (2, 2), (9, 5)])
def test_steps_without_end_are_no_excuse_without_end(period: int, longest: int) -> None:
    w, _ = watch()
    found = []
    for n in range(1, 62):
        found.append(quality(w.assess(float(n), sample(float(n), 305.0 + 20.0 * (n // period % 2) + 0.1 * (n % 2)))))
    assert found.count(Quality.GOOD) >= 28
    doubts = "".join("u" if q is Quality.UNCERTAIN else "g" for q in found).split("g")
    assert max(map(len, doubts)) == longest


def test_a_step_over_a_gap_may_be_as_large_as_the_gap_is_long() -> None:
    w, _ = watch()
    wiggled(w, 5)
    assert quality(w.assess(25.0, sample(25.0, 305.1 + 10.0 + SIGMAS * 0.5 - 0.1))) is Quality.GOOD


def test_what_the_link_calls_uncertain_is_uncertain() -> None:
    w, _ = watch()
    seen = w.assess(1.0, sample(1.0, uncertain=frozenset({"T"}), reasons={"T": "maintenance"}))
    assert quality(seen) is Quality.UNCERTAIN and "maintenance" in reason(seen)
    seen = w.assess(2.0, sample(2.0, 305.1, uncertain=frozenset({"T"})))
    assert "no reason is given" in reason(seen)


def test_an_older_value_of_one_tag_leaves_the_last_one() -> None:
    w, _ = watch()
    w.assess(5.0, sample(5.0, 305.0))
    seen = w.assess(6.0, sample(6.0, 399.0, taken_s={"T": 5.0}))
    assert seen is not None and seen.values["T"] == 305.0
    seen = w.assess(7.0, sample(7.0, 306.0, taken_s={"T": 6.5}))
    assert seen is not None and seen.values["T"] == 306.0


def test_a_sample_cannot_be_altered_after_it_was_looked_at() -> None:
    w, _ = watch()
    values, accepted = {"T": 305.0}, {"F.sp": 0.0}
    seen = w.assess(1.0, Snapshot(1.0, values, accepted=accepted))
    values["T"], accepted["F.sp"] = 399.0, 1.0
    again = w.assess(2.0, None)
    for s in (seen, again):
        assert s is not None and s.values["T"] == 305.0 and s.accepted == {"F.sp": 0.0}


def test_a_target_that_is_no_number_is_not_told() -> None:
    w, _ = watch()
    told = {"F.sp": math.nan, "T.sp": "310", "V.man": None, "X.cmd": 1}
    seen = w.assess(1.0, sample(1.0, accepted=told))
    assert seen is not None and seen.accepted == {"V.man": None, "X.cmd": 1.0}


MICROSECOND_S = 1e-6


def test_before_the_first_sample_there_is_no_reading_and_nothing_is_wrong_yet() -> None:
    w, _ = watch()
    assert w.trouble == ""
    assert w.assess(1.0, None) is None and w.trouble == "no sample came"


@pytest.mark.parametrize(("error", "why"), [(ValueError("half a frame"), "half a frame"), (OSError(), "OSError")])
def test_a_sample_that_cannot_be_read_says_why(error: Exception, why: str) -> None:
    class Broken:
        at_s = 1.0

        @property
        def accepted(self) -> Any:
            raise error

    w, _ = watch()
    assert w.assess(1.0, Broken()) is None  # type: ignore[arg-type]
    assert w.trouble == f"the sample cannot be read: {why}"


@pytest.mark.parametrize(
    ("at_s", "usable"), [(0.0, True), (MICROSECOND_S, True), (1.5 * MICROSECOND_S, False), (-MICROSECOND_S, False)]
)
def test_a_time_may_lie_ahead_by_its_rounding_and_no_more(at_s: float, usable: bool) -> None:
    w, _ = watch()
    seen = w.assess(0.0, sample(at_s))
    assert (seen is not None) is usable is (w.trouble == "")
    w, _ = watch()
    seen = w.assess(0.0, sample(0.0, taken_s={"T": at_s}))
    assert (quality(seen) is Quality.GOOD) is (usable or at_s < 0.0)  # an instrument may have been read earlier


@pytest.mark.parametrize(("stale_s", "forgotten_s"), [({}, 10.0), ({"T": 5.0, "L": 20.0}, 20.0)])
def test_targets_are_known_as_long_as_the_most_patient_rule_says(stale_s: dict[str, float], forgotten_s: float) -> None:
    rules = {tag: QualityRule(tag, s) for tag, s in stale_s.items()}
    w = QualityWatch(rules, TAGS, lambda event, at_s: None)
    w.assess(1.0, Snapshot(1.0, {"F.sp": 0.0}, accepted={"F.sp": 0.0}))
    seen = w.assess(1.0 + forgotten_s, None)
    assert seen is not None and seen.accepted == {"F.sp": 0.0} and seen.values["F.sp"] == 0.0
    seen = w.assess(1.1 + forgotten_s, None)
    assert seen is not None and seen.accepted == {} and "F.sp" in seen.bad


def test_a_bad_reading_stays_bad_until_a_better_one_comes() -> None:
    w, noted = watch()
    wiggled(w, 5)
    w.assess(6.0, sample(6.0, 350.0, bad=frozenset({"T"}), reasons={"T": "wire break"}))
    seen = w.assess(7.0, None)
    assert quality(seen) is Quality.BAD and "wire break" in reason(seen)
    seen = w.assess(8.0, sample(8.0, 305.1, taken_s={"T": 5.5}))
    assert seen is not None and quality(seen) is Quality.GOOD and seen.values["T"] == 305.1
    assert [e.quality for e in noted] == ["bad", "good"]


def test_a_value_that_came_marked_bad_is_never_used_later() -> None:
    w, _ = watch()
    wiggled(w, 5)
    w.assess(6.0, sample(6.0, 350.0, bad=frozenset({"T"})))
    seen = w.assess(7.0, sample(7.0, 306.0, taken_s={"T": 4.0}))  # its last good value comes once more
    assert seen is not None and quality(seen) is Quality.GOOD and seen.values["T"] == pytest.approx(305.1)


def test_a_reading_that_is_newer_than_its_sample_outlives_it() -> None:
    w, _ = watch()
    w.assess(6.0, sample(1.0, taken_s={"T": 6.0}))
    seen = w.assess(6.5, None)
    assert seen is not None and seen.values["T"] == 305.0 and seen.bad == frozenset()


def test_a_reading_is_bad_or_uncertain_never_both_and_a_good_one_needs_no_reason() -> None:
    w, _ = watch()
    seen = w.assess(1.0, sample(1.0, 400.0, uncertain=frozenset({"T"}), reasons={"T": "maintenance"}))
    assert seen is not None and seen.bad == {"T"} and seen.uncertain == frozenset()
    w, _ = watch()
    seen = w.assess(2.0, sample(2.0, 305.0, reasons={"T": "all is well", "L": "no rule looks at it"}))
    assert seen is not None and seen.reasons == {"L": "no rule looks at it"}


@pytest.mark.parametrize("noise", [None, 0.0])
def test_without_noise_a_step_is_judged_by_the_process_alone(noise: float | None) -> None:
    rule = QualityRule("T", 5.0, noise=noise, fastest=0.5, grace_s=5.0)
    for value, expected in ((305.5, Quality.GOOD), (305.51, Quality.UNCERTAIN)):
        w, _ = watch(rule)
        w.assess(1.0, sample(1.0, 305.0))
        seen = w.assess(2.0, sample(2.0, value))
        assert quality(seen) is expected
    assert reason(seen) == "'T' moved faster than 0.5 K/s"


@pytest.mark.parametrize(("again_s", "expected"), [(15.0, Quality.GOOD), (16.0, Quality.UNCERTAIN)])
def test_another_step_is_excused_once_the_raw_reading_has_counted_for_a_grace_time(
    again_s: float, expected: Quality
) -> None:
    w, _ = watch()
    wiggled(w, 5)
    value = 305.0
    for n in range(6, 17):  # uncertain from 6 to 11 s, raw from 11 to 16 s
        value += 20.0 if n in (6.0, again_s) else 0.1
        seen = w.assess(float(n), sample(float(n), value))
        if n == again_s:
            assert quality(seen) is expected
            return


@pytest.mark.parametrize(
    ("value", "expected"),
    [(-52.0, Quality.GOOD), (52.0, Quality.GOOD), (-52.001, Quality.BAD), (52.001, Quality.BAD)],
)
def test_an_instrument_is_believed_to_the_very_end_of_its_slack(value: float, expected: Quality) -> None:
    tags = {"T": Tag("T", Role.PV, "K", Range(-50.0, 50.0), 1.0)}
    w = QualityWatch({"T": QualityRule("T", 5.0)}, tags, lambda event, at_s: None)
    assert quality(w.assess(1.0, sample(1.0, value))) is expected


def test_a_reason_without_end_is_cut() -> None:
    w, _ = watch()
    seen = w.assess(1.0, sample(1.0, bad=frozenset({"T"}), reasons={"T": "x" * 10_000}))
    assert reason(seen) == "'T' is marked bad: " + "x" * 200


anything = st.one_of(
    st.none(), st.floats(), st.integers(), st.booleans(), st.text(max_size=3), st.complex_numbers(),
    st.lists(st.floats(), max_size=2),
)  # fmt: skip
mappings = st.one_of(st.dictionaries(st.sampled_from(["T", "L", "Q"]), anything), anything)


@settings(max_examples=100)
@given(at_s=anything, values=mappings, bad=mappings, reasons=mappings, taken=mappings, accepted=mappings)
def test_no_sample_raises_and_the_next_good_one_counts(
    at_s: Any, values: Any, bad: Any, reasons: Any, taken: Any, accepted: Any
) -> None:
    w, _ = watch()
    w.assess(5.0, sample(5.0))
    w.assess(6.0, Snapshot(at_s, values, bad, bad, reasons, taken, accepted))
    w.assess(6.0, "a sample")  # type: ignore[arg-type]
    seen = w.assess(7.0, sample(7.0, 305.3))
    assert seen is not None and quality(seen) is Quality.GOOD and seen.values["T"] == 305.3
