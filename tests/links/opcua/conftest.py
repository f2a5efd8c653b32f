from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.links.opcua.security.certificate import Pki
from tests.equipment.opcua.served import Served, make_pkis

HEARTBEAT_S = 20.0
"""How long the shared tank waits for a heartbeat, process time [s]: long enough for a few calls on a busy host."""


@pytest.fixture(scope="session")
def pkis(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pki, Pki]:
    return make_pkis(tmp_path_factory.mktemp("pki"))


@pytest.fixture(scope="session")
def shared(pkis: tuple[Pki, Pki]) -> Iterator[Served]:
    with Served(pkis, insecure=True, history=50, heartbeat_s=HEARTBEAT_S) as served:
        yield served


@pytest.fixture
def served(shared: Served) -> Iterator[Served]:
    """The shared server, which behaves as it should before and after."""
    yield shared
    shared.ask("behave")
    for tag in ("L.sp", "cool.man"):
        shared.ask(f"release {tag}")
    shared.ask("permit yes")
