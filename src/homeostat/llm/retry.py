"""Retry: a failed request is repeated with growing pauses, never beyond the time that there is."""

import asyncio
import time
from collections.abc import Mapping

from homeostat.llm.model import REPEATABLE, Failure, LanguageModel, ModelError, Question, Reply

FIRST_PAUSE_S = 0.25
"""Pause before the first repetition [s]; each further one is twice as long."""
MOST_REQUESTS = 4
"""Requests per question."""
WORTHWHILE_S = 0.5
"""An answer is not expected in less than this [s]."""


class RetryingModel:
    """Implements :class:`homeostat.llm.model.LanguageModel`: asks another one again where that may help."""

    def __init__(self, model: LanguageModel) -> None:
        """``model`` is asked."""
        self._model = model
        self.name = model.name
        """The other model's."""

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """The other model's."""
        return self._model.settings

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The first answer; ModelError where none came, with the number of requests that were sent."""
        end = time.monotonic() + within_s
        pause_s, requests = FIRST_PAUSE_S, 0
        while True:
            left_s = end - time.monotonic()
            try:
                async with asyncio.timeout(left_s):  # whatever the model does, this returns in time
                    reply = await self._model.ask(question, left_s)
                return Reply(reply.answer, reply.served, reply.usage, requests + reply.requests)
            except TimeoutError:
                raise ModelError(Failure.TIMEOUT, f"{within_s:.1f} s", requests=requests + 1) from None
            except ModelError as error:
                requests += error.requests
                wait_s = max(pause_s, error.retry_after_s or 0.0)
                late = time.monotonic() + wait_s + WORTHWHILE_S > end
                if error.failure not in REPEATABLE or requests >= MOST_REQUESTS or late:
                    error.requests = requests
                    raise
            await asyncio.sleep(wait_s)
            pause_s *= 2.0
