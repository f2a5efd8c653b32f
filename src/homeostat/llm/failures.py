"""From the exceptions of the provider library to typed failures."""

from __future__ import annotations

import asyncio
import re
from typing import Final

from pydantic_ai import exceptions as library

from homeostat.llm.model import Failure, ModelError
from homeostat.llm.secrets import Secrets

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
_WAY: Final = re.compile(
    r"response_?format|json.?(object|mode)|schema|structured|guided|grammar|output_(format|config)|tool|functions?\b",
    re.IGNORECASE,
)
"""What a server says where it does not know a way of asking for JSON."""
_OTHERWISE: Final = (
    *(library.ModelContextWindowExceededError, library.ModelNotFoundError, library.ModelAuthenticationError),
    *(library.ModelQuotaExceededError, library.ModelRateLimitError, library.ModelUnavailableError),
)
"""What no other way of asking for JSON would cure, whatever words it is said in."""


class WayRejected(ModelError):
    """The server rejects the way in which JSON was asked for; another way may do."""


def failure_of(error: Exception, secret: str) -> ModelError:
    """The failure that ``error`` stands for, ``secret`` struck out; what no rule knows could not be read."""
    cause: BaseException | None = error
    while cause is not None:  # client libraries wrap what the transport raised
        if isinstance(cause, ModelError):
            return cause
        cause = cause.__cause__
    detail = _one_line(error, secret)
    wait_s = error.retry_after if isinstance(error, library.ModelAPIError) else None
    if _is_about_the_way(error):
        return WayRejected(Failure.REJECTED, detail, wait_s)
    for kind, failure in _KINDS:
        if isinstance(error, kind):
            return ModelError(failure, detail, wait_s)
    if isinstance(error, library.ModelHTTPError):
        known = Failure.SERVER_ERROR if error.status_code >= 500 else Failure.REJECTED
        return ModelError(known, detail, wait_s)
    return ModelError(Failure.MALFORMED, detail)


def _is_about_the_way(error: Exception) -> bool:
    """Whether a server says, by status and in words, that it does not know how it was asked for JSON."""
    if isinstance(error, _OTHERWISE) or not isinstance(error, library.ModelHTTPError):
        return False
    return error.status_code in (400, 422) and _WAY.search(str(error.body)) is not None


def _one_line(error: Exception, secret: str) -> str:
    """The whole error. It is not cut here: half a key could not be recognised by those who know the other keys."""
    return Secrets([secret]).strike(" ".join(f"{type(error).__name__}: {error}".split()))
