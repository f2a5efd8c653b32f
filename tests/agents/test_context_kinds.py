"""Context by kind: the graph's, documents, none."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from homeostat.agents.grounding.context import ContextFinder, GroundingKind, NoContext
from homeostat.agents.grounding.documents import DocumentContext, context_finder
from homeostat.agents.grounding.grounding import TEXT, Grounding
from homeostat.knowledge.context.context import Context
from homeostat.llm.tokens import estimate
from homeostat.plants.plant import load_plant
from homeostat.record.directory import RunDirectory

PLANTS = ["cstr", "mixing_module"]


def asked(kind: GroundingKind, plant: str, budget: int, grounding: Grounding | None = None) -> list[Context]:
    """One context for each of the three questions."""
    case = load_plant(plant)
    d = case.description
    grounding = grounding or Grounding(case.graph, case.namespace)
    shown: ContextFinder = context_finder(kind, grounding, case.graph, case.namespace)
    assert shown.kind is kind
    state = next(s for s in d.machine.states if s.open_setpoints or s.setpoints)
    faults = [d.faults[0].name]
    return [
        shown.planning_context(
            state.name, d.machine.recovery_event, [s.name for s in d.machine.states[:3]], faults, budget
        ),
        shown.action_context(
            [state.name], [r.tag for r in state.setpoints], faults, [x.name for x in d.limits.hard], budget
        ),
        shown.step_context(state.name, faults, budget),
    ]


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("kind", GroundingKind)
@pytest.mark.parametrize("budget", [0, 50, 300, 900])
def test_the_budget_is_kept(plant: str, kind: GroundingKind, budget: int) -> None:
    for found in asked(kind, plant, budget):
        assert estimate(found.text) <= found.tokens <= found.budget == budget
        assert found.shown == len(found.text.splitlines())


@pytest.mark.parametrize("plant", PLANTS)
def test_documents_fill_the_budget_that_the_graph_has(plant: str) -> None:
    for found in asked(GroundingKind.DOCUMENTS, plant, 900):
        assert found.tokens > 800 and found.left_out and "did not fit" in found.omission


@pytest.mark.parametrize("plant", PLANTS)
def test_the_same_question_finds_the_same_documents(plant: str) -> None:
    assert asked(GroundingKind.DOCUMENTS, plant, 900) == asked(GroundingKind.DOCUMENTS, plant, 900)


@pytest.mark.parametrize("plant", PLANTS)
def test_none_shows_nothing_and_leaves_nothing_out(plant: str) -> None:
    case = load_plant(plant)
    grounding = Grounding(case.graph, case.namespace)
    for found in asked(GroundingKind.NONE, plant, 900, grounding):
        assert (found.text, found.tokens, found.shown, found.omission) == ("", 0, 0, "")
    assert grounding.drain() == ()


def test_what_was_looked_for_and_found_is_recorded() -> None:
    case = load_plant("cstr")
    grounding = Grounding(case.graph, case.namespace)
    found = asked(GroundingKind.DOCUMENTS, "cstr", 900, grounding)
    events = grounding.drain()
    assert [e.question for e in events] == ["planning_documents", "action_documents", "step_documents"]
    assert all(e.form == TEXT and e.query_sha256 and e.answer_sha256 for e in events)
    assert [e.answer for e in events] == [f"{x.shown} documents shown" for x in found]
    assert "cool_stuck_closed" in events[0].about and grounding.drain() == ()


def test_the_documents_that_were_shown_are_kept_in_the_run_directory(tmp_path: Path) -> None:
    case = load_plant("cstr")
    with RunDirectory(tmp_path / "run") as directory:
        grounding = Grounding(case.graph, case.namespace, directory)
        found = asked(GroundingKind.DOCUMENTS, "cstr", 900, grounding)
        for event, shown in zip(grounding.drain(), found, strict=True):
            kept = directory.path / "prompts" / f"{event.answer_sha256}.md"
            assert kept.read_text("utf-8") == shown.text
            assert "cool_stuck_closed" in (kept.parent / f"{event.query_sha256}.md").read_text("utf-8")


def test_without_the_library_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    case = load_plant("cstr")
    grounding = Grounding(case.graph, case.namespace)
    monkeypatch.setitem(sys.modules, "bm25s", None)
    with pytest.raises(ImportError) as caught:
        DocumentContext(grounding, case.graph, case.namespace)
    assert str(caught.value) == "retrieving documents needs 'bm25s': pip install 'homeostat[campaign]'"
    assert caught.value.name == "bm25s"
    for kind in (GroundingKind.GRAPH, GroundingKind.NONE):  # these need nothing
        assert isinstance(context_finder(kind, grounding, case.graph, case.namespace), Grounding | NoContext)
