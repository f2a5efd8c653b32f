"""What ends a command from within chooses no exit status."""

from __future__ import annotations

import argparse

import pytest

from homeostat.cli.commands import cases
from homeostat.cli.main import main


@pytest.mark.parametrize("status", [0, None, 3])
def test_who_ends_the_process_from_within_a_command_is_a_bug(
    status: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def leave(options: argparse.Namespace) -> int:
        raise SystemExit(status)

    monkeypatch.setattr(cases, "carry_out", leave)
    with pytest.raises(RuntimeError, match="ended from within"):
        main(["cases"])
