"""Sizes of what is older than the readings: kept, not drawn to what is typical, and not since another moment."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultState, Hypothesis
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.twin.carried import Carrier
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.memory import LEAST_SHARE, sizes
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.search import Search
from homeostat.twin.isolation.sizes import SizeError
from tests.twin.followed import follow, reactor, readings

LIES = FaultState("level_bias", 1.9, 1450.0)
EXACT, WRONG = SizeError(0.0, 0.0), SizeError(0.05, 0.02)
MODES = {mode.name: mode for mode in reactor().description.fault_modes}


@pytest.mark.slow
def test_a_size_is_kept_review_by_review() -> None:
    """A level that is controlled says nothing of its transmitter's constant error once the step is out of sight."""
    truth = Scenario("cstr", (LIES,), 401, 4000.0, mismatch="plant")
    link = SimulatedLink(open_process(reactor(), truth))
    seen = tuple(link.advance() for _ in range(4000))
    twin = follow(seen[:1500], 401)
    said: tuple[Hypothesis, ...] = ()
    known: tuple[FaultState, ...] = ()
    found = []
    for k, snapshot in enumerate(seen[1500:], 1501):
        twin.observe(snapshot)
        if k in (1560, 2160, 2760, 3360, 3960):
            said = twin.explain(["level_bias"], known, since_s=1455.0, before=said, news=True)
            known = said[0].faults
            found.append(next(f for f in known if f.fault == "level_bias"))
    assert all(f.severity == pytest.approx(LIES.severity, abs=0.15) for f in found)
    assert all(f.onset_s == pytest.approx(LIES.onset_s, abs=3.0) for f in found)


def test_what_is_older_than_the_readings_is_of_the_size_it_had_and_as_old_as_it_was() -> None:
    plant, twin = reactor(), follow(readings(4, 1500), 4)
    window = twin._history.window(400)
    carrier = Carrier(plant.model, plant.description)
    evidence = Evidence(
        plant.model, carrier, window, twin._posterior, Accuracy(plant.twin.errors, plant.twin.gain_error)
    )
    prior = Prior(plant.description.faults, window, evidence.variables, {})
    old, typical = FaultState("level_bias", 2.6, 500.0), FaultState("level_bias", 1.0, 500.0)
    told = Search(evidence, carrier.modes, prior, (old,), sizes((old,), (), window.start_s, carrier.modes, WRONG))
    untold = Search(evidence, carrier.modes, prior, (old,))
    assert told.cost_of((old,)) == prior.of_mode(carrier.modes["level_bias"]) > told.cost_of((typical,))
    assert untold.cost_of((old,)) < untold.cost_of((typical,))
    assert {f.onset_s for each in told.variations((old,)) for f in each.faults} == {500.0}
    assert len({f.severity for each in told.variations((old,)) for f in each.faults}) > 1


def test_what_was_left_open_is_remembered_with_the_error_of_the_model() -> None:
    said = [Hypothesis((FaultState("level_bias", size, 100.0),), p) for size, p in ((2.0, 0.6), (1.8, 0.2), (2.2, 0.2))]
    (exact,), (wrong,) = (sizes((), said, 500.0, MODES, error).values() for error in (EXACT, WRONG))
    assert exact.likeliest == wrong.likeliest == 2.0
    assert exact.sd == pytest.approx((0.4 * 0.2**2) ** 0.5)
    error = WRONG.of(2.0, MODES["level_bias"].severity_nominal)
    assert error >= 0.1 and wrong.sd == pytest.approx((error**2 + exact.sd**2) ** 0.5)


def test_what_began_in_the_readings_and_what_nobody_names_are_not_remembered() -> None:
    other = Hypothesis((FaultState(SOMETHING_ELSE, 1.0, 100.0),), 0.4)
    young = Hypothesis((FaultState("level_bias", 2.0, 700.0),), 0.6)
    assert sizes(young.faults, [young, other], 500.0, MODES, WRONG) == {}


def test_an_unknown_disturbance_may_be_of_any_size_now() -> None:
    name = next(mode.name for mode in MODES.values() if mode.unknown)
    (had,) = sizes((FaultState(name, 3.0, 100.0),), (), 500.0, MODES, WRONG).values()
    assert had.sd == MODES[name].severity_nominal


@given(st.floats(0.1, 3.0), st.floats(-10.0, 10.0))
def test_a_size_costs_nothing_where_it_was_and_no_size_is_impossible(had: float, away: float) -> None:
    (size,) = sizes((FaultState("level_bias", had, 100.0),), (), 500.0, MODES, EXACT).values()
    assert size.sd >= LEAST_SHARE * MODES["level_bias"].severity_range.span
    assert size.nats(had) == 0.0 <= size.nats(had + away) < 20.0
