"""Names of columns."""

from __future__ import annotations

import pytest

from homeostat.process.model import column


def test_a_column_is_found_by_name() -> None:
    assert column(("V", "T"), "T") == 1


def test_a_missing_name_is_told_with_those_that_exist() -> None:
    with pytest.raises(KeyError, match=r"no 'X'; it has V, T"):
        column(("V", "T"), "X")
