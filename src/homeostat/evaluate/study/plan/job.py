"""A job: one run of a campaign, with everything that it depends on; and its result is a row."""

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

import homeostat
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.plan.arm import Arm

PARTS = (".py", ".csv", ".lark", ".md", ".rq", ".toml", ".ttl")
"""Files of the package that what is computed depends on."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run."""

    scenario: Scenario
    """Its ground truth."""
    label: str
    """Name of the scenario in the file."""
    kind: str
    """``none``, ``single``, ``paired`` or ``unknown``."""
    published: str
    """Row of the published tables; empty for none."""
    arm: Arm
    """Who proposes, and how it is asked."""
    ablation: str
    """What is left out."""
    thinking: Thinking
    """How much process time thinking takes."""
    keep: str
    """Which runs are kept: ``failures``, ``all`` or ``none``."""

    @property
    def name(self) -> str:
        """Unique in its campaign, and good for a folder's name."""
        parts = (self.scenario.case, self.label, str(self.scenario.seed), self.arm.label, self.ablation)
        return "~".join("".join(c if c.isalnum() or c in "._-+" else "-" for c in part) for part in parts)

    @property
    def fingerprint(self) -> str:
        """Digest of everything that the row depends on, the installed package included.

        Not of what is kept, nor of the folder that recorded answers are in: their content counts.
        """
        arm = self.arm
        if arm.model is not None and arm.model.recorded is not None:
            arm = replace(arm, model=replace(arm.model, name=arm.who))
        job = asdict(replace(self, keep="", arm=arm))
        content = {**job, "code": code_digest(), "recorded": self.arm.recorded_digest}
        return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:32]


@cache
def code_digest() -> str:
    """Digest of the installed package: rows of two versions of it are no pair."""
    digest, root = hashlib.sha256(), Path(homeostat.__file__).parent
    for path in sorted(p for p in root.rglob("*") if p.suffix in PARTS):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
