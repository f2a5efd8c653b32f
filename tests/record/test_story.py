"""The story of a run: what a language model's server says reaches the operator as one printable line."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.events.deviations import Deviated, Strayed
from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    NoActionTaken,
    NotAsked,
    Probed,
    ProbeEnded,
    ReleasedActions,
    ReleaseRefused,
)
from homeostat.domain.plant.limits import Owner
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import Finding, Violating
from homeostat.guard.requests.permissives import finding as judged
from homeostat.journal.calls import ModelCalled
from homeostat.plants.plant import load_plant
from homeostat.record.story.story import Story


def called(served: str = "", failure: str = "", detail: str = "") -> ModelCalled:
    return ModelCalled(
        agent="action", model="ollama:m", served=served, settings=(), template_sha256="", prompt_sha256="",
        schema_sha256="", answer_sha256="", failure=failure, detail=detail, input_tokens=0, output_tokens=0,
        cost_usd=None, wall_requests=1, wall_latency_s=0.5,
    )  # fmt: skip


FORGED = "m\n    931 s  released  T1.sp to 400 K\x1b[2J\r\u202e"


@pytest.mark.parametrize("event", [called(served=FORGED), called(failure="REJECTED", detail=FORGED)])
def test_a_server_forges_no_line(event: ModelCalled) -> None:
    """Also in a journal that was written by somebody else."""
    (line,) = Story(load_plant("cstr").description).tell(event, 930.0)
    assert str(line).isprintable() and "m 931 s released" in str(line)


def test_a_refusal_is_told_with_its_reason_and_forges_no_line() -> None:
    story = Story(load_plant("cstr").description)
    finding = Finding("PRM-COOL", Owner.ACTION, -0.5, "K", 0.0, 0, "PRM-COOL is violated by 0.5 K")
    (line,) = story.tell(ReleaseRefused("search", "", (finding,)), 930.0)
    assert str(line).endswith("refused   search: the release check, because PRM-COOL is violated by 0.5 K")
    answered = RequestAnswered("r1", "search", "", RequestStatus.REFUSED, "CHK-SERVICE", FORGED)
    (line,) = story.tell(answered, 931.0)
    assert str(line).isprintable() and "search: the guard, because" in str(line)


@pytest.mark.parametrize(
    ("margin", "late", "text"),
    [(0.1, False, "needed"), (-0.1, False, "would cost less"), (0.1, True, "was found in time"),
     (-0.1, True, "was found in time")],
)  # fmt: skip
def test_why_a_plant_is_left_alone_is_told(margin: float, late: bool, text: str) -> None:
    story = Story(load_plant("cstr").description)
    (line,) = story.tell(NoActionTaken("normal", margin, late=late), 930.0)
    assert str(line).endswith(f"no action {text} in 'normal'")


def test_a_test_move_is_told_with_what_it_is_for_and_what_came_of_it() -> None:
    story = Story(load_plant("mixing_module").description)
    apart = ("leakage_common", "leakage_main")
    (line,) = story.tell(Probed(apart, "bypass_emptying_B201", (), 6.0, 1.69, 0.2957, 0.0105), 127.0)
    assert str(line) == (
        "    127 s  probe     bypass_emptying_B201 for 6 s to tell leakage_common from leakage_main; "
        "1.7 nats expected, worth 0.296, costs 0.011"
    )
    (line,) = story.tell(Probed(apart, "", (), 6.0, 1.69, 0.2957, 0.0105), 128.0)
    assert "a wait for 6 s to tell" in str(line)
    (line,) = story.tell(ProbeEnded(apart, FORGED, 0.6, False), 135.0)
    assert str(line).isprintable() and "not told apart: 60 %" in str(line)


@pytest.mark.parametrize(
    ("answer_s", "lost", "gain", "said"),
    [(21.0, 0.84, 0.6, "an answer takes 21.0 s, in which 0.84 EUR are lost, and may win 0.6 EUR at most"),
     (0.0, 0.0, 0.0, "nothing can cost less than what is approved")],
)  # fmt: skip
def test_why_somebody_is_asked_no_further_is_told(answer_s: float, lost: float, gain: float, said: str) -> None:
    (line,) = Story(load_plant("cstr").description).tell(NotAsked("language", answer_s, lost, gain, "EUR"), 930.0)
    assert str(line) == f"    930 s  enough    language is asked no further: {said}"


def alternative(kind: AlternativeKind, name: str, amount: float, refused: str = "", proposer: str = "") -> Alternative:
    return Alternative(kind, name, Cost((CostItem("production", amount),), 30.0), refused, proposer)


REDUCED = alternative(AlternativeKind.RELEASE, "normal > reduced_load", 10.24, "", "search")
LEAVE = alternative(AlternativeKind.LEAVE, "normal", 10.81, "too hot")
ISOLATE = alternative(AlternativeKind.FALLBACK, "isolate", 33.0, "it acts where nothing else may be done")


def test_what_could_be_done_is_told_line_by_line_with_what_each_costs_and_why_it_may_not_be() -> None:
    found = Compared("EUR", (replace(REDUCED, digest="d1"), LEAVE, ISOLATE), "d1")
    assert [str(line) for line in Story(load_plant("cstr").description).tell(found, 930.0)] == [
        "    930 s  compared  reduced_load by search, 10.2 EUR, chosen",
        "    930 s  compared  leave alone, 10.8 EUR; not admitted: too hot",
        "    930 s  compared  isolate by fallback, 33.0 EUR; not admitted: it acts where nothing else may be done",
    ]


@pytest.mark.parametrize("margin", [-4.97, 0.4, math.nan])
@pytest.mark.parametrize("violating", [None, Violating(36, 36, 1.0)])
def test_why_it_may_not_be_is_told_without_a_formula(margin: float, violating: Violating | None) -> None:
    plant = load_plant("cstr").description
    for limit in plant.limits.limits:
        reason = judged(limit, margin, 636.0, violating=violating).message
        found = Compared("EUR", (replace(LEAVE, refused=reason),), "")
        (line,) = Story(plant).tell(found, 930.0)
        assert limit.formula.text in reason and limit.formula.text not in str(line)
        assert limit.description in str(line) and f"({limit.name})" in str(line)
        assert violating is None or "36 of 36 members" in str(line) or math.isnan(margin)


@pytest.mark.parametrize(("beside", "told"), [(False, ""), (True, " of doing worse than the fallback")])
def test_how_safe_each_is_stands_in_the_list_and_is_never_rounded_down(beside: bool, told: str) -> None:
    known = replace(REDUCED, certificate=Certificate(64, 0, 0.04941, 0.95, beside))
    line, _ = Story(load_plant("cstr").description).tell(Compared("EUR", (known, LEAVE), "d1"), 930.0)
    assert str(line).endswith(f"reduced_load by search, 10.2 EUR, risk at most 5.0 %{told}")


@pytest.mark.parametrize(
    ("criterion", "margin", "told"),
    [
        ("LIM-T-HIGH", -1.5, "approved, as the fallback does no better: worst margin -1.5 K (LIM-T-HIGH)"),
        ("LIM-T-HIGH", 0.5, "approved, worst margin +0.5 K (LIM-T-HIGH)"),
        ("ACC-T", -1.5, "approved, worst margin -1.5 K (ACC-T)"),
    ],
)
def test_why_something_is_approved_that_violates_a_limit(criterion: str, margin: float, told: str) -> None:
    finding = Finding(criterion, Owner.ACTION, margin, "K", 0.0, 0, "")
    tried = Attempted(1, "search", ("normal", "holding"), (), "d1", True, (finding,), 4)
    (line,) = Story(load_plant("cstr").description).tell(tried, 930.0)
    assert str(line).endswith(told)
    (refused,) = Story(load_plant("cstr").description).tell(replace(tried, approved=False), 930.0)
    assert "refused because worst margin" in str(refused)


@pytest.mark.parametrize("where", ["name", "refused", "proposer"])
def test_a_comparison_forges_no_line(where: str) -> None:
    """Names of proposers and reasons of refusals come from anybody."""
    forged = replace(REDUCED, **{where: FORGED})
    (line,) = Story(load_plant("cstr").description).tell(Compared(FORGED, (forged,), "d1"), 930.0)
    assert str(line).isprintable()


def test_a_comparison_of_which_nothing_comes_is_told_until_something_was_released() -> None:
    story = Story(load_plant("cstr").description)
    nothing = Compared("EUR", (LEAVE,), "")
    assert len(list(story.tell(nothing, 930.0))) == 1
    list(story.tell(ReleasedActions("search", (), "d1", "reduced_load", 0.2), 931.0))
    assert story.record.acted_s == 931.0
    assert list(story.tell(nothing, 990.0)) == []
    assert len(list(story.tell(Compared("EUR", (REDUCED, LEAVE), "d1"), 991.0))) == 2


def test_a_plant_that_is_nearer_a_limit_than_predicted_is_told_in_one_line() -> None:
    reason = "'T1 <= 313' holds by 0.1 K (LIM-T-HIGH), predicted to hold by 1.2 at least with what is held to be wrong"
    (line,) = Story(load_plant("cstr").description).tell(Strayed("LIM-T-HIGH", 0.1, 1.2, reason), 3038.0)
    assert str(line) == f"   3038 s  strays    {reason}"


def test_a_departure_is_told_with_its_reason() -> None:
    event = Deviated("filling_B201", "t1", 36.0, 40.0, "'B201.level >= 0.198' does not hold at 49 s, predicted by 40 s")
    (line,) = Story(load_plant("mixing_module").description).tell(event, 49.0)
    assert str(line) == (
        "     49 s  deviates  from the prediction in 'filling_B201': "
        "'B201.level >= 0.198' does not hold at 49 s, predicted by 40 s"
    )
