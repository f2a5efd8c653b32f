"""What an attack needs of a version of the code that is attacked.

Every attack runs on this code, which must withstand it, and on commit 170fbcd, which must fail for the stated reason.
S1 to S17 number the attacks; S18, mutation, is ``tests/guard/test_mutants.py``.
"""

from __future__ import annotations

from typing import Any, Protocol

from tests.safety.attacks.plant import Attack, Report


class Subject(Protocol):
    """A version of the code, attached to a plant that is attacked."""

    def supervise(self, attack: Attack) -> Report:
        """All of it, with recovery beside: monitoring notices, recovery thinks, something is released."""
        ...

    def request(self, attack: Attack) -> Report:
        """Whoever may write, asked straight for what the attack asks; a twin would say yes to everything."""
        ...

    def batch(self, end_s: float) -> dict[str, Any]:
        """The nominal batch of the mixing module up to ``end_s`` [s].

        ``wire``: [process time, [[tag, value], ...]] of what reached the plant; ``written``: how many of these came by
        the plant's port; ``intended``: those that the journal holds, in the same form as far as it has one.
        """
        ...

    def loads(self, plant: str, file: str, before: str, after: str) -> str:
        """Why a shipped plant is refused with one text in one of its files replaced; empty where it loads.

        Where it loads because something was made again, what.
        """
        ...

    def verifies(self, forgery: str) -> bool:
        """Whether verification calls a forged run, chained anew as a whole, complete and vouched for."""
        ...
