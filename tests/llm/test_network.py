"""Which addresses may be reached: whatever an address looks like, with `local_only` nothing leaves this machine."""

from __future__ import annotations

import asyncio
import ipaddress
from typing import Any

import httpx2
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.llm.model import Failure, ModelError
from homeostat.llm.network import MOST_BYTES, MOST_OF_ERROR, AddressPolicy, GuardedTransport, on_this_machine
from tests.llm.replying import replying

LOCAL, ANYWHERE = AddressPolicy(local_only=True), AddressPolicy()


def refused(policy: AddressPolicy, url: str) -> bool:
    """Whether ``policy`` refuses ``url``; a refusal is one line, and nothing else is ever raised."""
    try:
        policy.check(url)
    except ModelError as error:
        assert error.failure is Failure.FORBIDDEN and "\n" not in str(error)
        return True
    return False


@pytest.mark.parametrize(
    "host",
    ["localhost", "LOCALHOST", "LocalHost.", "localhost:11434", "127.0.0.1", "127.0.0.1:8000", "127.0.0.2",
     "127.255.255.254", "[::1]", "[::1]:8000", "[0:0:0:0:0:0:0:1]", "[0000::0001]", "user:password@127.0.0.1:8000",
     "evil.example@127.0.0.1"],
)  # fmt: skip
def test_this_machine_may_be_reached(host: str) -> None:
    for scheme in ("http", "https", "HTTP"):
        assert not refused(LOCAL, f"{scheme}://{host}/v1")


FOREIGN = [
    "api.openai.com", "8.8.8.8", "10.0.0.1", "172.16.0.1", "192.168.1.1", "169.254.169.254", "100.64.0.1", "0.0.0.0",
    "128.0.0.1", "126.255.255.255", "[::]", "[::2]", "[fe80::1]", "[fc00::1]", "[2001:db8::1]", "[::ffff:8.8.8.8]",
    "[::ffff:192.168.0.1]",
    # names that only look like this machine
    "127.0.0.1.example.com", "localhost.example.com", "localhost.localdomain", "foo.localhost", "localhosts",
    "127.0.0.1.nip.io", "loopback", "ip6-localhost", "127.0.0.1x", "1.127.0.0.1",
    # somebody else behind a user name
    "localhost@evil.com", "127.0.0.1@evil.com", "127.0.0.1:80@evil.com", "localhost:80@evil.com:80", "@evil.com",
    "a@localhost@evil.com", "127.0.0.1%40evil.com", "127.0.0.1%2eevil.com",
    # numbers that a resolver, but no reader, takes for an address
    "2130706433", "0x7f000001", "0x7f.0.0.1", "0177.0.0.1", "127.1", "127.0.1", "127.000.000.001", "017700000001",
    "localhost%00.evil.com", "localhost\\@evil.com", "127.0.0.1\\.evil.com",
]  # fmt: skip


@pytest.mark.parametrize("host", FOREIGN)
def test_everything_else_may_not(host: str) -> None:
    assert refused(LOCAL, f"http://{host}/v1")
    assert refused(LOCAL, f"https://{host}/v1")


@pytest.mark.parametrize(
    "url",
    ["http://evil.com/127.0.0.1", "http://evil.com/@localhost", "http://evil.com#@localhost", "http://evil.com?@::1",
     "http://evil.com:80/v1#localhost", "http://evil.com;localhost/", "http://evil.com\\@localhost"],
)  # fmt: skip
def test_a_path_is_not_a_host(url: str) -> None:
    policy_says = refused(LOCAL, url)
    assert policy_says or httpx2.URL(url).host in ("localhost", "127.0.0.1"), "it is what would be reached"


@pytest.mark.parametrize(
    "url",
    ["", "/v1", "localhost", "localhost:8000/v1", "ftp://localhost/v1", "file:///etc/passwd", "unix:///var/run/llm.sock",
     "ws://localhost/v1", "javascript:alert(1)", "http://", "http:///v1", "http:localhost", "https://:8000/v1",
     "http+unix://localhost", "httpx://localhost"],
)  # fmt: skip
def test_only_http_and_https_with_a_host(url: str) -> None:
    for policy in (LOCAL, ANYWHERE, AddressPolicy(True, ("", "localhost"))):
        assert refused(policy, url)


@pytest.mark.parametrize("url", ["http://[::1", "http://[v1]/v1", "http://[localhost]/v1"])
def test_what_is_no_address_at_all_is_refused_as_well(url: str) -> None:
    assert refused(LOCAL, url)


def test_without_the_rule_any_host_may_be_reached() -> None:
    for host in ("api.openai.com", "192.168.1.1", "[2001:db8::1]"):
        assert not refused(ANYWHERE, f"https://{host}/v1")


ALLOWED = AddressPolicy(True, ("llm.plant.example", "192.168.1.7", "fd00::7"))


@pytest.mark.parametrize("host", ["llm.plant.example", "LLM.plant.EXAMPLE", "192.168.1.7", "[fd00::7]", "localhost"])
def test_a_host_that_was_named_may_be_reached(host: str) -> None:
    assert not refused(ALLOWED, f"http://{host}:8000/v1")


def test_a_host_may_be_named_in_capitals() -> None:
    assert not refused(AddressPolicy(True, ("LLM.Plant.example",)), "http://llm.plant.example/v1")


@pytest.mark.parametrize(
    "host",
    ["plant.example", "a.llm.plant.example", "llm.plant.example.com", "llm.plant.example@evil.com", "192.168.1.8",
     "192.168.1.70", "[fd00::8]", "xllm.plant.example"],
)  # fmt: skip
def test_its_neighbours_may_not(host: str) -> None:
    assert refused(ALLOWED, f"http://{host}/v1")


def test_the_refusal_says_what_to_do() -> None:
    with pytest.raises(ModelError, match=r"--allow-host llm\.plant\.example"):
        LOCAL.check("https://llm.plant.example:443/v1")


@given(st.ip_addresses(v=4))
def test_of_all_ipv4_addresses_only_127_8(address: ipaddress.IPv4Address) -> None:
    assert on_this_machine(str(address)) is (address.packed[0] == 127)
    assert refused(LOCAL, f"http://{address}/v1") is (address.packed[0] != 127)


@given(st.ip_addresses(v=6))
def test_of_all_ipv6_addresses_only_one(address: ipaddress.IPv6Address) -> None:
    if address.ipv4_mapped is None:
        assert refused(LOCAL, f"http://[{address}]/v1") is (int(address) != 1)


PIECES = st.sampled_from(
    ["localhost", "127.0.0.1", "[::1]", "evil.com", "@", ":", "/", "\\", "#", "?", ".", "%40", "%2e", "%00", "①②⑦",
     "。", "ⓛocalhost", "0x7f", "\t", "\n", " ", "user", "80", "[", "]", "%5c", ";", "&", "\u200b", "ß"]
)  # fmt: skip


@settings(max_examples=300)
@given(st.lists(PIECES, max_size=6).map("".join), st.sampled_from(["http://", "https://", "HTTP://", "http:/", ""]))
def test_what_the_policy_lets_through_is_what_the_client_reaches(rest: str, scheme: str) -> None:
    """Two readers of one address must not disagree about where it leads."""
    try:
        url = httpx2.URL(scheme + rest)
    except (httpx2.InvalidURL, ValueError):
        return
    for seen in (str(url), scheme + rest):
        try:
            LOCAL.check(seen)
        except (ModelError, ValueError):
            continue
        assert not url.host or on_this_machine(url.host), (seen, url.host)  # without a host it reaches nobody


# --- on the way -------------------------------------------------------------------------------------------------


def get(
    url: str, policy: AddressPolicy, follow: bool = False, headers: dict[str, str] | None = None,
    authorisation: dict[str, str] | None = None,
) -> Any:  # fmt: skip
    """What comes back through the guarded transport."""

    async def fetch() -> httpx2.Response:
        async with httpx2.AsyncClient(
            transport=GuardedTransport(policy, authorisation), follow_redirects=follow, trust_env=False, timeout=5.0
        ) as client:
            return await client.get(url, headers=headers)

    return asyncio.run(fetch())


def test_the_transport_asks_before_it_connects() -> None:
    with replying() as server:
        assert get(server.url, LOCAL).status_code == 200
    with pytest.raises(ModelError) as error:
        get("http://192.0.2.1:9/v1", LOCAL)
    assert error.value.failure is Failure.FORBIDDEN


def test_a_redirection_does_not_get_around_it() -> None:
    with replying(307, headers={"Location": "http://example.com/v1"}) as server:
        for follow in (False, True):
            with pytest.raises(ModelError, match=r"redirects the request \(307\).*not followed") as error:
                get(server.url, LOCAL, follow=follow)
            assert error.value.failure is Failure.FORBIDDEN
        assert len(server.received) == 2, "whatever the client is told"


@pytest.mark.parametrize("packing", ["gzip", "GZIP", "deflate", "br", "zstd", "gzip, identity"])
def test_nothing_packed_is_unpacked(packing: str) -> None:
    with replying(body=b"x", headers={"Content-Encoding": packing}) as server:
        with pytest.raises(ModelError) as error:
            get(server.url, LOCAL)
        assert error.value.failure is Failure.MALFORMED
        assert server.received[0]["accept-encoding"] == "identity"


@pytest.mark.parametrize(("size", "fits"), [(MOST_BYTES, True), (MOST_BYTES + 1, False)])
def test_nothing_too_long_is_read(size: int, fits: bool) -> None:
    with replying(body=b"x" * size) as server:
        if fits:
            assert len(get(server.url, LOCAL).content) == size
        else:
            with pytest.raises(ModelError) as error:
                get(server.url, LOCAL)
            assert error.value.failure is Failure.MALFORMED


def test_nothing_is_told_about_this_machine() -> None:
    telling = {"X-Stainless-OS": "Linux", "x-stainless-arch": "arm64", "OpenAI-Organization": "org-1",
               "User-Agent": "python 3", "Authorization": "Bearer other", "Cookie": "a=b", "X-Token": "t"}  # fmt: skip
    with replying() as server:
        get(server.url, LOCAL, headers=telling, authorisation={"Authorization": "Bearer own"})
    (received,) = server.received
    assert received["user-agent"] == "homeostat" and received["authorization"] == "Bearer own"
    assert set(received) <= {"host", "accept", "accept-encoding", "connection", "user-agent", "authorization"}


@pytest.mark.parametrize("status", [400, 429, 503])
def test_of_an_error_the_beginning_is_read_and_its_status_is_told(status: int) -> None:
    with replying(status, body=b"x" * (MOST_BYTES + 1)) as server:
        reply = get(server.url, LOCAL)
    assert (reply.status_code, len(reply.content)) == (status, MOST_OF_ERROR)
    with replying(status, body=b"not now") as server:
        assert get(server.url, LOCAL).content == b"not now"
