"""A plant of a site's own: the reactor's tables, with a process model in its folder that a mistake can be put into."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from homeostat.knowledge.build.build import build
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.knowledge.build.whole import write_whole
from homeostat.plants.files.folder import BASELINES, INSTALLED, SETTINGS
from homeostat.plants.plant import load_plant
from homeostat.plants.teaching.learning import learned

NAME = "site"
MODEL = '''"""The reactor of a site: the equations of the one that ships, under a name of its own."""

import math
from collections import namedtuple

import numpy as np

from homeostat.plants.cstr.process import REACTOR
from homeostat.plants.plant import load_plant
from homeostat.process.blocks.composed import ComposedModel

PLANT = load_plant("cstr", learned=False)
S, P, U, F = (
    namedtuple(kind, names)(*range(len(names)))
    for kind, names in zip("SPUF", (PLANT.model.states, PLANT.model.parameters, PLANT.model.inputs, PLANT.model.faults))
)


class CstrModel(ComposedModel):
    """The reactor that ships; a kernel of the class counts."""

    kernel = PLANT.model.kernel

    def __init__(self):
        super().__init__(REACTOR, {p.symbol: p.value for p in PLANT.description.parameters}, PLANT.model.faults)
        del self.kernel


class EachSecond:
    """The kernel, second by second, with something of the site's own after each."""

    def __init__(self, kernel, act):
        self.kernel, self.act = kernel, act

    def __call__(self, first, last, x, p, sev, onset, u, u_of, t0, begin, steps, stride, seeds, process, sensor, picks,
                 out, broken_at, moves=None):
        every = np.arange(x.shape[1])
        for m in range(first, last):
            for k in range(int(begin[m]), steps):
                row, one = np.empty((1, 1, x.shape[1])), slice(m, m + 1)
                broken = np.full(1, np.nan)
                now = u[u_of[m], k][None, None].copy()
                state = x[one].copy()
                where = np.zeros(1, dtype=np.int64)
                self.kernel(0, 1, state, p[one].copy(), sev[one].copy(), onset[one].copy(), now, where, t0 + k,
                            where, 1, 1, seeds[one].copy(), process[one].copy(), sensor[one].copy(), every, row, broken)
                x[one] = state
                if not math.isnan(broken[0]):
                    broken_at[m] = broken[0]
                    break
                self.act(x[m], p[m], sev[m], onset[m], t0 + k + 1.0)
                if k % stride == stride - 1:
                    out[m, k // stride] = x[m, picks]


class SiteModel(CstrModel):
    """The reactor of the site."""
'''
"""The module in the plant's folder; what a mistake adds is appended to its class."""


@dataclass(frozen=True)
class Edit:
    """One change of one file: the first ``old`` becomes ``new``; where ``old`` is empty, ``new`` is appended."""

    file: str
    old: str
    new: str


def make(where: Path) -> Path:
    """The plant's folder below ``where``, complete with graph and reference values."""
    folder = where / NAME
    ignored = shutil.ignore_patterns("__pycache__", "true", "*.py", BASELINES, FOLDER)
    shutil.copytree(INSTALLED / "cstr", folder, ignore=ignored)
    write_whole(INSTALLED / "cstr", folder)
    own = "homeostat.plants.cstr.process:REACTOR", "process:SiteModel"
    change(folder, [Edit(SETTINGS, *own), Edit(SETTINGS, "end_s = 6000.0", "end_s = 4000.0")])
    (folder / "process.py").write_text(MODEL, encoding="utf-8")
    (folder / "plant.ttl").write_bytes(build(folder))
    (folder / BASELINES).write_bytes(learned(load_plant(str(folder), learned=False)))
    return folder


def change(folder: Path, edits: Iterable[Edit]) -> None:
    """Carry ``edits`` out in ``folder``; AssertionError where a text that is to be changed is not there."""
    for edit in edits:
        path = folder / edit.file
        text = path.read_text(encoding="utf-8")
        assert edit.old in text, f"{edit.file} has no {edit.old!r}"
        changed = text.replace(edit.old, edit.new, 1) if edit.old else text + edit.new
        path.write_text(changed, encoding="utf-8")
