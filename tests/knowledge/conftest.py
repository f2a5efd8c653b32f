from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.knowledge.servers import oxigraph_server


@pytest.fixture(scope="session")
def oxigraph() -> Iterator[str]:
    """Address of a running Oxigraph server, one per test session; a test that uses it clears it first."""
    with oxigraph_server() as address:
        yield address
