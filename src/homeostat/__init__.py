"""Homeostat takes a process plant from a detected fault to a validated corrective action.

A whole run, simulated, in four lines::

    import homeostat as hs
    plant = hs.load_plant("cstr")
    run = hs.run(plant, fault=hs.Fault("pump_degrade", severity=0.5), seed=1, thinking=hs.declared(1.0))
    run.outcome, run.actor, run.detected_s, run.events(hs.events.ReleasedActions), run.save("runs/mine")

For plants and runs:
    load_plant    a plant by its name or its folder: what its tables and settings say, ready to be run
    run           one scenario of a plant, with a fault or without, from start-up to the end and its score
    Fault         a fault that is truly there: its name, how severe, from when
    declared      how long thinking takes, declared, so that equal seeds give equal runs
    Run           what a run came to: outcome, actor, times, events, figure; it can be saved
    Outcome       how a run ended, in one word
    events        every event of a run as a type
    Study         many runs from one file, with their report
For plants of your own:
    formula       a rule over tags, read from text: its margins over values or signals
    Supervisor    guard and recovery for a plant behind a link of yours
    Link          what a plant must offer to be supervised: samples, and the right to write
    LanguageModel what a language model must offer to propose

Everything else is reachable by its module and described in the documentation.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from homeostat.domain.outcome import Outcome
    from homeostat.domain.ports import Link
    from homeostat.evaluate.operation import declared
    from homeostat.evaluate.run import Run
    from homeostat.evaluate.scenario import Fault
    from homeostat.evaluate.simulation import run
    from homeostat.evaluate.study.study import Study
    from homeostat.llm.model import LanguageModel
    from homeostat.plants.plant import load_plant as load_plant
    from homeostat.plants.wired.supervisor import Supervisor
    from homeostat.record import events
    from homeostat.stl.formula import parse as formula

__version__ = "0.1.0"

# Read when numpy is loaded. With one thread, sums come in the same order on any number of cores, and the small matrices
# of the twin and of the diagnosis keep no second core spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__all__ = [
    "Fault",
    "LanguageModel",
    "Link",
    "Outcome",
    "Run",
    "Study",
    "Supervisor",
    "declared",
    "events",
    "formula",
    "load_plant",
    "run",
]

_HOMES = {
    "Fault": "evaluate.scenario:Fault",
    "LanguageModel": "llm.model:LanguageModel",
    "Link": "domain.ports:Link",
    "Outcome": "domain.outcome:Outcome",
    "Run": "evaluate.run:Run",
    "Study": "evaluate.study.study:Study",
    "Supervisor": "plants.wired.supervisor:Supervisor",
    "declared": "evaluate.operation:declared",
    "events": "record.events:",
    "formula": "stl.formula:parse",
    "load_plant": "plants.plant:load_plant",
    "run": "evaluate.simulation:run",
}
"""Name -> where it lives; it is loaded when it is asked for, so that importing the package costs nothing."""


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'homeostat' has no name {name!r}; it has {', '.join(__all__)}")
    module, _, attribute = _HOMES[name].partition(":")
    found = import_module(f"homeostat.{module}")
    return getattr(found, attribute) if attribute else found


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
