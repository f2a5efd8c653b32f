"""The shipped plants and the blocks: lines, and how far they are from integrators that share no code with them."""

from __future__ import annotations

import json

import numpy as np

from benchmarks.plants.lines import table
from tests.plants.cstr import reactor
from tests.plants.mixing_module import module
from tests.reference import make_cstr_reference as cstr
from tests.reference import make_mixing_reference as mixing

TITLE = "The shipped plants on blocks"
TEXT = """Lines of tables, settings and code, comments included, before there were blocks and now (`python -m
benchmarks.plants.lines`); asked for: half. The reactor is a flowsheet; the Mixing Module keeps its own
kernel, with the solver of the blocks behind its own, because a tick of its own kind would be there for no
other plant (decision 0044). So its tables are at half, and its code is not.

{lines}
Pinned trajectories, of integrators that share no code with the plants; the largest difference of any column at any
pinned time, in the column's unit; asked for: 1e-6.

| plant | trajectories | furthest apart |
|---|---|---|
| reactor | {cstr_runs} | {cstr_apart:.1e} in `{cstr_column}` |
| Mixing Module | 1 | {mixing_apart:.1e} in `{mixing_column}` |

When the reactor was moved, the readings of a run with each of its faults were the same as before (decision 0044), so
no figure of a page could differ by it, by no standard error at all; what differs since then, differs because of what
recovery does now."""


def told() -> str:
    """The section's text, measured now."""
    cstr_apart, cstr_column, runs = reactor_apart()
    mixing_apart, mixing_column = module_apart()
    return TEXT.format(
        lines=table(), cstr_runs=runs, cstr_apart=cstr_apart, cstr_column=cstr_column, mixing_apart=mixing_apart,
        mixing_column=mixing_column,
    )  # fmt: skip


def reactor_apart() -> tuple[float, str, int]:
    """Largest difference of the reactor from its pinned trajectories, its column, and how many there are."""
    pinned = json.loads(cstr.FILE.read_text(encoding="utf-8"))["cases"]
    rows = np.array(cstr.PINS) - 1
    worst = 0.0, ""
    for scenario in cstr.scenarios():
        u = np.tile(reactor.inputs(), (max(cstr.PINS), 1))
        for name, changes in scenario.operation.setpoints.items():
            for since, value in changes:
                u[int(since) :, reactor.MODEL.inputs.index(name)] = value
        faults = {name: (severity, cstr.ONSET_S) for name, severity in scenario.faults.items()}
        parameters = reactor.parameters(**scenario.changes)
        engine = reactor.run(reactor.batch(max(cstr.PINS), p=parameters, faults=faults, u=u))
        for column, name in enumerate(cstr.COLUMNS):
            stands = np.array([row[column] for row in pinned[scenario.name].values()])
            worst = max(worst, (float(np.abs(engine.of(name)[rows] - stands).max()), name))
    return *worst, len(pinned)


def module_apart() -> tuple[float, str]:
    """Largest difference of the Mixing Module from its pinned batch, and its column."""
    reference = json.loads(mixing.FILE.read_text(encoding="utf-8"))
    pinned = np.array(list(reference["rows"].values()), dtype=float)
    u = module.timed(mixing.END_S, *((int(since), command) for since, command in mixing.COMMANDS))
    engine = module.run(module.batch(mixing.END_S, p=module.parameters(**mixing.PARAMETERS), u=u))
    apart = {name: np.nanmax(np.abs(engine.of(name)[mixing.EVERY_S - 1 :: mixing.EVERY_S] - pinned[:, column]))
             for column, name in enumerate(mixing.COLUMNS)}  # fmt: skip
    furthest = max(apart, key=apart.__getitem__)
    return float(apart[furthest]), furthest
