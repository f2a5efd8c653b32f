"""Alternatives on the true plant: what a fallback, what was released, or nobody would have made of a run."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.mode import Mode
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import ActionSet, Command
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.reference.alternatives import as_usual, avoidable, diverted, released_set
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run, run_steered
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce, in_force
from homeostat.evaluate.score.scoring import outside_after
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Language, fallbacks, new_sequencer
from tests.twin.followed import reactor

STUCK = scenario(reactor(), "cool_stuck_closed", 1, 1450.0, None, 2400.0)
"""Without action it is too hot within minutes, and stays so."""
QUIET = scenario(reactor(), "none", 1, None, None, 1500.0)
STARTED_S = 600.0
FORCE = LimitsInForce.after(reactor().description, STARTED_S)


@functools.cache
def mixing() -> Plant:
    return load_plant("mixing_module")


@functools.cache
def batch() -> tuple[Run, MemoryTrace]:
    """A batch whose pump fails, and which goes on through the bypass."""
    trace = MemoryTrace()
    return run(mixing(), scenario(mixing(), "pump_failure", 3, 114.0), trace, DeclaredClock(1.0)), trace


def stop_feed() -> ActionSet:
    return next(s.actions for s in fallbacks(reactor()) if s.name == "isolate")


@pytest.mark.parametrize(("detected_s", "found"), [(1454.0, True), (2390.0, False)])
def test_nobody_acting_violates_what_a_fallback_would_have_kept(detected_s: float, found: bool) -> None:
    """Ten seconds before the end no fallback brings it back, so nobody can be blamed for that."""
    truth = unsupervised(reactor(), STUCK).truth
    assert avoidable(reactor(), STUCK, truth, FORCE, detected_s, None) is found


def test_what_keeps_every_limit_violates_nothing() -> None:
    truth = diverted(reactor(), STUCK, 1454.0, stop_feed(), aborting=True)
    assert truth is not None and not avoidable(reactor(), STUCK, truth, FORCE, 1454.0, None)


def test_what_was_released_late_would_have_kept_the_limit_at_detection() -> None:
    """The same commands at once and too late, with no fallback to compare with."""
    feed = reactor().description.tag("F1.sp").rate_limit
    held = ActionSet((Command("F1.sp", 0.0, feed), Command("XV1.cmd", 0.0, None)), "holding")
    late = diverted(reactor(), STUCK, 1800.0, held)
    assert late is not None and avoidable(reactor(), STUCK, late, FORCE, 1454.0, held)


def test_diverted_only_from_its_time_on() -> None:
    alone, ours = unsupervised(reactor(), STUCK).truth, diverted(reactor(), STUCK, 1454.0, stop_feed(), aborting=True)
    assert ours is not None
    before, after = alone.times_s <= 1454.0, alone.times_s > 1500.0
    np.testing.assert_array_equal(ours.signals["T1"][0, before], alone.signals["T1"][0, before])
    assert (ours.signals["F1"][0, after] < 0.001).all() and (alone.signals["F1"][0, after] > 0.02).all()


@pytest.mark.slow
def test_acting_is_needed_where_leaving_alone_loses_more() -> None:
    """A pump that has failed violates no limit; its batch never ends."""
    result, _ = batch()
    alone = run_steered(mixing(), result.scenario, new_sequencer(mixing()))
    assert alone.production_loss > result.production_loss + 0.1
    assert result.outcome is Outcome.RECOVERED and result.complete_s is not None


def test_a_release_is_found_again_with_its_later_steps() -> None:
    result, trace = batch()
    released, attempts = result.record.releases[0], trace.of(Attempted)
    actions = released_set(mixing(), released, attempts)
    assert actions is not None and actions.digest == released.digest and actions.then
    (path,) = {a.path for a in attempts if a.digest == released.digest}
    assert actions.end == path[-1] == result.state
    assert released_set(mixing(), released, ()) is None, "nobody tells where it leads"


def test_steps_as_usual_are_told_from_others() -> None:
    usual = [state for state, _ in unsupervised(mixing(), scenario(mixing(), "none", 3)).states]
    assert usual[-1] == "complete"
    assert all(as_usual(mixing(), usual[:k]) for k in range(len(usual) + 1))
    assert not as_usual(mixing(), [*usual[:4], "bypass_emptying_B201"]) and not as_usual(mixing(), usual[1:])


@pytest.mark.wide
@pytest.mark.parametrize(
    ("onset_s", "kind"), [(114.0, Outcome.RECOVERED), pytest.param(None, Outcome.NO_ACTION, marks=pytest.mark.wide)]
)
def test_a_batch_that_is_released_step_by_step_is_not_acted_upon_without_need(
    onset_s: float | None, kind: Outcome
) -> None:
    chosen = scenario(mixing(), "none" if onset_s is None else "pump_failure", 3, onset_s)
    stepwise = Conditions(AskingProtocol.PER_STEP)
    language = Language(ScriptedModel("reasonable", reasonable))
    proposing = Proposing(language, stepwise)
    assert run(mixing(), chosen, clock=DeclaredClock(1.0), proposing=proposing).outcome is kind


def outcome_of(chosen: Scenario, at_s: float, *commands: Command) -> Run:
    """A run in which nobody detects anything, and something is commanded."""
    return run_steered(reactor(), chosen, new_sequencer(reactor()), at_s, commands)


def test_a_run_that_ends_outside_is_a_violation_whoever_acts() -> None:
    assert outcome_of(STUCK, 9999.0).outcome is Outcome.LIMIT_VIOLATED


def test_an_unnoticed_fault_that_violates_a_limit_and_passes_is_not_detected() -> None:
    held = stop_feed().commands
    assert outcome_of(STUCK, 1900.0, *held).outcome is Outcome.NOT_DETECTED


def test_an_unnoticed_fault_that_violates_nothing_is_no_action() -> None:
    mild = scenario(reactor(), "temp_bias", 1, 1450.0, 0.5, 2000.0)
    assert outcome_of(mild, 9999.0).outcome is Outcome.NO_ACTION


@pytest.mark.slow
def test_a_line_that_is_blocked_is_held() -> None:
    chosen = scenario(reactor(), "outlet_block", 1, 1450.0, None, 1600.0)
    result = run(reactor(), chosen, clock=DeclaredClock(1.0))
    assert (result.outcome, result.actor) == (Outcome.HELD, "search") and not result.good
    assert result.truth.signals["F1"][0, -60:].mean() < 0.1 * reactor().production.design_rate


IN_START_UP = {"cool_stuck_closed": 1.0, "leak": 0.02}
"""Faults of the reactor that keep it from ever leaving start-up."""


@pytest.mark.parametrize("fault", IN_START_UP)
def test_a_reactor_that_never_leaves_start_up_is_outside_its_limits(fault: str) -> None:
    """Its start-up limits hold for as long as the tables allow, every limit from then on."""
    chosen = scenario(reactor(), fault, 1, 5.0, IN_START_UP[fault], 900.0)
    result = run(reactor(), chosen, MemoryTrace(), DeclaredClock(2.0), operation=Operation(Mode.OBSERVE))
    assert result.outcome is Outcome.LIMIT_VIOLATED and not result.good
    assert result.exposures and max(e.from_detection_s for e in result.exposures) > 100.0


def test_a_limit_of_start_up_is_violated_although_a_fallback_would_have_kept_it() -> None:
    chosen = scenario(reactor(), "cool_stuck_closed", 1, 5.0, 1.0, 300.0)
    truth = unsupervised(reactor(), chosen).truth
    force = in_force(reactor().description, [], truth.start_s)
    assert force.starting(truth).all() and avoidable(reactor(), chosen, truth, force, 20.0, None)


@pytest.mark.parametrize("plant", [reactor(), mixing()], ids=lambda plant: plant.name)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_start_without_a_fault_keeps_the_limits_of_start_up(plant: Plant, seed: int) -> None:
    alone = unsupervised(plant, scenario(plant, "none", seed, None, None, 600.0))
    force = in_force(plant.description, alone.states, alone.truth.start_s)
    assert force.spans and outside_after(alone.truth, force) == {}


def test_a_batch_that_cannot_begin_is_judged_by_every_limit() -> None:
    """It has ten seconds to begin in."""
    force = in_force(mixing().description, [], 1.0)
    assert force.spans == ((1.0, 11.0),)
