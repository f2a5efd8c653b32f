"""One HTTP exchange, bounded in time and size, that never leaves the host it was meant for."""

import asyncio
import ssl
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

import httpx2

from homeostat.knowledge.store.store import StoreUnavailable

_MOST_REDIRECTS: Final = 3


@dataclass(frozen=True, slots=True)
class Reply:
    """What came back."""

    status: int
    """HTTP status code."""
    media_type: str
    """Media type without parameters, in lower case."""
    body: bytes
    """The body as sent, at most as long as asked for."""


@dataclass(frozen=True, slots=True)
class Transport:
    """How requests are sent. Each opens its own connection, so one object serves many threads; proxies are not used."""

    timeout_s: float = 30.0
    """Longest time from the start of a request to the last byte of its reply, in seconds."""
    max_bytes: int = 256 * 1024 * 1024
    """Longest reply that is read, in bytes."""

    def send(self, method: str, url: str, headers: Mapping[str, str], body: bytes | None = None) -> Reply:
        """Send a request and read the reply, whatever its status; redirects on the same host are followed.

        Raises StoreUnavailable where no complete reply came in time, it was too long, or it pointed to another host.
        """
        # What is packed has no limit that could be seen beforehand, so nothing packed is asked for or unpacked.
        request = httpx2.Request(method, url, headers={**headers, "Accept-Encoding": "identity"}, content=body)
        # Only an event loop can end a wait by the clock: a blocking read has all its time again with every byte that
        # drips in. It gets a thread of its own, because whoever asks may be in a loop already.
        try:
            with ThreadPoolExecutor(1) as aside:
                return aside.submit(asyncio.run, self._follow(request)).result()
        except TimeoutError as error:
            raise StoreUnavailable(
                f"store at {plain(url)} did not answer within {self.timeout_s:g} s; "
                "check that the server runs, or raise timeout_s if it is only slow"
            ) from error
        except (httpx2.HTTPError, httpx2.InvalidURL, OSError) as error:
            raise StoreUnavailable(
                f"store at {plain(url)} cannot be reached: {error or type(error).__name__}; "
                "check that the server runs and that the address is right"
            ) from error

    async def _follow(self, request: httpx2.Request) -> Reply:
        verify = ssl.create_default_context() if request.url.scheme == "https" else False
        async with (
            asyncio.timeout(self.timeout_s),
            httpx2.AsyncClient(timeout=None, trust_env=False, verify=verify) as client,
        ):
            for _ in range(_MOST_REDIRECTS + 1):
                response = await client.send(request, stream=True)
                moved = response.next_request
                if moved is None:
                    return await self._read(response)
                await response.aclose()
                if _origin(moved.url) != _origin(request.url) or moved.method != request.method:
                    raise StoreUnavailable(
                        f"store at {plain(str(request.url))} redirects a {request.method} to {plain(str(moved.url))} "
                        f"(status {response.status_code}), which is not followed; "
                        "configure that address if it is the right one"
                    )
                request = moved
        where = plain(str(request.url))
        raise StoreUnavailable(f"store at {where} redirects more than {_MOST_REDIRECTS} times; check its address")

    async def _read(self, response: httpx2.Response) -> Reply:
        content = bytearray()
        async for chunk in response.aiter_raw():
            content += chunk
            if len(content) > self.max_bytes:
                where = plain(str(response.url))
                raise StoreUnavailable(
                    f"store at {where} sent more than {self.max_bytes} bytes; ask for less or raise max_bytes"
                )
        media_type = response.headers.get("Content-Type", "").split(";")[0].strip().lower()
        return Reply(response.status_code, media_type, bytes(content))


def plain(url: str) -> str:
    """An address fit for messages: without query."""
    return urlsplit(url)._replace(query="", fragment="").geturl()


def _origin(url: httpx2.URL) -> tuple[str, str, int | None]:
    return url.scheme, url.host, url.port
