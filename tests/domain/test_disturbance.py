"""The texts of disturbances: what they say, what they come to at each moment, and what is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.disturbance import SHORTEST_S, Disturbance, DisturbanceError, Effect, Shape

SIZES = st.floats(-1e6, 1e6, allow_nan=False)
TIMES = st.floats(0.001, 1e6)


@st.composite
def disturbances(draw: st.DrawFn) -> Disturbance:
    effect = draw(st.sampled_from(Effect))
    size = 0.0 if effect is Effect.FROZEN else draw(SIZES)
    if effect in (Effect.NOISE, Effect.SLOW):
        size = abs(size)
    if effect is Effect.STICTION:
        size = abs(size) / 1e6
    from_s = draw(st.just(0.0) | TIMES)
    to_s = draw(st.just(math.inf) | TIMES.map(lambda more: from_s + more))
    shaped = st.just(0.0) if effect is Effect.FROZEN else st.just(0.0) | TIMES
    shape = Shape.STATED if effect is Effect.FROZEN else draw(st.sampled_from(Shape))
    if shape is Shape.STATED:
        return Disturbance("T_coolant", effect, size, from_s, to_s, draw(shaped), draw(shaped))
    every_s = draw(TIMES) + SHORTEST_S
    longest_s = draw(st.just(0.0) | TIMES.map(lambda more: every_s + more))
    back_s = draw(shaped) if shape is Shape.BURSTING else 0.0
    return Disturbance("T_coolant", effect, size, from_s, to_s, draw(shaped), every_s, shape, longest_s, back_s)


@given(disturbances())
def test_a_text_says_what_it_was_written_from(disturbance: Disturbance) -> None:
    assert Disturbance.parse(str(disturbance)) == disturbance


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("T_coolant + 10 from 1500", Disturbance("T_coolant", Effect.PLUS, 10.0, 1500.0)),
        ("T_coolant+10", Disturbance("T_coolant", Effect.PLUS, 10.0)),
        ("T_coolant - 1e1", Disturbance("T_coolant", Effect.PLUS, -10.0)),
        (" F3_max *0.75 every 120  from 1500 ", Disturbance("F3_max", Effect.TIMES, 0.75, 1500.0, every_s=120.0)),
        ("T1 reads - 3 from 1500 over 1000", Disturbance("T1", Effect.READS_PLUS, -3.0, 1500.0, over_s=1000.0)),
        ("B201.level reads * .8", Disturbance("B201.level", Effect.READS_TIMES, 0.8)),
        ("T1 frozen from 5 to 9", Disturbance("T1", Effect.FROZEN, 0.0, 5.0, 9.0)),
        ("T1 noise*5", Disturbance("T1", Effect.NOISE, 5.0)),
        ("V2 stiction 0.06", Disturbance("V2", Effect.STICTION, 0.06)),
        ("V2 slow 25", Disturbance("V2", Effect.SLOW, 25.0)),
        (
            "A_in_4 + 0.03 wandering every 1080..2520 from 5",
            Disturbance("A_in_4", Effect.PLUS, 0.03, 5.0, every_s=1080.0, shape=Shape.WANDERING, longest_s=2520.0),
        ),
        (
            "k1*1.25 wandering to 5 every 1e3",
            Disturbance("k1", Effect.TIMES, 1.25, to_s=5.0, every_s=1e3, shape=Shape.WANDERING),
        ),
        (
            "UA_R * .65 bursting every 1800..12600. back 360",
            Disturbance("UA_R", Effect.TIMES, 0.65, 0.0, math.inf, 0.0, 1800.0, Shape.BURSTING, 12600.0, 360.0),
        ),
    ],
)
def test_what_a_person_writes_is_read(text: str, meant: Disturbance) -> None:
    assert Disturbance.parse(text) == meant


@pytest.mark.parametrize(
    "text",
    [
        "", "T1", "T1 +", "+ 3", "T1 reads", "T1 reads 3", "T1 frozen 3", "T1 noise + 3", "T1 slow",
        "T1 + nan", "T1 + 1e999", "T1 + 3 from", "T1 + 3 from x", "T1 + 3 from 1 from 2", "T1 + 3 from -1",
        "T1 + 3 from 5 to 5", "T1 + 3 to 0", "T1 + 3 over 0", "T1 + 3 every -2", "T1 frozen over 5",
        "V2 stiction 1.5", "V2 stiction -0.1", "V2 slow -1", "T1 noise * -1", "T1 + 3 until 5", "T1 + 3; T2 + 4",
        "T1 + 3 wandering", "T1 wandering every 5", "T1 + 3 every 5 wandering", "T1 + 3 every 5..9", "T1 + 3 back 5",
        "T1 + 3 wandering every 0.5", "T1 + 3 wandering every 9..5", "T1 + 3 wandering every 5..5",
        "T1 + 3 wandering every 5 back 2", "T1 + 3 bursting every 5 back 0", "T1 + 3 bursting every -5..5",
        "T1 + 3 wandering every 5..", "T1 + 3 wandering every 5..1e999", "T1 frozen wandering every 5",
        "T1 + 3 wandering bursting every 5", "T1 + 3 wandering every 5 to 4..9",
    ],
)  # fmt: skip
def test_what_says_no_disturbance_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(DisturbanceError) as refused:
        Disturbance.parse(text)
    assert "\n" not in str(refused.value) and repr(text) in str(refused.value)


@given(disturbances(), st.floats(0.0, 2e6))
def test_nothing_is_disturbed_outside_its_time(disturbance: Disturbance, at_s: float) -> None:
    share = disturbance.share(at_s)
    assert -1.0 <= share <= 1.0
    if not disturbance.from_s <= at_s < disturbance.to_s:
        assert share == 0.0 and disturbance.applied(0.7, at_s) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("text", "at_s", "found"),
    [
        ("X + 10 from 100", 99.0, 2.0),
        ("X + 10 from 100", 100.0, 12.0),
        ("X * 0.5 from 100 to 200", 200.0, 2.0),
        ("X + 10 from 100 over 50", 125.0, 7.0),
        ("X * 0.5 from 100 over 50", 125.0, 1.5),
        ("X * 0.5 from 100 every 120", 130.0, 1.0),
        ("X * 0.5 from 100 every 120", 190.0, 3.0),
        ("X + 10 from 0 every 4 over 10", 5.0, 7.0),
    ],
)
def test_steps_ramps_and_sines_by_hand(text: str, at_s: float, found: float) -> None:
    assert Disturbance.parse(text).applied(2.0, at_s) == pytest.approx(found)
