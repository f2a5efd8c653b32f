"""The way to a model server: which addresses may be reached, and how much may come back."""

import ipaddress
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

import httpx2

from homeostat.llm.model import Failure, ModelError

NEEDED = frozenset(
    {"host", "accept", "connection", "content-type", "content-length", "transfer-encoding"}
    | {"anthropic-version", "anthropic-beta"}
)
"""Headers that are sent to anybody."""
ACCOUNT = frozenset({"openai-organization", "openai-project"})
"""Headers that are sent to OpenAI only."""
MOST_BYTES = 1_000_000
"""Longest response that is read [bytes]; an answer has a few hundred."""
MOST_OF_ERROR = 20_000
"""How much of an error is read [bytes]; people are shown a line of it, and looking for keys in more takes seconds."""


@dataclass(frozen=True, slots=True)
class AddressPolicy:
    """Which hosts may be reached."""

    local_only: bool = False
    """Whether everything outside this machine is refused."""
    allowed: tuple[str, ...] = ()
    """Host names or addresses that may be reached all the same."""

    def check(self, url: str) -> None:
        """ModelError where ``url`` must not be reached."""
        host = _host(url)
        if not host:
            raise ModelError(Failure.FORBIDDEN, f"{url!r} is not an http or https address")
        allowed = {name.lower() for name in self.allowed}
        if self.local_only and host not in allowed and not on_this_machine(host):
            raise ModelError(
                Failure.FORBIDDEN,
                f"{host!r} is outside this machine, and only local models are allowed; or give --allow-host {host}",
            )


def _host(url: str) -> str:
    """The host of an http or https address in lower case; empty where ``url`` is none."""
    try:
        parts = urlsplit(url)
    except ValueError:  # brackets around what is no address
        return ""
    return (parts.hostname or "") if parts.scheme in ("http", "https") else ""


def on_this_machine(host: str) -> bool:
    """Whether ``host`` is a loopback address or the name that is reserved for one (RFC 6761).

    No other name is looked up: what a name server says may change between the question and the connection.
    """
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower().rstrip(".") == "localhost"


class GuardedTransport(httpx2.AsyncBaseTransport):
    """Sends requests to allowed addresses only, follows nowhere, and stops reading what is too long or packed."""

    def __init__(self, policy: AddressPolicy, authorisation: Mapping[str, str] | None = None) -> None:
        """``policy`` is asked before every request, so a redirection cannot get around it.

        ``authorisation``: header -> value; what client libraries find in the environment is never sent in its place.
        """
        self._policy = policy
        self._authorisation = dict(authorisation or {})
        self._wire = httpx2.AsyncHTTPTransport(retries=0)

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send ``request``; ModelError where its address is not allowed, or the response is packed or a redirection."""
        self._policy.check(str(request.url))
        _hush(request)
        request.headers.update(self._authorisation)
        # What is unpacked has no limit that could be seen beforehand, so nothing packed is asked for or accepted.
        request.headers["Accept-Encoding"] = "identity"
        response = await self._wire.handle_async_request(request)
        if response.has_redirect_location:
            await response.aclose()
            raise ModelError(
                Failure.FORBIDDEN,
                f"the server redirects the request ({response.status_code}), and redirections are not followed; "
                "name the address that it leads to",
            )
        if response.headers.get("Content-Encoding", "identity").lower() != "identity":
            await response.aclose()
            raise ModelError(Failure.MALFORMED, "the response is packed though that was ruled out")
        assert isinstance(response.stream, httpx2.AsyncByteStream)
        response.stream = _Begun(response.stream) if response.is_error else _Bounded(response.stream)
        return response

    async def aclose(self) -> None:
        """Close the connections."""
        await self._wire.aclose()


def _hush(request: httpx2.Request) -> None:
    """Take away every header that an answer does not need.

    Client libraries tell about this machine, tell everybody about an account at OpenAI, and add whatever headers they
    find in the environment, which may be the secrets of another service.
    """
    home = request.url.host == "openai.com" or request.url.host.endswith(".openai.com")
    allowed = NEEDED | ACCOUNT if home else NEEDED
    for name in list(request.headers):
        if name.lower() not in allowed:
            del request.headers[name]
    request.headers["User-Agent"] = "homeostat"


class _Bounded(httpx2.AsyncByteStream):
    """A response body that ends with an error where it is too long."""

    def __init__(self, stream: httpx2.AsyncByteStream) -> None:
        self._stream = stream

    async def __aiter__(self) -> AsyncIterator[bytes]:
        count = 0
        async for chunk in self._stream:
            count += len(chunk)
            if count > MOST_BYTES:
                raise ModelError(Failure.MALFORMED, f"the response is longer than {MOST_BYTES} bytes")
            yield chunk

    async def aclose(self) -> None:
        await self._stream.aclose()


class _Begun(_Bounded):
    """The beginning of a response body: an error is told by its status, however much a proxy has to say about it."""

    async def __aiter__(self) -> AsyncIterator[bytes]:
        left = MOST_OF_ERROR
        async for chunk in self._stream:
            yield chunk[:left]
            left -= len(chunk)
            if left <= 0:
                return
