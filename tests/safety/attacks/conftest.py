"""The two subjects."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.safety.attacks.past import NoPast, Past
from tests.safety.attacks.present import Present


@pytest.fixture(scope="session")
def present(tmp_path_factory: pytest.TempPathFactory) -> Present:
    """This code."""
    return Present(tmp_path_factory.mktemp("present"))


@pytest.fixture(scope="session")
def past(request: pytest.FixtureRequest) -> Iterator[Past]:
    """The code of commit 170fbcd; skipped where git does not have it."""
    try:
        subject = Past(request.config.cache.mkdir("homeostat-past"))
    except NoPast as reason:
        pytest.skip(str(reason))
    yield subject
    subject.close()
