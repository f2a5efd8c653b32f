"""The main line forced on faults that it does not bear: what validation says of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from benchmarks.cstr_results import table
from benchmarks.mixing_batches import module, on_true_plant
from homeostat.agents.checks import judge
from homeostat.agents.search.candidates import design_commands
from homeostat.agents.simulation import plausible
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Verdict
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.seeds import generator as draws
from homeostat.twin.twin import Twin

WRONG = {"pump_failure": (1.0, 1.0), "clogging_main": (1.0, 1.0), "leakage_main": (0.2, 1.0)}
"""Fault -> severities that are drawn; the main line cannot be taken with any of them."""
LOOK_S = (20.0, 115.0)
"""When somebody forces the main line: before, or just after, the first transfer begins [s]."""


def forced(chosen: Scenario) -> Verdict:
    """The verdict on the main route from the end of ``chosen`` on, with the fault known and nobody else's proposal."""
    plant, sequencer = module(), new_sequencer(module())
    machine, tags = plant.description.machine, plant.description.tags_by_name
    twin = Twin(plant.model, plant.description, plant.twin, chosen.seed)
    watch(open_process(plant, chosen), sequencer.sample, twin.observe)
    path = RecoveryPath(machine, machine.paths(sequencer.state, {}, machine.recovery_event, (), longest=0)[0])
    assert not any(state.startswith("bypass") for state in path.states)
    actions = ActionSet.along(path, lambda state: design_commands(state, tags))
    known = Diagnosis(chosen.end_s, (), (Hypothesis(chosen.faults, 1.0),))
    rollout = twin.roll_out(actions, plausible(known))
    return judge(actions, rollout, plant.description.limits, machine.state(path.target), tags, path)


def wrong_routes(seeds: int) -> str:
    """One line per fault: how often the main line is refused, and by which physical checks with which margins."""
    lines = []
    for fault, severities in WRONG.items():
        verdicts = []
        for seed in range(1, seeds + 1):
            generator = draws(seed, "study/wrong routes", fault)
            at_s = round(float(generator.uniform(*LOOK_S)))
            severity = round(float(generator.uniform(*severities)), 4)
            chosen = scenario(module(), fault, seed, at_s - 10.0, severity, at_s)
            verdicts.append(forced(on_true_plant(chosen)))
        lines.append([fault, f"{severities[0]:g} to {severities[1]:g}", *_told(verdicts)])
    return table(["fault", "severity", "refused", "checks, with least and largest margin"], lines)


def _told(verdicts: Sequence[Verdict]) -> tuple[str, str]:
    """How many were refused, and the violated checks that have a margin."""
    found: dict[str, list[tuple[float, str]]] = {}
    refused = 0
    for verdict in verdicts:
        violated = [f for f in verdict.findings if not f.satisfied and math.isfinite(f.margin)]
        refused += bool(violated)
        for f in violated:
            found.setdefault(f.criterion, []).append((f.margin, f.unit))
    told = [
        f"{name} {min(margins)[0]:.3g} to {max(margins)[0]:.3g} {margins[0][1]} ({len(margins)})"
        for name, margins in sorted(found.items())
    ]
    return f"{refused}/{len(verdicts)}", "; ".join(told)
