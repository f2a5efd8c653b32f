"""The Tennessee Eastman plant for tests: its equations at states of the published code, without a kernel."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.tennessee_eastman.process import TENNESSEE_EASTMAN
from homeostat.plants.tennessee_eastman.substances import LB, NAMES
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Leaf, Term, evaluate
from homeostat.process.types import Table, Vec

SHEET = TENNESSEE_EASTMAN
SHOWN = [
    "F1", "F2", "F3", "F4", "F8", "F6", "PR", "LR", "TR", "F9", "TS", "LS", "PS", "F10", "LC", "PC", "F11", "TC",
    "FS", "JK", "TWR", "TWS", "X6A", "X6B", "X6C", "X6D", "X6E", "X6F", "X9A", "X9B", "X9C", "X9D", "X9E", "X9F",
    "X9G", "X9H", "X11D", "X11E", "X11F", "X11G", "X11H",
]  # fmt: skip
"""Variables in the order of the published measurements, 1 to 41."""
THOUSANDS = frozenset({"F1", "F4", "F8", "F6", "F9"})
"""Flows that are published in thousands of cubic metres per hour."""
DESIGN = (63.05, 53.98, 24.64, 61.30, 22.21, 40.06, 38.10, 46.53, 47.45, 41.11, 18.11, 50.0)
"""Openings of the base case [%]."""


@functools.cache
def eastman() -> Plant:
    """The plant without reference values."""
    return load_plant("tennessee_eastman", learned=False)


@functools.cache
def model() -> ComposedModel:
    """Its model."""
    found = eastman().model
    assert isinstance(found, ComposedModel)
    return found


@functools.cache
def stated() -> Vec:
    """Its parameters as the tables state them, shape (parameters,)."""
    values = {p.symbol: p.value for p in eastman().description.parameters}
    return np.array([values[name] for name in model().parameters])


def published(states: Table, temperatures: Mapping[str, Vec]) -> dict[str, Vec]:
    """States of the published code, shape (n, 50), with ``temperatures`` in place of energies, as ours by name."""
    found = {f"{v}_{s}": states[:, 9 * i + j] * LB for i, v in enumerate("RSCH") for j, s in enumerate(NAMES)}
    found |= {f"{vessel}_T": t for vessel, t in temperatures.items()}
    return found | {"R_water": states[:, 36], "S_water": states[:, 37], "product": 0.0 * states[:, 0]}


def leaves_at(states: Mapping[str, Any], openings: Table, faults: Mapping[str, Any]) -> dict[Term, Any]:
    """What every leaf is with ``states``, ``openings`` of shape (n, 12) [%] and severities of ``faults``."""
    layout, stated = model().layout, {p.symbol: p.value for p in eastman().description.parameters}
    values: dict[Term, Any] = {**layout.healthy}
    values |= {Term(Leaf.FAULT, value=name): severity for name, severity in faults.items()}
    values |= {of: stated[name] for name, of in layout.leaf[Leaf.PARAMETER].items()}
    values |= {of: np.nan for of in (*layout.leaf[Leaf.HELD].values(), *layout.leaf[Leaf.INPUT].values())}
    values |= {Term(Leaf.HELD, value=str(d.now.value)): stated[name] for name, d in SHEET.disturbances.items()}
    values |= {Term(Leaf.HELD, value=f"V{k + 1}_position"): openings[:, k] / 100.0 for k in range(12)}
    shares = {each.oldest: each.of for each in SHEET.lags.values() if hasattr(each, "oldest")}
    values |= {Term(Leaf.STATE, value=name): value for name, value in states.items()}
    return values | {Term(Leaf.HELD, value=name): evaluate(of, values) for name, of in shares.items()}


def rates(values: Mapping[Term, Any]) -> dict[str, Any]:
    """State -> its change per hour."""
    return {name: 3600.0 * evaluate(rate, values) for name, rate in model().layout.rates.items()}


def measured(values: Mapping[Term, Any]) -> dict[str, Any]:
    """Variable -> what its instrument shows, in the published unit."""
    return {v: evaluate(SHEET.sensors[v].of, values) / (1000.0 if v in THOUSANDS else 1.0) for v in SHOWN}
