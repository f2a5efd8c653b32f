"""Make ``cstr_reference.json``: noise-free trajectories of the reactor by an integrator of its own.

    python -m tests.reference.make_cstr_reference

Plain Python, written from the equations in ``homeostat.plants.cstr.kernel``'s description and from the control law
as the tables' engineer would state it: no compiled code, nothing imported from the package but the folder of its
tables. Runge-Kutta 4 with 50 steps per second, far finer than the engine's. A test compares the engine with the
file; a failure means that the reactor's dynamics changed. If that is intended, make the file again and say so.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

FILE = Path(__file__).with_name("cstr_reference.json")
TABLES = Path(__file__).parents[2] / "src" / "homeostat" / "plants" / "cstr" / "engineering"
COLUMNS = ("V", "CA", "CB", "CC", "CD", "T", "F1_true", "F2_true", "F3_true", "leak", "overflow", "UA")
PINS = (3, 20, 60, 299, 303, 320, 600, 1500, 1502, 1520, 1560, 1640, 1900, 2500, 3500)
ONSET_S = 1500.0
SUBSTEPS = 50
GAS_CONSTANT = 8.314


def table(name: str) -> list[dict[str, str]]:
    """Rows of one engineering table."""
    with (TABLES / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@dataclass(frozen=True)
class Operation:
    """What the operator does: name of the input -> (from this time on [s], value), in order."""

    setpoints: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def at(self, name: str, t: float, otherwise: float) -> float:
        """Value of an input at ``t``."""
        for since, value in reversed(self.setpoints.get(name, [])):
            if t >= since:
                return value
        return otherwise


@dataclass(frozen=True)
class Scenario:
    """One trajectory."""

    name: str
    faults: dict[str, float] = field(default_factory=dict)
    changes: dict[str, float] = field(default_factory=dict)
    operation: Operation = field(default_factory=Operation)


def scenarios() -> list[Scenario]:
    """Healthy, every fault at its nominal severity, a shut-down, and an operator who uses everything."""
    faults = [Scenario(r["id"], {r["id"]: float(r["nominal"])}) for r in table("faults")]
    operated = Operation({
        "T1_sp": [(800.0, 307.5)],
        "L1_sp": [(900.0, 10.4), (2400.0, 8.0)],
        "F1_sp": [(1000.0, 0.025)],
        "V2_man": [(1505.0, 0.65), (1630.0, math.nan)],
        "P1_man": [(1700.0, 0.2), (1800.0, math.nan)],
        "V1_man": [(1850.0, 0.7), (1950.0, math.nan)],
        "XV1_cmd": [(2450.0, 0.0), (2600.0, 1.0)],
    })  # fmt: skip
    return [
        Scenario("normal"),
        *faults,
        Scenario("pump_degrade+leak", {"pump_degrade": 0.3, "leak": 0.002}),
        Scenario("shutdown", changes={"t_shutdown": 1500.0}),
        Scenario("operated", operation=operated),
    ]


def clip(value: float, low: float = 0.0, high: float = 1.0) -> float:
    """``value`` limited to [low, high]."""
    return low if value < low else high if value > high else value


class Controller:
    """PI with conditional integration: the integral waits while it would drive a saturated output further out."""

    def __init__(self, gain: float, reset: float, low: float) -> None:
        self.gain, self.reset, self.low, self.integral = gain, reset, low, 0.0

    def output(self, error: float) -> float:
        """Output for this second."""
        raw = self.gain * error + self.integral
        outwards = (raw > 1.0 and error > 0.0) or (raw < self.low and error < 0.0)
        if not outwards:
            self.integral += self.reset * error
        return clip(raw, self.low, 1.0)

    def follow(self, error: float, output: float) -> None:
        """On manual: the integral is what the proportional part leaves of the output."""
        self.integral = output - self.gain * error


class Reactor:
    """The reactor and its basic control system."""

    def __init__(self, p: dict[str, float], scenario: Scenario) -> None:
        self.p = p | scenario.changes
        self.faults, self.operation = scenario.faults, scenario.operation
        p = self.p
        self.x = [0.0, 0.0, 0.0, 0.0, 0.0, p["T_feed"]]
        self.feed = Controller(p["Kp_flow"], p["Ki_flow"], 0.0)
        self.level = Controller(p["Kp_level"], p["Ki_level"], p["trim_low"])
        self.temperature = Controller(p["Kp_temperature"], p["Ki_temperature"], 0.0)
        self.position = {"V1": 0.0, "P1": 0.0, "V2": 0.0, "XV1": 1.0}
        self.command = {"V1": 0.0, "P1": 0.0, "V2": 0.0}
        self.flow = {"F1": 0.0, "F2": 0.0, "F3": 0.0, "leak": 0.0, "overflow": 0.0}
        self.ua = p["UA"]
        self.seen_t, self.seen_l = p["T_feed"], 0.0
        self.phase = "STARTUP"

    def severity(self, fault: str, t: float) -> float:
        """Severity of a fault at ``t``; 0 before its onset."""
        return self.faults.get(fault, 0.0) if t >= ONSET_S else 0.0

    def control(self, t: float) -> None:
        """Phase and controller outputs, from what the instruments showed at the end of the last second."""
        p, op = self.p, self.operation
        level_sp = op.at("L1_sp", t, 10.0)
        if self.phase == "STARTUP" and (self.seen_l >= level_sp or t >= p["t_startup"]):
            self.phase = "NORMAL"
        if t >= p["t_shutdown"]:
            self.phase = "SHUTDOWN"
        manual = {a: op.at(f"{a}_man", t, math.nan) for a in ("V1", "P1", "V2")}
        automatic = {a: math.isnan(m) for a, m in manual.items()}
        self.command.update({a: clip(m) for a, m in manual.items() if not automatic[a]})
        draining = self.phase == "SHUTDOWN"
        error = op.at("F1_sp", t, 2.0 / 60.0) - self.flow["F1"]
        if automatic["V1"]:
            self.command["V1"] = 0.0 if draining else self.feed.output(error)
        else:
            self.feed.follow(error, self.command["V1"])
        error = self.seen_l - (p["L_heel"] if draining else level_sp)
        forward = clip(self.flow["F1"] / p["feedforward_P1"])
        if not automatic["P1"]:
            self.level.follow(error, self.command["P1"] - forward)
        elif self.phase == "STARTUP" or (draining and self.x[0] <= 0.01):
            self.command["P1"] = 0.0
        else:
            self.command["P1"] = max(clip(forward + self.level.output(error)), 0.05 if draining else 0.0)
        error = self.seen_t - op.at("T1_sp", t, 310.0)
        if automatic["V2"]:
            empty = draining and self.x[0] <= 0.1
            self.command["V2"] = 0.0 if empty else self.temperature.output(error)
        else:
            self.temperature.follow(error, self.command["V2"])

    def actuate(self, t: float) -> None:
        """Positions after one second; a stuck valve goes where it sticks, whatever the command."""
        target = dict(self.command, XV1=self.operation.at("XV1_cmd", t, 1.0))
        if self.severity("inlet_stuck_open", t) > 0.0:
            target["V1"] = self.severity("inlet_stuck_open", t)
        if self.severity("cool_stuck_closed", t) > 0.0:
            target["V2"] = 1.0 - self.severity("cool_stuck_closed", t)
        if self.severity("cool_stuck_open", t) > 0.0:
            target["V2"] = self.severity("cool_stuck_open", t)
        for name, goal in target.items():
            share = 1.0 - math.exp(-1.0 / self.p[f"tau_{name}"])
            self.position[name] = clip(self.position[name] + share * (goal - self.position[name]))

    def set_flows(self, t: float) -> None:
        """Flows of this second [L/s] and the heat transfer coefficient [W/K]."""
        p, v = self.p, self.x[0]
        self.flow["F1"] = p["Cv_V1"] * self.position["V1"] * self.position["XV1"]
        self.flow["F3"] = p["F3_max"] * self.position["V2"]
        self.flow["leak"] = self.severity("leak", t) * v
        self.flow["overflow"] = p["k_brim"] * max(v - p["V_brim"], 0.0)
        capacity = p["K_P1"] * (1.0 - self.severity("pump_degrade", t)) * (1.0 - self.severity("outlet_block", t))
        there = v + self.flow["F1"] - self.flow["leak"] - self.flow["overflow"]
        self.flow["F2"] = min(capacity * self.position["P1"], max(there, 0.0))
        lost = self.severity("fouling", t) * (1.0 - math.exp(-max(t - ONSET_S, 0.0) / p["tau_fouling"]))
        self.ua = p["UA"] * (1.0 - min(lost, 0.95))

    def derivative(self, x: list[float]) -> list[float]:
        """Balances of the docstring: d/dt of V, CA, CB, CC, CD, T."""
        p, (v, ca, cb, cc, cd, temp) = self.p, x
        f1, out = self.flow["F1"], self.flow["F2"] + self.flow["leak"] + self.flow["overflow"]
        rate_ad = p["k0_AD"] * math.exp(-p["E_AD"] / (GAS_CONSTANT * temp)) * ca * cd
        rate_a = p["k0_A"] * math.exp(-p["E_A"] / (GAS_CONSTANT * temp)) * ca
        wet, covered = max(v, 0.1), max(v, 1.0)
        jacket = self.ua * self.position["V2"] * (temp - p["T_coolant"])
        return [
            f1 - out,
            f1 / wet * (p["CA_feed"] - ca) - rate_ad - rate_a,
            f1 / wet * (0.0 - cb) + rate_ad,
            f1 / wet * (0.0 - cc) + rate_a,
            f1 / wet * (p["CD_feed"] - cd) - rate_ad,
            f1 / wet * (p["T_feed"] - temp)
            + (-p["dH_AD"] * rate_ad - p["dH_A"] * rate_a) / p["cp"]
            - jacket / (wet * p["cp"])
            - p["UA_ambient"] * (temp - p["T_ambient"]) / (covered * p["cp"]),
        ]

    def integrate(self) -> None:
        """One second of the balances."""
        h = 1.0 / SUBSTEPS
        for _ in range(SUBSTEPS):
            k1 = self.derivative(self.x)
            k2 = self.derivative([a + 0.5 * h * b for a, b in zip(self.x, k1, strict=True)])
            k3 = self.derivative([a + 0.5 * h * b for a, b in zip(self.x, k2, strict=True)])
            k4 = self.derivative([a + h * b for a, b in zip(self.x, k3, strict=True)])
            slopes = zip(self.x, k1, k2, k3, k4, strict=True)
            self.x = [a + h / 6.0 * (b + 2.0 * c + 2.0 * d + e) for a, b, c, d, e in slopes]
        self.x[0] = max(self.x[0], 0.0)

    def second(self, t: float) -> None:
        """One second of the plant, from ``t`` to ``t`` + 1."""
        self.control(t)
        self.actuate(t)
        self.set_flows(t)
        self.integrate()
        self.seen_t = self.x[5] + self.severity("temp_bias", t + 1.0)
        self.seen_l = self.x[0] - self.severity("level_bias", t + 1.0)

    def row(self) -> list[float]:
        """The pinned columns."""
        f = self.flow
        return [*self.x, f["F1"], f["F2"], f["F3"], f["leak"], f["overflow"], self.ua]


def trajectory(scenario: Scenario) -> Iterator[tuple[int, list[float]]]:
    """Time [s] and pinned columns, second by second."""
    p = {r["symbol"]: float(r["value"]) for r in table("parameters")}
    reactor = Reactor(p, scenario)
    for t in range(max(PINS)):
        reactor.second(float(t))
        yield t + 1, reactor.row()


def main() -> None:
    """Write the file."""
    cases = {
        s.name: {str(t): [float(f"{v:.12g}") for v in row] for t, row in trajectory(s) if t in PINS}
        for s in scenarios()
    }
    lines = ['{"columns": ' + json.dumps(COLUMNS) + ",", '"cases": {']
    for i, (name, rows) in enumerate(cases.items()):
        pins = ",\n".join(f'  "{t}": {json.dumps(row)}' for t, row in rows.items())
        lines += [f'"{name}": {{', pins, "}" + ("," if i < len(cases) - 1 else "")]
    FILE.write_text("\n".join([*lines, "}}"]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
