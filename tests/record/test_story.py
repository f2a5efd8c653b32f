"""The story of a run: what a language model's server says reaches the operator as one printable line."""

from __future__ import annotations

import pytest

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.recovery import Deviated, Probed, ProbeEnded, ReleaseRefused
from homeostat.domain.plant.limits import Owner
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import Finding
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


def test_a_departure_is_told_with_its_reason() -> None:
    event = Deviated("filling_B201", "t1", 36.0, 40.0, "'B201.level >= 0.198' does not hold at 49 s, predicted by 40 s")
    (line,) = Story(load_plant("mixing_module").description).tell(event, 49.0)
    assert str(line) == (
        "     49 s  deviates  from the prediction in 'filling_B201': "
        "'B201.level >= 0.198' does not hold at 49 s, predicted by 40 s"
    )
