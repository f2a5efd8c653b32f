"""Situations of the reactor in which a wait, a test or a duration is the better answer: the model's own is done."""

from __future__ import annotations

import asyncio
import json
import re
from dataclasses import replace

import pytest

from homeostat.agents.language.scripts import careful, reasonable
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.recovery import Compared, GaveUp, Probed, ReleasedActions, Waited
from homeostat.llm.model import APPROVED, Question
from homeostat.llm.replay import ReplayModel
from homeostat.llm.scripted import ScriptedModel
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.language.situations import state
from tests.llm.test_calls_file import CALL
from tests.recovery.reactor_desk import ReactorRecovery
from tests.twin.followed import readings

STUCK, WEAK = state("cool_stuck_closed"), state("pump_degrade")
DRIFTING = FaultState("temp_bias", 2.0, 1450.0)
PATIENT = Budget(latency_s=60.0)
SHORT = InterventionBounds(probe_s=20.0, answer_s=10.0)


def model() -> ScriptedModel:
    return ScriptedModel("careful", careful)


def chosen(done: ReactorRecovery) -> tuple[AlternativeKind, str, float]:
    """Kind and proposer of what was chosen first, and how much less it costs than the best for good [EUR]."""
    event = done.trace.of(Compared)[0]
    (one,) = [a for a in event.alternatives if a.digest == event.chosen]
    best = min(a.cost.total for a in event.alternatives if a.kind is AlternativeKind.RELEASE and a.admitted)
    assert one.admitted and one is next(a for a in event.alternatives if a.admitted), "the cheapest that is admitted"
    return one.kind, one.proposer, best - one.cost.total


def test_while_physics_leaves_time_production_goes_on() -> None:
    """20 s after its valve has stuck the reactor may run at full feed for a little longer, and then at less."""
    done = ReactorRecovery(readings(3, 1470, (STUCK,)), (Hypothesis((STUCK,), 1.0),), model(), bounds=Bounds(PATIENT))
    kind, by, saved = chosen(done.run())
    assert (kind, by) == (AlternativeKind.WAIT, "language") and saved > 0.1
    (wait,) = done.trace.of(Waited)
    assert wait.seconds == 20.0 and wait.follows == "normal > reduced_load" and not done.trace.of(ReleasedActions)


def test_a_model_that_is_told_that_the_best_so_far_costs_less_betters_it() -> None:
    """It gives production up for good at first, which the search does not, and then says that there is time."""
    asked: list[str] = []

    def learning(question: Question) -> str:
        asked.append(question.prompt)
        if APPROVED in question.prompt:
            return careful(question)
        if question.agent == "planning":
            return json.dumps({"reasoning": "to be sure", "path": "normal > holding"})
        return reasonable(question)

    hypotheses = (Hypothesis((STUCK,), 1.0),)
    done = ReactorRecovery(
        readings(3, 1470, (STUCK,)), hypotheses, ScriptedModel("learning", learning), bounds=Bounds(PATIENT)
    ).run()
    kind, by, saved = chosen(done)
    assert (kind, by) == (AlternativeKind.WAIT, "language") and saved > 0.1 and not done.trace.of(GaveUp)
    (first,) = (line for line in asked[0].splitlines() if "best so far" in line)
    assert re.fullmatch(r"The best so far costs \S+ EUR: release normal > \S+ by search\.", first)
    (told,) = (line for line in asked[-1].splitlines() if line.startswith(APPROVED))
    best = r"the best so far costs \S+ EUR: release normal > reduced_load by search\."
    assert re.search(r": normal > holding: .*, costs \S+ EUR; " + best, told)


@pytest.mark.slow
def test_a_recording_of_before_says_nothing_cheaper_and_keeps_what_it_said_later() -> None:
    """It was made by a model that nobody asked for something cheaper than what was approved."""
    values = {"L1.sp": 6.2, "T1.sp": 310.0, "V2.man": None}
    said: list[tuple[str, dict[str, object]]] = [
        ("planning", {"path": "normal > holding"}), ("action", {"commands": values}), ("planning", {"path": "later"}),
    ]  # fmt: skip
    calls = [replace(CALL, agent=agent, answer=json.dumps({"reasoning": "so", **answer})) for agent, answer in said]
    model = ReplayModel("replay:before", calls)
    hypotheses = (Hypothesis((STUCK,), 1.0),)
    done = ReactorRecovery(readings(3, 1470, (STUCK,)), hypotheses, model, bounds=Bounds(PATIENT)).run()
    assert [r.proposer for r in done.trace.of(ReleasedActions)] == ["search"] and not done.trace.of(GaveUp)
    assert {a.proposer for a in done.trace.of(Compared)[0].alternatives if a.admitted} == {"search", "language"}
    later = asyncio.run(model.ask(Question("planning", 1.0, "", "State normal", {}, ""), 1.0))
    assert "later" in later.answer


def test_a_test_that_is_cheap_tells_a_stuck_valve_from_a_thermometer_that_lies() -> None:
    """The prober does not begin it by itself: it wins less than two percent."""
    hypotheses = (Hypothesis((STUCK,), 0.75), Hypothesis((DRIFTING,), 0.25))
    bounds = Bounds(PATIENT, SHORT)
    done = ReactorRecovery(readings(3, 1475, (STUCK,)), hypotheses, model(), bounds=bounds, probes=True).run()
    kind, by, saved = chosen(done)
    assert (kind, by) == (AlternativeKind.TEST, "language") and saved > 0.1
    assert [p.proposer for p in done.trace.of(Probed)] == ["language"]
    assert done.trace.of(ReleasedActions)[0].proposer == "language"


def test_what_a_minute_cures_is_held_for_a_minute_where_the_state_is_dear() -> None:
    """The level has to come away from the weir once; a state with other setpoints costs 2 EUR in 900 s."""
    done = ReactorRecovery(
        readings(3, 1520, (WEAK,)), (Hypothesis((WEAK,), 1.0),), model(), bounds=Bounds(PATIENT), dear=8.0
    ).run()
    kind, by, saved = chosen(done)
    assert (kind, by) == (AlternativeKind.HOLD, "language") and saved > 1.0
    (released,) = done.trace.of(ReleasedActions)
    assert (released.proposer, released.for_s) == ("language", 60.0) and released.certificate is not None


def test_where_the_state_costs_little_what_lasts_is_the_better_answer() -> None:
    done = ReactorRecovery(
        readings(3, 1520, (WEAK,)), (Hypothesis((WEAK,), 1.0),), model(), bounds=Bounds(PATIENT)
    ).run()
    event = done.trace.of(Compared)[0]
    one = next(a for a in event.alternatives if a.digest == event.chosen)
    assert one.kind is AlternativeKind.RELEASE and one.proposer == "search"
