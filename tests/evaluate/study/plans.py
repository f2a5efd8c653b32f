"""Plans and their jobs, as short as a test needs them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.plan.plan import Plan
from homeostat.record.row import WALL, Row

BATCH = {"case": "mixing_module", "end_s": 400.0}
"""A batch without a fault."""
PUMP = {**BATCH, "fault": "pump_failure"}
"""A batch whose pump fails."""
COOLING = {"case": "cstr", "fault": "cool_stuck_closed", "onset_s": 900.0, "end_s": 1200.0}
"""The reactor, whose cooling sticks 300 s before the end."""


def jobs(folder: Path = Path(), **content: Any) -> tuple[Job, ...]:
    """The jobs of a plan; nothing is kept unless it says so."""
    return jobs_of(Plan.model_validate({"title": "A study", "keep": "none", **content}), folder)


def one(proposer: str | dict[str, Any], scenario: Mapping[str, Any], ablation: str = "none", **content: Any) -> Job:
    """The only job of one proposer in one scenario under one ablation."""
    (job,) = jobs(proposers=[proposer], scenarios=[scenario], ablations=[ablation], **content)
    return job


def lasting(row: Row) -> dict[str, Any]:
    """What does not depend on the machine; not where it was kept either."""
    return {name: value for name, value in asdict(row).items() if not name.startswith(WALL) and name != "trace"}
