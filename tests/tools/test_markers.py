"""`make quick` and `make wide` read a few folders only; every test with their marker is in one of them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.quick
@pytest.mark.parametrize("marker", ["quick", "wide"])
def test_every_marked_test_is_where_it_is_looked_for(marker: str) -> None:
    line = re.search(rf"^{marker.upper()} := (.*)$", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert line is not None
    places = [ROOT / place for place in line[1].split()]
    assert all(place.exists() for place in places)
    marked = [
        file for file in (ROOT / "tests").rglob("test_*.py") if f"pytest.mark.{marker}" in file.read_text("utf-8")
    ]
    assert len(marked) > 5
    for file in marked:
        assert any(place == file or place in file.parents for place in places), file
