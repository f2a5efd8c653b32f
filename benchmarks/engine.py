"""How fast and how accurate the batch engine is on the reactor.

    python -m benchmarks.engine [--members 1000] [--seconds 6000] [--repeat 3]

Prints a table: throughput of a crowd with and without noise, one rollout, the time until a fresh process has its
first rollout (nothing compiled yet, and with compiled code on disk), and the largest deviations from the pinned
reference trajectories. Where scipy is installed, one rollout is also timed with its adaptive solver.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.plants.by_hand.kernel import holdup, slopes
from benchmarks.plants.by_hand.layout import P as BY_HAND
from homeostat.process.batch import simulate
from homeostat.process.compiled import machine_code
from tests.plants.cstr.reactor import MODEL, S, batch, inputs, parameters, run
from tests.reference import make_cstr_reference as own
from tests.reference import test_cstr_published as published

ROOT = Path(__file__).parents[1]
READY = (
    "import time; begun = time.perf_counter(); from tests.plants.cstr.reactor import batch, run; run(batch({seconds}));"
    " print(time.perf_counter() - begun)"
)


def best_s(action: Callable[[], object], repeat: int) -> float:
    """Shortest duration of ``action`` [s] after one run that is not counted."""
    action()
    times = []
    for _ in range(repeat):
        begun = time.perf_counter()
        action()
        times.append(time.perf_counter() - begun)
    return min(times)


def speed(members: int, seconds: int, repeat: int) -> Iterator[tuple[str, str]]:
    """Throughput of a crowd, and one rollout."""
    for noise in (0.0, 1.0):
        crowd = replace(
            batch(seconds, members=members, stride=60, process=noise, sensor=noise), record=(S.V, S.T, S.V2_position)
        )
        took = best_s(partial(simulate, MODEL.kernel, crowd), repeat)
        name = f"{members} members x {seconds} s, {'with' if noise else 'without'} noise"
        yield name, f"{members * seconds / took / 1e6:.2f} million member-seconds per second ({took:.2f} s)"
    one = batch(seconds, process=1.0, sensor=1.0)
    yield f"one rollout of {seconds} s, every second recorded", f"{1e3 * best_s(partial(run, one), repeat):.2f} ms"


def ready(seconds: int) -> Iterator[tuple[str, str]]:
    """Seconds from the first import to the end of the first rollout, in processes of their own."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}"}
        command = [sys.executable, "-c", READY.format(seconds=seconds)]
        for name in ("nothing compiled yet", "compiled code on disk"):
            done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=True)
            yield f"fresh process to the end of its first rollout, {name}", f"{float(done.stdout):.2f} s"


def against_own() -> Iterator[tuple[str, str]]:
    """Largest deviation from the pinned trajectories of the project's own integrator."""
    pinned = json.loads(own.FILE.read_text(encoding="utf-8"))["cases"]
    worst = dict.fromkeys(own.COLUMNS, 0.0)
    rows = np.array(own.PINS) - 1
    for scenario in own.scenarios():
        u = np.tile(inputs(), (max(own.PINS), 1))
        for name, changes in scenario.operation.setpoints.items():
            for since, value in changes:
                u[int(since) :, MODEL.inputs.index(name)] = value
        faults = {name: (severity, own.ONSET_S) for name, severity in scenario.faults.items()}
        engine = run(batch(max(own.PINS), p=parameters(**scenario.changes), faults=faults, u=u))
        for column, name in enumerate(own.COLUMNS):
            expected = np.array([row[column] for row in pinned[scenario.name].values()])
            worst[name] = max(worst[name], float(np.abs(engine.of(name)[rows] - expected).max()))
    yield from deviations("own reference", worst)


def against_published() -> Iterator[tuple[str, str]]:
    """Largest deviation from the published model's noise-free trajectories, the documented exception apart."""
    if not published.FILE.exists():
        yield "published reference", "not here"
        return
    worst = dict.fromkeys(published.COLUMNS, 0.0)
    for plant in ("normal", *published.FAULTS):
        off, times = published.differences(plant)
        for column, name in enumerate(published.COLUMNS):
            keep = np.array([(plant, name, int(t)) != published.EXCEPTION for t in times])
            worst[name] = max(worst[name], float(off[keep, column].max()))
    yield from deviations("published reference (seven decimals)", worst)


def deviations(name: str, worst: dict[str, float]) -> Iterator[tuple[str, str]]:
    """Rows of the table."""
    rest = max(v for n, v in worst.items() if n not in ("V", "T"))
    yield f"{name}: largest deviation of V", f"{worst['V']:.1e} L"
    yield f"{name}: largest deviation of T", f"{worst['T']:.1e} K"
    yield f"{name}: largest deviation of the rest", f"{rest:.1e}"


def adaptive(seconds: int) -> Iterator[tuple[str, str]]:
    """The same balances, compiled, in scipy's RK45 called once per second as a simulator without this engine would."""
    name = f"one rollout of {seconds} s, scipy RK45 per second"
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        yield name, "scipy is not installed"
        return
    p, record = parameters(), run(batch(seconds)).record[0]

    def derivative(_: float, y: np.ndarray, row: np.ndarray) -> list[float]:
        out = row[S.F2_true] + row[S.leak] + row[S.overflow]
        cooling = row[S.UA] * row[S.V2_position]
        held = p[BY_HAND.CA_feed], p[BY_HAND.CD_feed], row[S.T2_true], cooling, row[S.T3_true]
        v, ca, cb, cc, cd, temp = y.tolist()
        hold = holdup(v, row[S.F1_true], out, p)
        return [row[S.F1_true] - out, *machine_code(slopes)(hold, ca, cb, cc, cd, temp, held, p)]

    def whole() -> None:
        y = MODEL.initial_state(p)[: S.T + 1]
        for row in record:
            y = solve_ivp(derivative, (0.0, 1.0), y, "RK45", rtol=1e-7, atol=1e-9, max_step=0.05, args=(row,)).y[:, -1]

    begun = time.perf_counter()
    whole()
    yield name, f"{time.perf_counter() - begun:.1f} s"


def main() -> None:
    """Measure and print."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--members", type=int, default=1000, help="size of the crowd")
    arguments.add_argument("--seconds", type=int, default=6000, help="length of every run")
    arguments.add_argument("--repeat", type=int, default=3, help="runs per measurement; the fastest counts")
    chosen = arguments.parse_args()
    print(f"{os.cpu_count()} processors, numpy {np.__version__}")
    for part in (
        speed(chosen.members, chosen.seconds, chosen.repeat),
        ready(chosen.seconds),
        against_own(),
        against_published(),
        adaptive(chosen.seconds),
    ):
        for name, value in part:
            print(f"{name:<68} {value}", flush=True)


if __name__ == "__main__":
    main()
