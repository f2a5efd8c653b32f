"""The engine against figures of the published reactor that are few enough to stand here.

They hold the claims of ``test_cstr_published`` and of the recorded half of ``test_recorded_calls`` where the published
trajectories and records are not beside the project. Source: the noise-free trajectories and the study of 3 August
2026 that go with the published reactor (Autonomous Industrial Systems Laboratory, 2026).
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.published_rules import replay
from benchmarks.recorded_calls import Reason, RecordedCall, Shown, by_run, read_calls, repeats
from tests.plants.cstr.reactor import FAULTS, PUBLISHED, SEVERITY, batch, parameters, run

ONSET_S, SHUTDOWN_S = 2000.0, 7000
JUDGED = slice(int(ONSET_S), SHUTDOWN_S)
"""From the second after the onset to the end of the phase NORMAL."""


class Course(NamedTuple):
    """What a trajectory without noise comes to from 2001 to 7000 s."""

    peak_k: float
    """Highest temperature [K]."""
    hot_s: int
    """Seconds above 313 K."""
    peak_l: float
    """Highest level [L]."""
    full_s: int
    """Seconds above 11 L."""
    last: tuple[float, float, float, float]
    """At 7000 s: temperature [K], level [L], position of the cooling water valve [1], speed of the pump [1]."""


COURSES = {
    "normal": Course(310.0000758, 0, 9.9946403, 0, (310.0, 9.9946403, 0.5076044, 0.4166667)),
    "fouling": Course(313.9674640, 831, 9.9946403, 0, (313.9674640, 9.9946403, 1.0, 0.4166667)),
    "pump_degrade": Course(310.0003118, 0, 11.0356757, 63, (310.0, 10.0, 0.5076045, 0.8333333)),
    "cool_stuck_closed": Course(316.1180649, 4917, 9.9946403, 0, (316.1180649, 9.9946403, 0.3, 0.4166667)),
    "cool_stuck_open": Course(309.8873398, 0, 9.9946403, 0, (302.8568969, 9.9946403, 1.0, 0.4166667)),
    "outlet_block": Course(310.0004896, 0, 11.5111529, 4966, (310.0, 11.5066667, 0.5076113, 1.0)),
    "inlet_stuck_open": Course(315.4570364, 301, 10.0210381, 0, (310.0000018, 9.9926269, 0.9536245, 0.75)),
    "temp_bias": Course(309.9977800, 0, 9.9946403, 0, (305.0000004, 9.9946403, 0.8030260, 0.4166667)),
    "level_bias": Course(310.0000758, 0, 9.9946403, 0, (310.0, 9.9946403, 0.5076044, 0.4166667)),
    "leak": Course(310.4495784, 0, 9.9446671, 0, (310.0, 0.0, 0.5523473, 0.4166667)),
}
STARTED = {"V": 10.0220937, "CA": 0.0322992, "CB": 0.0232485, "CC": 0.5036540, "CD": 0.2563523, "T": 312.0217190}
"""State at 304 s, when the vessel is full for the first time: volume [L], concentrations [mol/L], temperature [K]."""


def test_the_figures_are_of_ten_cases() -> None:
    assert set(COURSES) == {"normal", *FAULTS}


@pytest.mark.parametrize("plant", COURSES)
def test_the_engine_comes_to_the_published_figures(plant: str) -> None:
    faults = {} if plant == "normal" else {plant: (SEVERITY[plant], ONSET_S)}
    engine = run(batch(SHUTDOWN_S, p=parameters(**PUBLISHED), faults=faults))
    temperature, level = engine.of("T")[JUDGED], engine.of("V")[JUDGED]
    last = [engine.of(name)[-1] for name in ("T", "V", "V2_pos", "P1_pos")]
    told = COURSES[plant]
    assert (int((temperature > 313.0).sum()), int((level > 11.0).sum())) == (told.hot_s, told.full_s)
    assert [temperature.max(), level.max()] == pytest.approx([told.peak_k, told.peak_l], rel=0.0, abs=2e-7)
    assert last == pytest.approx(told.last, rel=0.0, abs=2e-7)


def test_the_engine_starts_as_the_published_reactor() -> None:
    engine = run(batch(304, p=parameters(**PUBLISHED)))
    reached = np.array([engine.of(name)[-1] for name in STARTED])
    np.testing.assert_allclose(reached, list(STARTED.values()), rtol=0.0, atol=1.2e-7)


class Told(NamedTuple):
    """What was recorded of one rollout."""

    feed: float
    """Feed setpoint that was simulated, as a share of the full feed [1]."""
    reason: Reason
    """The verdict."""
    safe_after_s: float | None
    """Seconds to the end of the first safe minute."""
    unsafe_s: float
    """Seconds that counted as unsafe."""
    peak_k: float
    """Highest measured temperature [K]."""
    peak_cooling: float
    """Widest opening of the cooling water valve [1]."""
    temperature: float = 310.0
    """Temperature setpoint [K]."""
    level: float = 10.0
    """Level setpoint [L]."""


class Asked(NamedTuple):
    """One run in which a model was asked."""

    fault: str
    """Its fault."""
    onset_s: float
    """When it began."""
    time_s: int
    """When the model was asked."""
    shown: Shown
    """What it was shown."""
    rollouts: tuple[Told, ...]
    """Its answers in order."""


RUNS = (
    Asked(
        "cool_stuck_closed", 2085.0, 2134,
        Shown(312.0649864357, 9.9945529679, 0.5464643399, 0.4145077614, 0.3),
        (
            Told(0.85, Reason.NO_RECOVERY, None, 4519.0, 315.7636412913, 0.3),
            Told(0.85, Reason.NO_RECOVERY, None, 4559.0, 315.8439758216, 0.3, temperature=309.95),
            Told(0.765, Reason.PASS, 279.0, 846.0, 314.6424835084, 0.3, temperature=309.95),
        ),
    ),
    Asked(
        "cool_stuck_closed", 2104.0, 2158,
        Shown(312.6622341320, 9.9952613081, 0.5508066777, 0.4233023538, 0.3),
        (
            Told(0.85, Reason.NO_RECOVERY, None, 4503.0, 315.7636412913, 0.3),
            Told(0.85, Reason.NO_RECOVERY, None, 4545.0, 315.8439758216, 0.3, temperature=309.5),
            Told(0.85, Reason.NO_RECOVERY, None, 4518.0, 316.0627217812, 0.3, temperature=309.0),
            Told(0.765, Reason.NO_RECOVERY, None, 895.0, 314.4385846500, 0.3, temperature=309.0),
            Told(0.85, Reason.NO_RECOVERY, None, 4507.0, 315.8056406948, 0.3, temperature=309.0),
            Told(0.765, Reason.SLOW_RECOVERY, 3542.0, 736.0, 314.3346004512, 0.3, temperature=309.0),
        ),
    ),
    Asked(
        "fouling", 2177.67725857425, 4799,
        Shown(311.7995018247, 9.9945113840, 0.5538662915, 0.4140935260, 0.9507377557),
        (
            Told(0.85, Reason.UNSAFE_FRACTION, 200.0, 1058.0, 313.0226464671, 1.0),
            Told(0.85, Reason.UNSAFE_FRACTION, 271.0, 1099.0, 312.9140866033, 1.0, level=9.5),
            Told(0.765, Reason.PASS, 119.0, 219.0, 312.1546172612, 0.9959694110, level=9.5),
        ),
    ),
    Asked(
        "pump_degrade", 1860.0, 1915,
        Shown(309.9518748902, 10.7011235881, 0.5605675250, 0.6038712499, 0.5076174392),
        (Told(1.0, Reason.PASS, 322.0, 203.0, 311.7694778888, 0.5191054121, level=10.5),),
    ),
)  # fmt: skip
"""Runs of each fault of the study; between them every verdict."""
REPEATED, NUDGED = 0.85, 0.765
"""The feed of the proposals that the published rule multiplied by 0.9 because they were repeated, and what it made."""


def line(asked: Asked, number: int, told: Told, draws: int) -> dict[str, object]:
    """One record in the form of the published file, as far as it is read."""
    seen, set_to = asked.shown, {"T_sp": told.temperature, "L_sp": told.level}
    nudged, simulated_s = told.feed == NUDGED, 8000.0 - asked.time_s
    return {
        "experiment": "cstr_20260803_182646", "fault": asked.fault, "run": 0, "call_index": number,
        "model_served": "gpt-4o-mini-2024-07-18", "fault_time_recovered": asked.onset_s, "time_s": float(asked.time_s),
        "snapshot": {
            "T_meas": seen.temperature, "L_meas": seen.level, "u_valve": seen.feed_valve, "u_pump": seen.pump,
            "u_cool": seen.cooling_valve,
        },
        "proposed_setpoints": {**set_to, "Fin_sp": (REPEATED if nudged else told.feed) / 30.0},
        "evaluated_setpoints": {**set_to, "Fin_sp": told.feed / 30.0},
        "nudged": nudged, "verdict": told.reason is Reason.PASS,
        "verdict_reason": "" if told.reason is Reason.PASS else told.reason.value,
        "rollout": {
            "time_to_safe": told.safe_after_s, "unsafe_time": told.unsafe_s, "total_time_simulated": simulated_s,
            "unsafe_fraction": told.unsafe_s / simulated_s, "peak_T_meas": told.peak_k, "peak_u_valve": math.nan,
            "peak_u_pump": math.nan, "peak_u_cool": told.peak_cooling,
        },
        "rng_index_at_rollout": draws,
    }  # fmt: skip


def recorded(asked: Asked, folder: Path) -> tuple[RecordedCall, ...]:
    """The run's calls, read from a file. Each goes on in the noise stream: five deviates a second, four in the end."""
    draws, lines = 5 * asked.time_s, []
    for number, told in enumerate(asked.rollouts, start=1):
        lines.append(line(asked, number, told, draws))
        draws += 5 * (SHUTDOWN_S - asked.time_s) + 4 * (8000 - SHUTDOWN_S)
    path = folder / "calls.jsonl"
    path.write_text("".join(json.dumps(record) + "\n" for record in lines), encoding="utf-8")
    (calls,) = by_run(read_calls(path)).values()
    return calls


@pytest.mark.parametrize("asked", RUNS, ids=lambda asked: f"{asked.fault}-{asked.time_s}")
def test_a_recorded_run_comes_out_as_it_was_recorded(asked: Asked, tmp_path: Path) -> None:
    """Verdicts, times and counts to the second; temperatures and positions to the nine digits that are told here."""
    replayed = list(replay(recorded(asked, tmp_path)))
    assert len(replayed) == len(asked.rollouts)
    for found in replayed:
        call, judgement = found.call, found.judgement
        assert call.accepted is (judgement.reason is Reason.PASS)
        assert (judgement.reason, judgement.time_to_safe_s) == (call.reason, call.time_to_safe_s)
        assert (judgement.unsafe_s, judgement.unsafe_fraction) == (call.unsafe_s, call.unsafe_fraction)
        assert (found.course.seconds, found.draws) == (call.simulated_s, call.draws)
        shown, expected = found.shown, call.shown
        assert [shown.temperature, shown.level] == pytest.approx(
            [expected.temperature, expected.level], rel=0.0, abs=1e-9
        )
        assert [shown.feed_valve, shown.pump, shown.cooling_valve] == pytest.approx(
            [expected.feed_valve, expected.pump, expected.cooling_valve], rel=0.0, abs=1e-9
        )
        signals = found.course.signals
        assert signals["T1"][1:].max() == pytest.approx(call.peaks.temperature, rel=0.0, abs=1e-9)
        assert signals["V2.pos"][1:].max() == pytest.approx(call.peaks.cooling_valve, rel=0.0, abs=1e-9)


def test_every_verdict_is_among_the_figures() -> None:
    assert {told.reason for asked in RUNS for told in asked.rollouts} == set(Reason)


@pytest.mark.parametrize("asked", RUNS, ids=lambda asked: f"{asked.fault}-{asked.time_s}")
def test_a_feed_that_was_changed_is_a_repeated_one(asked: Asked, tmp_path: Path) -> None:
    calls = recorded(asked, tmp_path)
    assert {call for call in calls if call.nudged} <= set(repeats(calls))
    for call in calls:
        assert call.evaluated.feed == pytest.approx((0.9 if call.nudged else 1.0) * call.proposed.feed, abs=1e-15)
