"""What language models answered about the published reactor, as it was recorded, in typed form.

One line of the file is one call of one run: the plant is in the second ``time_s`` of a run whose fault began at
``onset_s``; the model proposes three setpoints; the published validator simulates three setpoints, which are not the
proposed ones where a fixed rule multiplied a repeated proposal's feed by 0.9 (``nudged``), and accepts or refuses.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[2] / "shared" / "data" / "reference" / "calls" / "cstr_calls.jsonl"
"""Where the records lie if they are there; they are not part of this project."""


class Reason(StrEnum):
    """What the published validator said."""

    PASS = "pass"
    NO_RECOVERY = "no_recovery"
    SLOW_RECOVERY = "slow_recovery"
    UNSAFE_FRACTION = "unsafe_fraction"


@dataclass(frozen=True, slots=True)
class Setpoints:
    """What may be set on the published reactor."""

    temperature: float
    """Reactor temperature [K]."""
    level: float
    """Level [L]."""
    feed: float
    """Feed flow [L/s]."""

    def __str__(self) -> str:
        return f"{self.temperature:g} K, {self.level:g} L, {self.feed:.4f} L/s"


@dataclass(frozen=True, slots=True)
class Shown:
    """What the model was shown of the plant, as far as it can be compared."""

    temperature: float
    """Measured reactor temperature [K]."""
    level: float
    """Measured level [L]."""
    feed_valve: float
    """Position of the feed valve [1]."""
    pump: float
    """Speed of the product pump [1]."""
    cooling_valve: float
    """Position of the cooling water valve [1]."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """Largest values of a recorded rollout."""

    temperature: float
    """Measured reactor temperature [K]."""
    feed_valve: float
    """Position of the feed valve [1]."""
    pump: float
    """Speed of the product pump [1]."""
    cooling_valve: float
    """Position of the cooling water valve [1]."""


@dataclass(frozen=True, slots=True)
class RecordedCall:
    """One answer of a language model, and what the published validator made of it."""

    experiment: str
    """Name of the study."""
    fault: str
    """Injected fault."""
    run: int
    """Number of the run, counted from 0 for each fault of a study."""
    number: int
    """Number of the call in its run, counted from 1."""
    model_served: str
    """The model that answered, which is not always the one that was asked for."""
    onset_s: float
    """Process time from which the fault acted [s]."""
    time_s: int
    """Process time at which the plant stood still and the model was asked [s]."""
    shown: Shown
    """The plant at that time."""
    proposed: Setpoints
    """What the model answered."""
    evaluated: Setpoints
    """What the validator simulated."""
    nudged: bool
    """Whether the two differ by the rule for repeated proposals."""
    accepted: bool
    """The verdict."""
    reason: Reason
    """Why."""
    time_to_safe_s: float | None
    """Seconds from the call to the end of the first safe minute; None where there is none [s]."""
    unsafe_s: float
    """Seconds that counted as unsafe [s]."""
    unsafe_fraction: float
    """The same over all simulated seconds [1]."""
    simulated_s: float
    """Length of the rollout [s]."""
    peaks: Peaks
    """Largest values of the rollout."""
    draws: int
    """Normal deviates that the noise stream had given before the rollout."""

    @property
    def run_id(self) -> str:
        """Study, fault and number of the run."""
        return f"{self.experiment}/{self.fault}/{self.run}"


def read_calls(path: Path = FILE) -> tuple[RecordedCall, ...]:
    """Every call of the file, ordered by run and number."""
    with path.open(encoding="utf-8") as file:
        calls = [_call(json.loads(line)) for line in file]
    return tuple(sorted(calls, key=lambda c: (c.experiment, c.fault, c.run, c.number)))


def by_run(calls: Iterable[RecordedCall]) -> dict[str, tuple[RecordedCall, ...]]:
    """Run id -> its calls in order."""
    runs: dict[str, tuple[RecordedCall, ...]] = {}
    for call in calls:
        runs[call.run_id] = (*runs.get(call.run_id, ()), call)
    return runs


def repeats(calls: Sequence[RecordedCall]) -> tuple[RecordedCall, ...]:
    """The calls whose proposal, to the last digit, an earlier call of the same run had made."""
    runs = by_run(calls).values()
    return tuple(c for run in runs for k, c in enumerate(run) if c.proposed in {b.proposed for b in run[:k]})


def _call(line: dict[str, Any]) -> RecordedCall:
    snapshot, rollout = line["snapshot"], line["rollout"]
    return RecordedCall(
        experiment=line["experiment"], fault=line["fault"], run=line["run"], number=line["call_index"],
        model_served=line["model_served"], onset_s=line["fault_time_recovered"], time_s=round(line["time_s"]),
        shown=Shown(
            snapshot["T_meas"], snapshot["L_meas"], snapshot["u_valve"], snapshot["u_pump"], snapshot["u_cool"]
        ),
        proposed=_setpoints(line["proposed_setpoints"]), evaluated=_setpoints(line["evaluated_setpoints"]),
        nudged=line["nudged"], accepted=line["verdict"], reason=Reason(line["verdict_reason"] or "pass"),
        time_to_safe_s=rollout["time_to_safe"], unsafe_s=rollout["unsafe_time"],
        unsafe_fraction=rollout["unsafe_fraction"], simulated_s=rollout["total_time_simulated"],
        peaks=Peaks(
            rollout["peak_T_meas"], rollout["peak_u_valve"], rollout["peak_u_pump"], rollout["peak_u_cool"]
        ),
        draws=line["rng_index_at_rollout"],
    )  # fmt: skip


def _setpoints(values: dict[str, float]) -> Setpoints:
    return Setpoints(values["T_sp"], values["L_sp"], values["Fin_sp"])
