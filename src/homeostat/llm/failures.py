"""From the exceptions of the provider library to typed failures."""

from __future__ import annotations

import asyncio

from pydantic_ai import exceptions as library

from homeostat.llm.model import STRUCK_OUT, Failure, ModelError

_KINDS: tuple[tuple[type[Exception], Failure], ...] = (
    (library.ModelRequestTimeout, Failure.TIMEOUT),
    (library.ModelTimeoutError, Failure.TIMEOUT),
    (library.ModelRateLimitError, Failure.RATE_LIMITED),
    (library.ModelQuotaExceededError, Failure.UNAUTHORISED),
    (library.ModelAuthenticationError, Failure.UNAUTHORISED),
    (library.ModelUnavailableError, Failure.SERVER_ERROR),
    (library.ModelServerError, Failure.SERVER_ERROR),
    (library.ModelConnectionError, Failure.UNREACHABLE),
    (library.ModelRequestRejectedError, Failure.REJECTED),
    (library.ContentFilterError, Failure.REFUSAL),
    (library.OutputTokenLimitExceeded, Failure.TRUNCATED),
    (library.UnexpectedModelBehavior, Failure.MALFORMED),
    (asyncio.TimeoutError, Failure.TIMEOUT),
)
"""The first that fits counts, so a special case stands before the general one."""


def failure_of(error: Exception, secret: str) -> ModelError:
    """The failure that ``error`` stands for, ``secret`` struck out; what no rule knows could not be read."""
    cause: BaseException | None = error
    while cause is not None:  # client libraries wrap what the transport raised
        if isinstance(cause, ModelError):
            return cause
        cause = cause.__cause__
    detail = _one_line(error, secret)
    wait_s = error.retry_after if isinstance(error, library.ModelAPIError) else None
    for kind, failure in _KINDS:
        if isinstance(error, kind):
            return ModelError(failure, detail, wait_s)
    if isinstance(error, library.ModelHTTPError):
        known = Failure.SERVER_ERROR if error.status_code >= 500 else Failure.REJECTED
        return ModelError(known, detail, wait_s)
    return ModelError(Failure.MALFORMED, detail)


def _one_line(error: Exception, secret: str, most: int = 200) -> str:
    # Servers repeat keys in their errors; half a key, cut off at the end, could not be recognised any more.
    text = " ".join(f"{type(error).__name__}: {error}".split())
    text = text.replace(secret, STRUCK_OUT) if secret else text
    return text if len(text) <= most else f"{text[: most - 1]}…"
