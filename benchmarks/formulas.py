"""How fast a formula is judged: at one point, for the members of an ensemble, and on signals over time.

    python -m benchmarks.formulas [--repeat 7]

Prints a table side by side: the time of one call, and of one of the values that it judges. A trip limit is judged at a
point every second; the guard of a later step for every member of an ensemble and every second of its rollout.
"""

from __future__ import annotations

import argparse
import math
import timeit
from collections.abc import Callable, Iterator

import numpy as np

from homeostat.stl.formula import Formula, parse

LIMIT = parse("L1 >= 2 or F1 <= 0.0005")
SETTLED = parse("eventually[0,600] always[0,120] (abs(T1 - T1.sp) <= 2 or F1 <= 0.0005)")
MEMBERS, ENSEMBLE, SAMPLES = 12, 100, 900

Row = tuple[str, Callable[[], object], int]
"""What is done, how, and how many values one call judges."""


def rows() -> Iterator[Row]:
    """What is measured."""
    rng = np.random.default_rng(1)
    mean = {"L1": 8.0, "F1": 0.03, "T1": 310.0, "T1.sp": 309.0}
    columns = {tag: rng.normal(value, 0.05 * value, MEMBERS) for tag, value in mean.items()}
    signals = {tag: rng.normal(value, 0.01 * value, (ENSEMBLE, SAMPLES)) for tag, value in mean.items()}
    gaps = {tag: np.where(rng.random(s.shape) < 0.01, math.nan, s) for tag, s in signals.items()}
    yield "parse", lambda: parse(LIMIT.text), 1
    yield "compile and judge once", lambda: Formula(LIMIT.text, LIMIT.root).margin_at(mean), 1
    yield "margin_at, it holds", lambda: LIMIT.margin_at(mean), 1
    low, blind = {**mean, "L1": 1.0}, {"F1": 0.03}
    yield "margin_at, it is violated", lambda: LIMIT.margin_at(low), 1
    yield "margin_at, it is undecided", lambda: LIMIT.margin_at(blind), 1
    alone = [{tag: float(c[k]) for tag, c in columns.items()} for k in range(MEMBERS)]
    yield f"holds, {MEMBERS} members one by one", lambda: [LIMIT.holds(point) for point in alone], MEMBERS
    yield f"holds_each, {MEMBERS} members", lambda: LIMIT.holds_each(columns), MEMBERS
    size = ENSEMBLE * SAMPLES
    yield f"margins, {ENSEMBLE} x {SAMPLES}", lambda: LIMIT.margins(signals, 1.0), size
    yield f"margins with gaps, {ENSEMBLE} x {SAMPLES}", lambda: LIMIT.margins(gaps, 1.0), size
    yield f"evaluate windows, {ENSEMBLE} x {SAMPLES}", lambda: SETTLED.evaluate(signals, 1.0), size
    yield f"windows with gaps, {ENSEMBLE} x {SAMPLES}", lambda: SETTLED.evaluate(gaps, 1.0), size


def best_s(action: Callable[[], object], repeat: int) -> float:
    """Shortest duration of one call [s], over runs of about a twentieth of a second."""
    timer = timeit.Timer(action)
    once = max(timer.timeit(1), 1e-7)
    number = max(1, int(0.05 / once))
    return min(timer.repeat(repeat, number)) / number


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=7, help="runs of which the fastest counts (default: 7)")
    repeat = parser.parse_args().repeat
    print(f"| {'what':<32} | {'call [us]':>10} | {'value [us]':>10} |\n|{'-' * 34}|{'-' * 12}|{'-' * 12}|")
    for name, action, values in rows():
        call_us = 1e6 * best_s(action, repeat)
        print(f"| {name:<32} | {call_us:>10.2f} | {call_us / values:>10.4f} |")


if __name__ == "__main__":
    main()
