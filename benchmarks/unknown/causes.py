"""The causes of the study: what happens to the true plant, and what would be right to say of it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, permutations
from pathlib import Path
from typing import Any

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.domain.disturbance import Disturbance
from homeostat.plants.plant import Plant

FOLDER = Path(__file__).parent
PLANTS = ("cstr", "mixing_module")
KNOWN = "known"
HARMLESS = "harmless"
HEALTHY = "healthy"
PAIR = "pair"
LABEL = "label"
PAIRS = {"mixing_module": 20}
"""Plant -> pairs that each seed draws; every pair where it has no number."""
FORCED = {"mixing_module": 34}
"""Plant -> wrong labels that each seed draws; every one where it has no number."""
KNOWN_ONSETS_S = {"cstr": (1700.0, 3000.0), "mixing_module": (10.0, 200.0)}
"""Plant -> between which times a known fault begins [s]: once the plant is settled, while the batch runs."""


@dataclass(frozen=True, slots=True)
class Cause:
    """One thing that is wrong with a true plant, and the truth that statements are judged by."""

    id: str
    """What the study calls it."""
    kind: str
    """Class that it is counted under."""
    item: str = ""
    """The component that it truly is; empty where nothing is wrong."""
    balances: tuple[str, ...] = ()
    """Balances that it truly is in, as 'heat R1'."""
    known: bool = False
    """Whether its equation is in the fault list."""
    alike: tuple[str, ...] = ()
    """Items and balances that the instruments cannot tell from it."""
    measured: bool = False
    """Whether it is an input that an instrument measures."""
    spec: str = ""
    """The disturbance; empty for none."""
    fault: str = ""
    """The fault of the tables; empty for none."""
    severity: float = 0.0
    """Its severity, in its unit."""
    onset_s: float = 0.0
    """Its onset [s]."""
    also: FaultState | None = None
    """Another fault of the tables that is there, too; None for none."""
    told: FaultState | None = None
    """What recovery is told in place of a diagnosis; None where nobody tells it anything."""

    @property
    def faults(self) -> tuple[FaultState, ...]:
        """Faults of the tables that are truly there."""
        own = (FaultState(self.fault, self.severity, self.onset_s),) if self.fault else ()
        return own if self.also is None else (*own, self.also)

    def ended(self, at_s: float) -> bool:
        """Whether the disturbance acts no more at ``at_s`` [s]; a fault of the tables goes on."""
        return bool(self.spec) and not self.fault and at_s >= Disturbance.parse(self.spec).to_s


def unknown_causes(plant: str) -> tuple[Cause, ...]:
    """Every cause of the plant's table, those of the fault list included."""
    return tuple(
        Cause(
            row["id"],
            row["class"],
            row["item"],
            tuple(row["balances"]),
            row["known"],
            tuple(row["alike"]),
            row.get("measured", False),
            row["spec"],
        )
        for row in _table(plant)["cause"]
    )


def harmless_causes(plant: str) -> tuple[Cause, ...]:
    """What leaves every criterion of the plant satisfied with nobody acting."""
    return tuple(Cause(row["id"], HARMLESS, spec=row["spec"]) for row in _table(plant)["harmless"])


def known_faults(plant: Plant, seed: int) -> tuple[Cause, ...]:
    """Every fault of the tables, with the severity and the onset that ``seed`` draws."""
    (first_s, last_s), balances = KNOWN_ONSETS_S[plant.name], _table(plant.name)["known_balances"]
    drawn = np.random.default_rng([seed, 14])
    found = []
    for fault in plant.description.faults:
        share, at_s = drawn.random(), drawn.uniform(first_s, last_s)
        found.append(
            Cause(
                fault.name,
                KNOWN,
                fault.component,
                tuple(balances.get(fault.name, ())),
                known=True,
                fault=fault.name,
                severity=_severity(fault, share),
                onset_s=float(round(at_s)),
            )
        )
    return tuple(found)


def pairs(plant: Plant, seed: int) -> tuple[Cause, ...]:
    """Two faults of the tables at once, of severities and onsets that ``seed`` draws.

    Every pair of a plant for which :data:`PAIRS` has no number; else as many, drawn at random among those of two items:
    what is stuck closed is not stuck open.
    """
    every = list(combinations(known_faults(plant, seed), 2))
    count = PAIRS.get(plant.name)
    if count is not None:
        every = _drawn([p for p in every if p[0].item != p[1].item], count, seed)
    return tuple(replace(a, id=f"{a.id}+{b.id}", kind=PAIR, also=b.faults[0]) for a, b in every)


def forced_labels(plant: Plant, seed: int) -> tuple[Cause, ...]:
    """Every fault of the tables, of nominal severity, that recovery is told to be another one from its onset on.

    Of a plant that :data:`FORCED` has a number for only as many, drawn at random.
    """
    nominal = {f.name: f.severity_nominal for f in plant.description.faults}
    true = [replace(c, severity=nominal[c.fault]) for c in known_faults(plant, seed)]
    every = list(permutations(true, 2))
    count = FORCED.get(plant.name)
    chosen = every if count is None else _drawn(every, count, seed)
    return tuple(
        replace(a, id=f"{a.id}-told-{b.id}", kind=LABEL, told=replace(b.faults[0], onset_s=a.onset_s))
        for a, b in chosen
    )


def _drawn(every: Sequence[tuple[Cause, Cause]], count: int, seed: int) -> list[tuple[Cause, Cause]]:
    """``count`` of them at random, none twice, in their order."""
    chosen = np.random.default_rng([seed, 15]).choice(len(every), min(count, len(every)), replace=False)
    return [every[k] for k in sorted(chosen)]


def what_changes(plant: str) -> Mapping[str, Mapping[str, Any]]:
    """Faults of the tables of which a disturbance may be an instance -> what they change for each unit of severity."""
    return _table(plant)["changes"]  # type: ignore[no-any-return]


def balance_of(plant: str, fault: str) -> str:
    """The balance that a fault of the tables is in; empty where it is in none, or in several."""
    balances = _table(plant)["known_balances"].get(fault, ())
    return balances[0] if len(balances) == 1 else ""


def _severity(fault: FaultMode, share: float) -> float:
    return float(fault.severity_range.low + share * fault.severity_range.span)


def chosen(causes: Sequence[Cause], ids: Sequence[str]) -> tuple[Cause, ...]:
    """Those with one of the ``ids``, or of one of these classes; all where none is named."""
    return tuple(c for c in causes if not ids or c.id in ids or c.kind in ids)


@cache
def _table(plant: str) -> dict[str, Any]:
    return tomllib.loads((FOLDER / f"causes_{plant}.toml").read_text(encoding="utf-8"))
