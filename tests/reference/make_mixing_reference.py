"""Make ``mixing_module_reference.json``: a noise-free batch of the Mixing Module by an integrator of its own.

    python -m tests.reference.make_mixing_reference

Plain Python, written from the laws in the description of ``homeostat.plants.mixing_module.hydraulics`` and ``kernel``;
nothing is imported from the package, and the parameters are written here. The pipes are solved the other way round than
in the engine: heads of the three junctions are the unknowns, every law is inverted in closed form, and Newton's method
with an exact line search minimises a convex function, so that it always arrives. A test compares the engine with the
file; a failure means that the dynamics changed. If that is intended, make the file again and say so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

FILE = Path(__file__).with_name("mixing_module_reference.json")
EVERY_S, END_S = 5, 330
COLUMNS = ("V1", "V2", "V3", "V4", "q_transfer", "delivered", "head_suction", "head_main", "head_discharge")
PARAMETERS = {
    "area": 14.31355, "height_feed": 0.22, "height_B204": 1.22, "floor_B204": 0.1, "floor_leak": 0.25, "pump_a": 2.141,
    "pump_b": 2.728, "pump_c": 28.82, "bypass_size": 0.85, "tau_pump": 1.0, "travel": 1.5, "k_tank": 23.2,
    "k_suction": 11.6, "k_main": 23.2, "k_bypass": 46.4, "k_transfer": 34.8, "k_clog": 10.0, "leak_size": 0.06,
    "fill_rate": 0.14, "drain_cd": 0.62, "drain_area": 9.503e-5, "dry_level": 0.005,
}  # fmt: skip
COMMANDS: list[tuple[float, dict[str, float]]] = [
    (0, {"VI1": 1}), (19, {"VI2": 1}), (38, {"VI3": 1}),
    (57, {"VO1": 1, "VI4": 1, "P1": 0.9}), (80, {"VO2": 1, "VI4": 1, "P1": 0.9}),
    (103, {"VO3": 1, "VI4": 1, "P2": 0.9}), (135, {"VI4": 1}), (140, {"VO4": 1}), (260, {}),
]  # fmt: skip
"""A batch by the clock: B201 and B202 through the main line, B203 through the bypass; then B204 drains."""
LAMINAR, SHUT, CLOSED, TIGHT = 0.02, 1e7, 1e-6, 1e-12
PARTS = 4
Law = Callable[[float], tuple[float, float]]


def pipe(resistance: float) -> Law:
    """(Flow, its slope) at a head difference: dh = K q|q| + R q."""

    def flow(dh: float) -> tuple[float, float]:
        root = math.sqrt(LAMINAR**2 + 4.0 * resistance * abs(dh))
        return 2.0 * dh / (LAMINAR + root), 1.0 / root

    return flow


def one_way(resistance: float) -> Law:
    """The same behind a non-return valve."""
    open_flow = pipe(resistance)
    return lambda dh: open_flow(dh) if dh >= 0.0 else (dh / SHUT, 1.0 / SHUT)


def pump(a: float, b: float, resistance: float, n: float) -> Law:
    """A pump with its pipe behind a non-return valve; the curve is flat left of its top."""
    top = b * n / (2.0 * resistance)
    most = a * n * n + b * n * top / 2.0

    def flow(dh: float) -> tuple[float, float]:
        above = dh + most
        if above < 0.0:
            return above / SHUT, 1.0 / SHUT
        if above / LAMINAR <= top:
            return above / LAMINAR, 1.0 / LAMINAR
        linear = b * n - LAMINAR
        root = math.sqrt(linear**2 + 4.0 * resistance * (a * n * n + dh))
        return (linear + root) / (2.0 * resistance), 1.0 / root

    return flow


def flows_of(laws: list[Law], tanks: list[float], leak: float, h: list[float]) -> list[tuple[float, float]]:
    """(Flow, slope) of every branch for heads ``h`` of S, M, D; ``tanks``: heads of B201 to B204."""
    s, m, d = h
    ends = [(tanks[0], s), (tanks[1], s), (tanks[2], s), (s, m), (m, d), (s, d), (d, tanks[3]), (m, leak), (d, leak)]
    return [law(up - down) for law, (up, down) in zip(laws, ends, strict=True)]


def surplus(q: list[tuple[float, float]]) -> list[float]:
    """What flows into S, M and D and not out [L/s]."""
    f = [flow for flow, _ in q]
    return [f[0] + f[1] + f[2] - f[3] - f[5], f[3] - f[4] - f[7], f[4] + f[5] - f[6] - f[8]]


def newton(q: list[tuple[float, float]]) -> list[float]:
    """Newton's change of the heads: Cramer's rule on the (symmetric, diagonally dominant) slopes."""
    g = [slope for _, slope in q]
    ss, mm, dd = g[0] + g[1] + g[2] + g[3] + g[5], g[3] + g[4] + g[7], g[4] + g[5] + g[6] + g[8]
    sm, sd, md = -g[3], -g[5], -g[4]
    r = surplus(q)
    det = ss * (mm * dd - md * md) - sm * (sm * dd - md * sd) + sd * (sm * md - mm * sd)
    inverse = [
        [mm * dd - md * md, sd * md - sm * dd, sm * md - sd * mm],
        [sd * md - sm * dd, ss * dd - sd * sd, sd * sm - ss * md],
        [sm * md - sd * mm, sd * sm - ss * md, ss * mm - sm * sm],
    ]
    return [sum(inverse[i][j] * r[j] for j in range(3)) / det for i in range(3)]


def network(laws: list[Law], tanks: list[float], leak: float) -> tuple[list[float], list[float]]:
    """Flows of the nine branches [L/s] (in the engine's order) and heads of the three junctions [m]."""
    h = [max(tanks)] * 3
    q = flows_of(laws, tanks, leak, h)
    for _ in range(200):
        way = newton(q)
        low, share, high = 0.0, 1.0, 1.0
        while True:
            tried = [a + share * b for a, b in zip(h, way, strict=True)]
            q = flows_of(laws, tanks, leak, tried)
            downhill = sum(a * b for a, b in zip(surplus(q), way, strict=True)) >= 0.0
            if (downhill and share == 1.0) or (high - low < 1e-3 * low) or high < 1e-15:
                break
            low, high = (share, high) if downhill else (low, share)
            share = (low + high) / 2.0
        h = tried
        if max(map(abs, surplus(q))) < 1e-16 or max(map(abs, way)) < 1e-14:
            break
    return [flow for flow, _ in q], h


def laws_of(
    p: dict[str, float], outlets: list[float], into: float, n: list[float], *,
    main: float | None = None, leaks: tuple[float, float] = (TIGHT, TIGHT),
) -> list[Law]:  # fmt: skip
    """Laws of the branches; ``n``: speeds with P102's size; ``leaks``: flow per root of head."""
    a, b, c = p["pump_a"], p["pump_b"], p["pump_c"]
    return [
        *(pipe(p["k_tank"] / max(o, CLOSED) ** 2) for o in outlets),
        pump(a, b, c + p["k_suction"], n[0]), one_way(p["k_main"] if main is None else main),
        pump(a, b, c + p["k_bypass"], n[1]), pipe(p["k_transfer"] / max(into, CLOSED) ** 2),
        one_way(leaks[0] ** -2), one_way(leaks[1] ** -2),
    ]  # fmt: skip


def trajectory() -> dict[int, list[float | None]]:
    """Time -> COLUMNS; heads only where something can flow."""
    p = PARAMETERS
    area = p["area"]
    v = [area * 0.1 * p["height_feed"]] * 3 + [area * 0.1 * p["height_B204"]]
    names = ("VI1", "VI2", "VI3", "VO1", "VO2", "VO3", "VI4", "VO4")
    pos, n, delivered = dict.fromkeys(names, 0.0), [0.0, 0.0], 0.0
    dt, rows = 1.0 / PARTS, {}
    for part in range(END_S * PARTS):
        command = next(c for since, c in reversed(COMMANDS) if part * dt >= since)
        for name in names:
            step = dt / p["travel"]
            pos[name] += min(max(command.get(name, 0.0) - pos[name], -step), step)
        lag = 1.0 - math.exp(-dt / p["tau_pump"])
        n = [old + lag * (command.get(f"P{j + 1}", 0.0) - old) for j, old in enumerate(n)]
        outlets = [pos[f"VO{i + 1}"] * min(1.0, v[i] / area / p["dry_level"]) for i in range(3)]
        q, heads = [0.0] * 9, [None] * 3
        if max(outlets) > 1e-6 or max(n) > 1e-3:
            tanks = [v[0] / area, v[1] / area, v[2] / area, p["floor_B204"] + v[3] / area]
            laws = laws_of(p, outlets, pos["VI4"], [n[0], n[1] * p["bypass_size"]])
            q, heads = network(laws, tanks, p["floor_leak"])
        fills = [p["fill_rate"] * pos[f"VI{i + 1}"] for i in range(3)]
        outs = [min(q[i], v[i] / dt + fills[i]) for i in range(3)]
        back = -sum(min(out, 0.0) for out in outs)
        if back > 0.0:  # tanks fill each other; nothing comes back through the non-return valves
            share = min(1.0, sum(max(out, 0.0) for out in outs) / back)
            outs = [out * share if out < 0.0 else out for out in outs]
        given = max(sum(outs), 0.0)
        v[:3] = [max(v[i] + (fills[i] - outs[i]) * dt, 0.0) for i in range(3)]
        transfer = max(given - max(q[7], 0.0) - max(q[8], 0.0), -v[3] / dt)
        drain = 1000.0 * p["drain_cd"] * p["drain_area"] * pos["VO4"] * math.sqrt(2.0 * 9.80665 * v[3] / area)
        drain = min(drain, v[3] / dt + transfer)
        v[3] += (transfer - drain) * dt
        delivered += drain * dt
        at = (part + 1) / PARTS
        if at % EVERY_S == 0:
            rows[int(at)] = [*v, transfer, delivered, *heads]
    return rows


if __name__ == "__main__":
    lines = ",\n".join(f'    "{t}": {json.dumps(row)}' for t, row in trajectory().items())
    FILE.write_text(
        f'{{\n  "columns": {json.dumps(COLUMNS)},\n  "parameters": {json.dumps(PARAMETERS)},\n'
        f'  "rows": {{\n{lines}\n  }}\n}}\n',
        encoding="utf-8",
    )
