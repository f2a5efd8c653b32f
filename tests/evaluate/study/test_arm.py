"""Who takes part, made from the bench of a real plant."""

from __future__ import annotations

import functools

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language.named_model import NamedModel
from homeostat.agents.roles import AskingProtocol, Proposer
from homeostat.evaluate.study.plan.job import CONSTANT, StudyArm
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Arrangement, Workbench, wire
from homeostat.record.row import DO_NOTHING, FALLBACK_ONLY, SEARCH


@functools.cache
def plant() -> Plant:
    return load_plant("mixing_module")


def proposers(arm: StudyArm) -> tuple[Proposer, ...]:
    """Those that ``arm`` makes on the bench that a run has."""
    found: list[Workbench] = []

    def noted(bench: Workbench) -> tuple[Proposer, ...]:
        found.append(bench)
        return ()

    arrangement = Arrangement(language=arm.language(GroundingKind.GRAPH), propose=noted)
    wire(plant(), None, DeclaredClock(0.0), MemoryTrace(), 1, arrangement)
    assert arm.propose is not None
    return arm.propose(found[0])


def arm(who: str, then_search: bool = False) -> StudyArm:
    model = NamedModel(who) if who.startswith("scripted:") else None
    return StudyArm(who, who, AskingProtocol.ROUTE, False, then_search, model, {})


def test_who_proposes_in_which_order_and_who_improves() -> None:
    script = "scripted:reasonable"
    made = {
        (who, search): [(p.name, p.improves) for p in proposers(arm(who, search))]
        for who, search in ((SEARCH, False), (CONSTANT, False), (FALLBACK_ONLY, False), (script, False), (script, True))
    }
    assert made == {
        (SEARCH, False): [("search", True)],
        (CONSTANT, False): [("constant", False)],
        (FALLBACK_ONLY, False): [],
        (script, False): [("language", False)],
        (script, True): [("search", True), ("language", False)],
    }, "only the search improves a plant that does what is asked of it"


def test_nobody_acts_where_nothing_is_to_be_done() -> None:
    assert arm(DO_NOTHING).propose is None and arm(DO_NOTHING).language(GroundingKind.NONE) is None
