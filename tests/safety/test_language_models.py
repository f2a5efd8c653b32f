"""Real models that know nothing, and servers that mean harm: whoever proposes, only what is safe is released."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from benchmarks.language_runs import reactor, run_with
from homeostat.domain.events.recovery import Attempted, FallbackArmed
from homeostat.domain.events.trips import FallbackActivated
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.journal.calls import ModelCalled
from homeostat.journal.encode import canonical, encode
from homeostat.links.clock import ThinkingClock
from homeostat.llm.address import SERVER_KEY, parse_address
from homeostat.llm.network import AddressPolicy
from homeostat.llm.providers import ProviderModel, Sampling
from homeostat.llm.retry import RetryingModel
from homeostat.plants.wired.assembly import Language
from homeostat.recovery.bounds import Budget
from tests.llm.servers import hostile, random_model

ONSET_S = 900.0
KEY = "sk-proj-0123456789abcdef"


@pytest.fixture(scope="module")
def knows_nothing() -> Iterator[str]:
    with random_model(7) as url:
        yield url


@pytest.fixture(scope="module")
def means_harm() -> Iterator[str]:
    with hostile() as url:
        yield url


def asked_at(url: str, name: str) -> RetryingModel:
    return RetryingModel(ProviderModel(parse_address(f"{url}#{name}"), AddressPolicy(local_only=True), Sampling(1.0)))


RUNS = (("cool_stuck_closed", 1), ("pump_degrade", 2), ("outlet_block", 3), ("inlet_stuck_open", 4), ("level_bias", 5))
HARMFUL = ("upper_edge", "nan", "dropped")
"""Servers: what is admissible and extreme, no number, and no answer."""
HARMFUL_ALIKE = ("contradictory", "huge", "extreme", "echo", "refusal", "unicode_tricks")


@pytest.mark.parametrize("runs", [RUNS[:2], pytest.param(RUNS, marks=pytest.mark.wide)], ids=len)
def test_random_weights_release_nothing_unsafe(knows_nothing: str, runs: tuple[tuple[str, int], ...]) -> None:
    """A few of the 200 runs that the results page has; it is asked where the search leaves something to win."""
    tried, asked = 0, 0
    for fault, seed in runs:
        row, trace = run_with(asked_at(knows_nothing, "random"), fault, seed, onset_s=ONSET_S, end_s=1100.0)
        assert row.unsafe == "" and row.first != "none", row
        calls = trace.of(ModelCalled)
        assert {c.served for c in calls} <= {"random-weights"} and not any(c.failure for c in calls)
        asked += bool(calls)
        tried += sum(a.proposer == "language" and a.members > 0 for a in trace.of(Attempted))
    assert asked >= len(runs) // 2 and tried > 0, "its nonsense was admissible, and was tried on the twin"


@pytest.mark.parametrize("name", [*HARMFUL, *(pytest.param(name, marks=pytest.mark.wide) for name in HARMFUL_ALIKE)])
def test_a_server_that_means_harm_releases_nothing_unsafe(means_harm: str, name: str) -> None:
    row, trace = run_with(asked_at(means_harm, name), "cool_stuck_closed", 1, onset_s=ONSET_S, end_s=1050.0)
    assert row.unsafe == "" and row.outside_s == 0.0
    assert trace.of(ModelCalled)
    # The upper edge of every range is admissible; where everything that is left is to hold, it may be approved.
    assert row.first == "search" or (name == "upper_edge" and row.first == "language")


@pytest.mark.parametrize("name", ["key_echo", pytest.param("unauthorised", marks=pytest.mark.wide)])
def test_a_key_that_a_server_repeats_is_in_no_event(
    means_harm: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SERVER_KEY, KEY)
    row, trace = run_with(asked_at(means_harm, name), "cool_stuck_closed", 1, onset_s=ONSET_S, end_s=1050.0)
    assert row.calls > 0 and row.first == "search"
    told = [canonical(encode(entry.event)) for entry in trace.entries]
    assert not any(KEY[:12] in line for line in told)
    assert any("[key]" in line for line in told), "it was there, and was struck out"


@pytest.mark.parametrize("name", ["slow_drip", pytest.param("hang", marks=pytest.mark.wide)])
def test_a_server_that_takes_its_time_costs_no_more_than_it_may(means_harm: str, name: str) -> None:
    row, _ = run_with(
        asked_at(means_harm, name), "cool_stuck_closed", 1, onset_s=ONSET_S, end_s=1050.0, clock=ThinkingClock(),
        budget=Budget(latency_s=16.0),
    )  # fmt: skip
    assert row.first == "search" and row.unsafe == "" and row.failures.get("TIMEOUT", 0) >= 1


@pytest.mark.parametrize("name", [pytest.param("hang", marks=pytest.mark.wide), "slow_drip"])
def test_the_fallback_acts_when_the_time_is_used_up(means_harm: str, name: str) -> None:
    """The search is not there, so nobody else acts, and nobody may wait.

    How late it is on a quiet machine is in the results. Time is that of this machine, which does other things as well.
    """
    made, trace = reactor(), MemoryTrace()
    plant = replace(made, intervention=replace(made.intervention, waits=0))
    alone = Proposing(
        Language(asked_at(means_harm, name)), propose=lambda bench: (bench.speaking(),), budget=Budget(latency_s=2.0)
    )
    run(plant, scenario(plant, "cool_stuck_closed", 1, ONSET_S, None, 1050.0), trace, ThinkingClock(), alone)
    armed = next(entry for entry in trace.entries if isinstance(entry.event, FallbackArmed))
    fell = next(entry for entry in trace.entries if isinstance(entry.event, FallbackActivated))
    assert isinstance(armed.event, FallbackArmed)
    assert 0.0 <= fell.at_s - armed.at_s - armed.event.deadline_s <= 25.0
