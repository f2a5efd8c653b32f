"""Retry: asked again only where that may help, later each time, and never beyond the time that there is."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from homeostat.llm import retry
from homeostat.llm.model import REPEATABLE, Failure, ModelError
from homeostat.llm.retry import FIRST_PAUSE_S, MOST_REQUESTS, WORTHWHILE_S, RetryingModel
from tests.llm.asking import ANSWER, Outcome, Says, ask, asked
from tests.llm.virtual_time import VirtualTime

LIMITED = ModelError(Failure.RATE_LIMITED)
DOWN = ModelError(Failure.SERVER_ERROR)
SHORT_S = 1e-6
"""Rounding of the loop's clock, and no more: time is virtual here [s]."""


@pytest.fixture(autouse=True)
def virtual(monkeypatch: pytest.MonkeyPatch) -> Iterator[VirtualTime]:
    """The time in which models are asked here."""
    time = VirtualTime()
    monkeypatch.setattr(retry, "time", time)
    monkeypatch.setattr(asyncio, "run", time.run)
    yield time


def gaps(model: Says) -> list[float]:
    """Seconds between the requests."""
    return [b.at_s - a.at_s for a, b in zip(model.calls, model.calls[1:], strict=False)]


def test_an_answer_is_handed_on() -> None:
    model = Says(ANSWER)
    assert ask(RetryingModel(model)).reply == ANSWER
    assert len(model.calls) == 1 and model.calls[0].within_s == 5.0


def test_it_answers_to_the_other_model_s_name() -> None:
    model = Says(ANSWER)
    assert RetryingModel(model).name == model.name and RetryingModel(model).settings == model.settings


@pytest.mark.parametrize("failure", sorted(set(Failure) - REPEATABLE))
def test_what_another_request_cannot_cure_is_not_asked_again(failure: Failure) -> None:
    model = Says(ModelError(failure), ANSWER)
    outcome = ask(RetryingModel(model))
    assert outcome.failure is failure and len(model.calls) == 1 and outcome.took_s == 0.0
    assert outcome.error is not None and outcome.error.requests == 1


@pytest.mark.parametrize("failure", sorted(REPEATABLE))
def test_what_may_be_gone_a_moment_later_is_asked_again(failure: Failure) -> None:
    model = Says(ModelError(failure), ModelError(failure), ANSWER)
    outcome = ask(RetryingModel(model))
    assert outcome.reply is not None and outcome.reply.requests == 3
    assert gaps(model) == pytest.approx([FIRST_PAUSE_S, 2 * FIRST_PAUSE_S], abs=SHORT_S), "the pauses grow"


def test_there_is_an_end_to_asking_again() -> None:
    model = Says(DOWN)
    outcome = ask(RetryingModel(model), within_s=60.0)
    assert outcome.failure is Failure.SERVER_ERROR and len(model.calls) == MOST_REQUESTS
    assert outcome.error is not None and outcome.error.requests == MOST_REQUESTS


def test_requests_that_the_other_model_repeated_itself_count() -> None:
    outcome = ask(RetryingModel(model := Says(ModelError(Failure.UNREACHABLE, requests=3), ANSWER)))
    assert outcome.reply is not None and outcome.reply.requests == 4 and len(model.calls) == 2
    outcome = ask(RetryingModel(model := Says(ModelError(Failure.UNREACHABLE, requests=MOST_REQUESTS), ANSWER)))
    assert outcome.error is not None and outcome.error.requests == MOST_REQUESTS and len(model.calls) == 1


def test_the_time_that_the_server_asks_for_is_waited() -> None:
    model = Says(ModelError(Failure.RATE_LIMITED, retry_after_s=0.7), ANSWER)
    assert ask(RetryingModel(model)).reply is not None
    assert gaps(model) == pytest.approx([0.7], abs=SHORT_S)


@pytest.mark.parametrize("wait_s", [4.6, 3600.0, math.inf])
def test_a_server_that_asks_for_too_much_time_is_given_up_at_once(wait_s: float) -> None:
    model = Says(ModelError(Failure.RATE_LIMITED, retry_after_s=wait_s), ANSWER)
    outcome = ask(RetryingModel(model), within_s=5.0)
    assert outcome.failure is Failure.RATE_LIMITED and outcome.took_s == 0.0 and len(model.calls) == 1


@pytest.mark.parametrize("wait_s", [-3600.0, 0.0, math.nan, -math.inf])
def test_a_senseless_wish_is_no_wish(wait_s: float) -> None:
    model = Says(ModelError(Failure.RATE_LIMITED, retry_after_s=wait_s), ANSWER)
    assert ask(RetryingModel(model)).reply is not None
    assert gaps(model) == pytest.approx([FIRST_PAUSE_S], abs=SHORT_S)


@pytest.mark.parametrize("within_s", [0.0, -1.0, 0.05, 0.6])
def test_a_model_that_hangs_is_cut_off_in_time(within_s: float) -> None:
    outcome = ask(RetryingModel(Says(ANSWER, delay_s=math.inf)), within_s)
    assert outcome.failure is Failure.TIMEOUT and outcome.took_s == pytest.approx(max(within_s, 0.0), abs=SHORT_S)
    assert outcome.error is not None and outcome.error.requests == 1


def test_a_timeout_of_the_other_model_s_own_is_one_as_well() -> None:
    outcome = ask(RetryingModel(Says(TimeoutError("socket"))))
    assert outcome.failure is Failure.TIMEOUT and outcome.took_s == 0.0


def test_a_hang_after_a_failure_counts_both_requests() -> None:
    class Worsens(Says):
        async def ask(self, question, within_s):  # type: ignore[no-untyped-def]
            self._delay_s = math.inf if self.calls else 0.0
            return await super().ask(question, within_s)

    model = Worsens(DOWN, ANSWER)
    outcome = ask(RetryingModel(model), within_s=1.0)
    assert outcome.failure is Failure.TIMEOUT and outcome.took_s == pytest.approx(1.0, abs=SHORT_S)
    assert outcome.error is not None and outcome.error.requests == 2
    left_s = 1.0 - FIRST_PAUSE_S
    assert model.calls[1].within_s == pytest.approx(left_s, abs=SHORT_S), "only what is left is given on"


def test_being_called_off_is_not_taken_for_a_failure(virtual: VirtualTime) -> None:
    async def call_off() -> float:
        task = asyncio.create_task(asked(RetryingModel(Says(ANSWER, delay_s=math.inf)), 60.0))
        await asyncio.sleep(0.05)
        begin = virtual.now_s
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        return virtual.now_s - begin

    assert asyncio.run(call_off()) == 0.0


def test_being_called_off_during_a_pause_is_not_either() -> None:
    async def call_off() -> None:
        task = asyncio.create_task(asked(RetryingModel(Says(DOWN)), 60.0))
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(call_off())


# --- whatever the model does ------------------------------------------------------------------------------------

WAITS = st.none() | st.floats(-1.0, 2.0) | st.just(math.inf) | st.just(math.nan)
FAILURES = st.builds(
    lambda failure, wait, requests: ModelError(failure, "", wait, requests),
    st.sampled_from(Failure), WAITS, st.integers(0, 5),
)  # fmt: skip
SCRIPTS = st.builds(
    lambda outcomes, delay_s: Says(*outcomes, delay_s=delay_s),
    st.lists(FAILURES | st.just(ANSWER) | st.just(TimeoutError()), min_size=1, max_size=6),
    st.sampled_from([0.0, 0.1, 0.4, math.inf]),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(st.lists(st.tuples(SCRIPTS, st.sampled_from([0.05, 0.3, 0.8, 1.1])), min_size=1, max_size=40))
def test_whatever_the_model_does_there_is_an_outcome_in_time(scripts: list[tuple[Says, float]]) -> None:
    async def all_at_once() -> list[Outcome]:
        return await asyncio.gather(*(asked(RetryingModel(m), within_s) for m, within_s in scripts))

    for (model, within_s), outcome in zip(scripts, asyncio.run(all_at_once()), strict=True):
        assert outcome.took_s <= within_s + SHORT_S
        assert 1 <= len(model.calls) <= MOST_REQUESTS + 1
        assert all(c.within_s <= within_s + SHORT_S for c in model.calls)
        started_s = model.calls[0].at_s
        assert all(c.at_s - started_s + WORTHWHILE_S <= within_s + SHORT_S for c in model.calls[1:]), (
            "what is pointless"
        )
