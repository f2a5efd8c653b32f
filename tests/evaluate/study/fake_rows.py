"""Rows that look like a study's, without any run: two plants, eleven scenarios, seven proposers, ten seeds."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from homeostat.record.row import DO_NOTHING, HINDSIGHT, Row

SEEDS = range(1, 11)
SCENARIOS = {
    "cstr": (
        ("normal", "none", "", "none"), ("fouling", "single", "fouling", "fouling"),
        ("pump", "single", "pump_degrade", "pump_degrade"),
        ("cooling", "single", "cool_stuck_closed", "cool_stuck_closed"),
        ("two at once", "paired", "", "fouling+pump_degrade"), ("drift", "unknown", "", "drift"),
    ),
    "mixing_module": (
        ("healthy", "none", "normal", "none"), ("pump_failure", "single", "pump_failure", "pump_failure"),
        ("clogging", "single", "clogging_fault", "clogging_main"), ("leakage", "single", "leak", "leakage_main"),
        ("open_inlet", "single", "", "stuck_open_VI203"),
    ),
}  # fmt: skip
"""Plant -> scenario, kind, published row, fault."""
PROPOSERS = (
    ("search", "none", 0.97), ("search", "graph", 0.85), ("openai:gpt-4.1-mini", "none", 0.9),
    ("replay:runs/gpt-4o-mini.jsonl", "none", 0.7), ("scripted:reasonable", "none", 0.95), (DO_NOTHING, "none", 0.3),
    (HINDSIGHT, "none", 1.0),
)  # fmt: skip
"""Proposer, what it goes without, how often it succeeds."""
LANGUAGE = ("openai:", "replay:", "scripted:")


def plain(**changed: Any) -> Row:
    """A run of the search on the reactor in which all went well, with what a test changes."""
    row = Row(
        job="job-1", case="cstr", scenario="fouling", kind="single", published="fouling", proposer="search",
        ablation="none", seed=1, fault="fouling", severity=(0.7,), onset_s=(1000.0,), batch=False,
        disturbances="", mismatch="none",
        outcome="recovered", success=True, actor="search", state="Degraded", reason="", detection_s=40.0,
        false_alarm=False, released_s=42.0, releases=1, fallbacks=0, attempts=2, refused=0, decisions=1, acted=True,
        exposure_s=0.0, exposure_detected_s=0.0, least_margin=0.1, least_margin_limit="T1 high", missed="",
        approved_margin=0.4,
        production_loss=0.02, complete_s=None, nominal_s=None, totals={}, believed="fouling", believed_p=0.9,
        true_p=0.9, brier=0.02, plans=None, plans_right=None, actions=None, actions_right=None, on_right=None,
        on_wrong=None, on_missed=None, planning_calls=0, planning_in=0, planning_out=0, action_calls=0, action_in=0,
        action_out=0, reprompting_calls=0, reprompting_in=0, reprompting_out=0, tokens_by="", cost_usd=None,
        failures=0, wall_decision_s=1.2, wall_thinking_s=2.0, wall_call_s=None, wall_s=3.0, trace="",
    )  # fmt: skip
    return replace(row, **changed)


def campaign(seeds: range = SEEDS) -> tuple[Row, ...]:
    """All of them; the same every time."""
    return tuple(_rows(seeds))


def _rows(seeds: range) -> Iterator[Row]:
    for plant, scenarios in SCENARIOS.items():
        for scenario, kind, published, fault in scenarios:
            for proposer, ablation, skill in PROPOSERS:
                for seed in seeds:
                    draw = random.Random(f"{plant} {scenario} {proposer} {ablation} {seed}")
                    job = f"{plant}-{scenario}-{proposer}-{ablation}-{seed}".replace(" ", "_")
                    base = plain(
                        job=job, case=plant, scenario=scenario, kind=kind, published=published, proposer=proposer,
                        ablation=ablation, seed=seed, fault=fault, batch=plant == "mixing_module",
                        severity=() if kind == "none" else (0.5,), onset_s=() if kind == "none" else (1000.0,),
                    )  # fmt: skip
                    success = kind == "none" or draw.random() < skill - 0.3 * (scenario == "open_inlet")
                    yield _asked(_diagnosed(_ended(base, success, draw), draw), draw)


def _ended(row: Row, success: bool, draw: random.Random) -> Row:
    idle, fault_free = row.proposer == DO_NOTHING, row.kind == "none"
    fallback = not success and not idle and draw.random() < 0.6
    acted = not idle and (draw.random() < 0.1 if fault_free else True)
    exposure = 0.0 if success and draw.random() < 0.9 else round(draw.expovariate(1 / (20 if success else 300)), 1)
    end = round(300 + draw.gauss(0, 4) + (0 if row.proposer == HINDSIGHT else abs(draw.gauss(8, 12))), 1)
    actor = "fallback" if fallback else "none" if not acted else "search"
    if acted and not fallback and row.proposer.startswith(LANGUAGE) and draw.random() < 0.8:
        actor = "language"
    return replace(
        row, success=success, fallbacks=int(fallback), acted=acted, actor=actor,
        outcome="fallback" if fallback else "recovered" if acted else "no_action",
        state="Pumping_out" if fallback else "Degraded" if success else "Tripped",
        reason="nothing passed in time" if fallback else "",
        exposure_s=exposure, exposure_detected_s=exposure * 0.5,
        least_margin=round(-exposure / 500 if exposure else draw.uniform(0.02, 0.3), 3),
        production_loss=None if row.batch else round(max(0.0, draw.gauss(0.03 if success else 0.4, 0.03)), 4),
        complete_s=end if row.batch and success else None, nominal_s=295.0 if row.batch else None,
        totals={"spilled_L": round(draw.expovariate(5), 3)} if row.batch else {},
        trace=f"runs/{row.job}" if draw.random() < 0.5 else "",
    )  # fmt: skip


def _diagnosed(row: Row, draw: random.Random) -> Row:
    if row.kind == "none":
        return replace(
            row, detection_s=None, false_alarm=draw.random() < 0.03, believed="", believed_p=None, true_p=None,
            brier=None, released_s=None,
        )  # fmt: skip
    p = round(draw.uniform(0.3, 1.0), 3)
    right = row.kind != "unknown" and draw.random() < p
    return replace(
        row, detection_s=round(draw.expovariate(1 / 60) + 5, 1), believed=row.fault if right else "leak",
        believed_p=p, true_p=p if right else round((1 - p) / 3, 3), brier=round(2 * (1 - p) ** 2 if right else 1.4, 3),
    )  # fmt: skip


def _asked(row: Row, draw: random.Random) -> Row:
    row = replace(row, wall_decision_s=draw.uniform(0.5, 3) if row.acted else None, wall_s=draw.uniform(2, 6))
    if not row.proposer.startswith(LANGUAGE):
        return row
    refused = draw.choice((0, 0, 0, 1, 2))
    planning, action = 7, 7 + refused
    return replace(
        row, refused=refused, attempts=7 + refused, plans=planning, plans_right=planning - draw.choice((0, 0, 1)),
        actions=action, actions_right=action - refused, on_right=13, on_wrong=refused, on_missed=0,
        planning_calls=planning, planning_in=planning * 2400 + draw.randint(0, 90), planning_out=planning * 60,
        action_calls=action, action_in=action * 1700 + draw.randint(0, 90), action_out=action * 90,
        reprompting_calls=refused, reprompting_in=refused * 900, reprompting_out=refused * 50, tokens_by="estimate",
        cost_usd=None if row.proposer.startswith("scripted:") else 0.004, wall_call_s=draw.uniform(1.2, 3.1),
    )  # fmt: skip
